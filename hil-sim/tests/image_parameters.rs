//! The image keeps its parameters in its flash, over resets and power failures in the midst of a save, while the board stays awake.

mod image;

use hil_sim::base::Base;
use hil_sim::emulator::{ImageBase, Setup};
use hil_sim::peripherals::stored;
use image::{Client, emulated};
use vehicle_controller::params::{Id, Params};

/// Where the image keeps them: two sectors of 16 KiB.
const PARAMETERS: u64 = 0x0810_0000;
const SECTOR: usize = 16 * 1024;

fn client() -> Client<ImageBase> {
    let mut client = Client::new(emulated(&Setup::default()));
    client.run(20);
    client
}

fn with_gate(gate: f32) -> Params {
    let mut params = Params::default();
    params.set(Id::Gate, gate).unwrap();
    params
}

/// The boots that it told of.
fn boots(client: &Client<ImageBase>) -> Vec<&str> {
    let lines = client.lines.iter().map(|(_, line)| line.as_str());
    lines.filter(|line| line.contains("! boot")).collect()
}

#[test]
fn what_is_saved_is_in_flash_and_there_after_a_reset() {
    let mut client = client();
    assert_eq!(client.ask("GetParam gate"), "Param gate 25 -");
    assert_eq!(client.ask("SetParam gate 9"), "OK");
    let asked = client.time;
    client.send("SaveParams");
    let reply = client.wait_for("OK", 600);
    let took = client.time - asked;
    println!("the first save takes {took} ms");
    assert_eq!(reply, "OK");
    assert!(
        (250..270).contains(&took),
        "{took} ms: an erase and a hundred words"
    );

    // Word for word what the library on this computer would have stored.
    let expected = stored(&with_gate(9.0));
    let kept = client.base.flash(PARAMETERS, expected.len()).unwrap();
    assert_eq!(kept, expected);
    let rest = client.base.flash(
        PARAMETERS + expected.len() as u64,
        2 * SECTOR - expected.len(),
    );
    assert!(rest.unwrap().iter().all(|byte| *byte == 0xFF));

    assert_eq!(client.ask("SetParam gate 16"), "OK");
    let asked = client.time;
    assert_eq!(client.ask("SaveParams"), "OK");
    let took = client.time - asked;
    println!("a save without an erase takes {took} ms");
    assert!(took < 20, "{took} ms");
    assert_eq!(client.ask("SetParam gate 4"), "OK");
    assert_eq!(client.ask("LoadParams"), "OK");
    assert_eq!(client.ask("GetParam gate"), "Param gate 16 -");
    assert_eq!(client.ask("ResetParams"), "OK");
    assert_eq!(client.ask("GetParam gate"), "Param gate 25 -");

    client.base.reset().unwrap();
    client.wait_for("! boot reset-pin", 50);
    assert_eq!(client.ask("GetParam gate"), "Param gate 16 -");
    assert_eq!(client.ask("GetStatus"), "Status HOLD HOLD enabled none");
}

#[test]
fn nothing_waits_for_an_erase() {
    let mut client = client();
    assert_eq!(client.ask("Stream 0.01 t"), "OK");
    client.send("SaveParams\n@7 GetStatus");
    client.run(100);
    client.send("EStop");
    client.wait_for("! fault estop", 5);
    client.wait_for("@7 Status HOLD HOLD enabled estop", 300);
    // Telemetry came every 10 ms all the while, and no watchdog bit.
    let told: Vec<f64> = client
        .lines
        .iter()
        .filter_map(|(_, line)| line.strip_prefix("~ ")?.parse().ok())
        .collect();
    assert!(told.len() > 20, "{told:?}");
    for pair in told.windows(2) {
        assert!((pair[1] - pair[0] - 0.01).abs() < 0.0015, "{pair:?}");
    }
    assert_eq!(boots(&client).len(), 1);
}

#[test]
fn a_reset_in_the_midst_of_a_save_leaves_the_old_or_the_new_set() {
    // An erase of 250 ms, then some 10 ms of words.
    for after in [120, 252, 254, 256] {
        let mut client = client();
        assert_eq!(client.ask("SetParam gate 9"), "OK");
        client.send("SaveParams");
        client.run(after);
        let told = client.lines.iter().filter(|(_, line)| line == "OK").count() > 1;
        client.base.reset().unwrap();
        client.run(50);
        // The reply may have been cut off.
        assert_eq!(boots(&client).len(), 2, "{:?}", client.lines);
        let gate = client.ask("GetParam gate");
        println!("reset {after} ms after SaveParams: {gate}, told: {told}");
        assert!(
            gate == "Param gate 9 -" || (gate == "Param gate 25 -" && !told),
            "{gate}"
        );
        assert_eq!(client.ask("GetStatus"), "Status HOLD HOLD enabled none");
        client.send("SaveParams");
        client.wait_for("OK", 600);
    }
}

#[test]
fn a_power_cut_in_the_midst_of_a_save_leaves_the_old_or_the_new_set() {
    let entries = 8 * Params::default().count() as u64;
    let commit = 16 + entries + 4;
    let mut found = [0; 2];
    // The first save: milliseconds of the erase. The second: bytes of the set, its CRC, the commit, the seal.
    for (saves, cut) in [
        (0, 100),
        (1, 0),
        (1, 200),
        (1, commit - 1),
        (1, commit),
        (1, commit + 2),
        (1, commit + 4),
    ] {
        let mut client = client();
        for _ in 0..saves {
            client.send("SaveParams");
            client.wait_for("OK", 600);
        }
        assert_eq!(client.ask("SetParam gate 9"), "OK");
        client.base.cut_flash(cut).unwrap();
        client.send("SaveParams");
        client.wait_for("! boot power-on", 600);
        let gate = client.ask("GetParam gate");
        println!("save {saves} cut at {cut}: {gate}");
        let new = gate == "Param gate 9 -";
        assert!(new || gate == "Param gate 25 -", "{gate}");
        found[usize::from(new)] += 1;
        assert_eq!(client.ask("GetStatus"), "Status HOLD HOLD enabled none");
        client.base.reset().unwrap();
        client.wait_for("! boot reset-pin", 50);
        assert_eq!(client.ask("GetParam gate"), gate, "it stays so");
    }
    assert!(found.iter().all(|count| *count > 0), "{found:?}");
}
