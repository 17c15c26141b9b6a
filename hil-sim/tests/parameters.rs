//! A simulated base keeps its parameters over power failures, and stays a base while it writes them.

use hil_sim::peripherals::FakeFlash;
use hil_sim::rig::Rig;
use hil_sim::robot::Robot;
use vehicle_controller::params::store::Store;
use vehicle_controller::params::{Id, Params};

struct Client {
    rig: Rig,
    lines: Vec<String>,
    partial: Vec<u8>,
}

impl Client {
    fn new(rig: Rig) -> Self {
        Self {
            rig,
            lines: Vec::new(),
            partial: Vec::new(),
        }
    }

    fn run(&mut self, milliseconds: u32) {
        for _ in 0..milliseconds {
            self.rig.tick();
            for byte in self.rig.receive() {
                match byte {
                    b'\n' => {
                        let line = std::mem::take(&mut self.partial);
                        self.lines.push(String::from_utf8(line).unwrap());
                    }
                    b'\r' => {}
                    byte => self.partial.push(byte),
                }
            }
        }
    }

    /// Sends a line; its reply, and the milliseconds until it came.
    fn timed(&mut self, line: &str) -> (String, u32) {
        let from = self.lines.len();
        self.rig.send(format!("{line}\n").as_bytes());
        for milliseconds in 1..2000 {
            self.run(1);
            let reply = |line: &&String| !line.starts_with(['!', '~']);
            if let Some(reply) = self.lines[from..].iter().find(reply) {
                return (reply.clone(), milliseconds);
            }
        }
        panic!("`{line}` is not answered: {:?}", self.lines);
    }

    fn ask(&mut self, line: &str) -> String {
        self.timed(line).0
    }
}

fn rig(robot: &str) -> Rig {
    Rig::new(&Robot::load(robot).unwrap(), 1).unwrap()
}

#[test]
fn what_is_saved_is_there_after_power_has_failed() {
    let mut client = Client::new(rig("robuter"));
    assert_eq!(client.ask("GetParam wheel_base"), "Param wheel_base 0.64 m");
    assert_eq!(client.ask("SetParam wheel_base 0.63"), "OK");
    let (reply, milliseconds) = client.timed("SaveParams");
    assert_eq!(reply, "OK");
    // The first save erases: 250 ms.
    assert!((250..300).contains(&milliseconds), "{milliseconds} ms");
    assert_eq!(client.ask("SetParam wheel_base 0.62"), "OK");
    client.lines.clear();
    client.rig.power_cycle().unwrap();
    assert_eq!(client.ask("GetParam wheel_base"), "Param wheel_base 0.63 m");
    assert_eq!(client.lines[0], "! boot power-on");
    assert_eq!(client.ask("ResetParams"), "OK");
    assert_eq!(client.ask("GetParam wheel_base"), "Param wheel_base 0.64 m");
    assert_eq!(client.ask("LoadParams"), "OK");
    assert_eq!(client.ask("GetParam wheel_base"), "Param wheel_base 0.63 m");
    // It is as it is stored: nothing is written.
    let wear = client.rig.flash().wear();
    assert_eq!(client.ask("SaveParams"), "OK");
    assert_eq!(client.rig.flash().wear(), wear);
}

#[test]
fn a_cut_at_each_moment_of_a_save_starts_the_base_with_the_old_or_the_new_set() {
    // In the first save: an erase, the words of the set, and what ends it.
    let set = 4 * (4 + 2 * Params::default().count() as u64 + 1 + 2);
    let mut found = [0; 2];
    for cut in [
        0,
        100,
        249,
        250,
        251,
        300,
        249 + set - 8,
        249 + set,
        250 + set,
    ] {
        let mut client = Client::new(rig("default"));
        client.run(10);
        assert_eq!(client.ask("SetParam gate 9"), "OK");
        client.rig.cut_flash(cut);
        client.lines.clear();
        client.rig.send(b"SaveParams\n");
        client.run(400);
        let told = client.lines.contains(&"OK".to_owned());
        let restarted = client.lines.contains(&"! boot power-on".to_owned());
        assert_eq!(
            (told, restarted),
            (cut >= 250 + set, cut < 250 + set),
            "{cut}"
        );
        let gate = client.ask("GetParam gate");
        let new = gate == "Param gate 9 -";
        assert!(new || (gate == "Param gate 25 -" && !told), "{cut}: {gate}");
        assert_eq!(client.ask("GetStatus"), "Status HOLD HOLD enabled none");
        found[usize::from(new)] += 1;
    }
    assert!(found.iter().all(|count| *count > 0), "{found:?}");
}

#[test]
fn the_time_of_the_base_begins_anew_and_it_drives() {
    let mut client = Client::new(rig("default"));
    client.run(3000);
    client.rig.power_cycle().unwrap();
    client.run(5);
    let time = client.ask("GetTime");
    let seconds: f64 = time.strip_prefix("Time ").unwrap().parse().unwrap();
    assert!(seconds < 0.02, "{time}");
    let before = client.rig.plant().pose()[0];
    assert_eq!(client.ask("m 0.3"), "OK");
    client.run(3000);
    let travelled = client.rig.plant().pose()[0] - before;
    assert!((travelled - 0.3).abs() < 0.005, "{travelled}");
}

#[test]
fn an_emergency_stop_is_obeyed_in_the_midst_of_an_erase() {
    let mut client = Client::new(rig("default"));
    client.run(10);
    client.lines.clear();
    client.rig.send(b"SetParam gate 9\nSaveParams\n");
    client.run(50);
    assert!(client.rig.flash().is_erasing());
    client.rig.send(b"EStop\n@5 GetStatus\n");
    client.run(5);
    assert_eq!(client.lines, ["OK", "! fault estop"]);
    client.run(400);
    let replies = ["OK", "OK", "@5 Status HOLD HOLD enabled estop"];
    assert_eq!(client.lines[2..], replies, "in their order");
}

#[test]
fn a_flash_full_of_garbage_is_a_fault_that_can_be_cleared() {
    let robot = Robot::load("default").unwrap();
    let mut flash = FakeFlash::new(1, 250);
    flash.place(0, &vec![0x5A; 32_768]);
    let mut client = Client::new(Rig::with_flash(&robot, 1, flash).unwrap());
    assert_eq!(client.ask("GetStatus"), "Status HOLD HOLD enabled storage");
    assert!(client.ask("m 1").starts_with("ERR fault storage"));
    assert!(client.ask("LoadParams").starts_with("ERR storage "));
    assert_eq!(client.ask("ClearFault"), "OK");
    assert_eq!(client.ask("SaveParams"), "OK");
    client.rig.power_cycle().unwrap();
    assert_eq!(client.ask("GetStatus"), "Status HOLD HOLD enabled none");
    assert_eq!(client.ask("LoadParams"), "OK");
}

#[test]
fn what_another_firmware_has_stored_is_taken_as_far_as_it_goes() {
    let robot = Robot::load("default").unwrap();
    let mut store = Store::open(FakeFlash::<16_384>::new(1, 1));
    store.start_save();
    while store.poll(&robot.params).is_none() {}
    let mut flash = store.into_flash();
    // `gate` beyond its range, with the CRC that belongs to that.
    let bytes = flash.bytes();
    let entry = bytes
        .windows(4)
        .position(|window| window == Id::Gate.key().to_le_bytes())
        .unwrap();
    let crc_at = 16 + 8 * Params::default().count();
    let mut set = bytes[..crc_at].to_vec();
    set[entry + 4..entry + 8].copy_from_slice(&(-1.0_f32).to_le_bytes());
    flash.place(0, &set);
    flash.place(crc_at, &crc32(&set[4..]).to_le_bytes());
    let mut client = Client::new(Rig::with_flash(&robot, 1, flash).unwrap());
    assert_eq!(client.ask("GetStatus"), "Status HOLD HOLD enabled none");
    let told = ["! boot power-on", "! params default gate"];
    assert_eq!(client.lines[..2], told);
    assert_eq!(client.ask("GetParam gate"), "Param gate 25 -");
    client.lines.clear();
    assert_eq!(client.ask("LoadParams"), "OK");
    assert!(client.lines.contains(&told[1].to_owned()));
}

/// CRC-32/ISO-HDLC, bit by bit.
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(u32::MAX, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| {
            (crc >> 1) ^ if crc & 1 == 0 { 0 } else { 0xEDB8_8320 }
        })
    })
}

#[test]
fn the_defaults_of_a_base_are_its_robots() {
    for robot in Robot::presets() {
        let robot = Robot::load(robot).unwrap();
        let mut store = Store::open(FakeFlash::<16_384>::new(1, 1));
        assert_eq!(store.load_or_defaults(&robot.params).params, robot.params);
        store.start_save();
        while store.poll(&robot.params).is_none() {}
        let restored = store.load(&Params::of(robot.params.vehicle())).unwrap();
        assert_eq!(restored.params, robot.params);
    }
}

#[test]
fn neither_is_done_while_the_base_moves_and_nothing_stored_is_an_error() {
    let mut client = Client::new(rig("default"));
    assert_eq!(client.ask("LoadParams"), "ERR storage nothing is stored");
    assert_eq!(client.ask("m inf 0.2"), "OK");
    client.run(300);
    for line in ["SaveParams", "LoadParams"] {
        assert!(client.ask(line).starts_with("ERR moving "), "{line}");
    }
    assert_eq!(client.rig.flash().wear().written, 0);
    assert_eq!(client.ask("Stop"), "OK");
    client.run(1000);
    assert_eq!(client.ask("@3 SaveParams"), "@3 OK");
    assert_eq!(client.ask("@4 LoadParams"), "@4 OK");
}

/// CRC-16/CCITT-FALSE, in upper-case hex, behind a line.
fn checked(line: &str) -> String {
    let crc = line.bytes().fold(0xFFFF, |crc: u16, byte| {
        (0..8).fold(crc ^ u16::from(byte) << 8, |crc, _| {
            crc << 1 ^ if crc & 0x8000 == 0 { 0 } else { 0x1021 }
        })
    });
    format!("{line}*{crc:04X}")
}

#[test]
fn when_loaded_parameters_require_checks_the_first_letters_decide_their_case() {
    // Its check has letters.
    let upper = "@0 GetTime*AB3D";
    assert_eq!(checked("@0 GetTime"), upper);
    let lower = "@0 GetTime*ab3d";
    for [its, other] in [[upper, lower], [lower, upper]] {
        let mut client = Client::new(rig("default"));
        assert_eq!(client.ask("SetParam require_crc 1"), "OK");
        for line in ["SaveParams", "SetParam require_crc 0"] {
            assert!(client.ask(&checked(line)).starts_with("OK*"), "{line}");
        }
        assert_eq!(client.ask("LoadParams"), "OK");
        for (line, is_right) in [(its, true), (other, false), (its, true)] {
            let reply = client.ask(line);
            assert_eq!(reply.starts_with("@0 Time "), is_right, "{reply}");
        }
    }
}
