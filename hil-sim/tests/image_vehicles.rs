//! The images of the other vehicles, on the emulated board: each follows the same script to where the library on this computer ends.

mod image;

use hil_sim::base::Base;
use hil_sim::emulator::{ImageBase, Setup};
use hil_sim::rig::Rig;
use hil_sim::robot::Robot;
use hil_sim::script::Script;
use image::{Client, SEED, host_on, image_of};

/// A move, a move and a turn together, a stop; a turn of which the two cars have to say that they cannot do it in place, and what they do then.
const DRIVE: &str = "
1   m 0.5
5   m 1
5   t 20
12  m inf 0.2
12.9 Stop
14  t 10
";

fn robot(name: &str) -> Robot {
    Robot::load(name).unwrap()
}

fn emulated(name: &str, vehicle: &str) -> ImageBase {
    ImageBase::new(&image_of(vehicle), &robot(name), SEED).unwrap()
}

/// What was said, without the numbers, in the alphabet's order: two axes may come to rest in the same millisecond.
fn said<B>(client: &Client<B>) -> Vec<String> {
    let is_word = |word: &&str| word.parse::<f64>().is_err();
    let words = |(_, line): &(u64, String)| {
        let words: Vec<_> = line.split(' ').filter(is_word).collect();
        words.join(" ")
    };
    let mut said: Vec<_> = client.lines.iter().map(words).collect();
    said.sort();
    said
}

/// Drives both, the image and the library, and compares what they say, where they believe to be and where they are: within metres, and radians.
fn drive_both(name: &str, vehicle: &str, script: &str, (metres, radians): (f64, f64)) {
    let script = Script::parse(script, "test").unwrap();
    let mut image = Client::new(emulated(name, vehicle));
    let mut library = Client::new(host_on(name));
    image.play(&script);
    library.play(&script);
    println!("{:?}", image.lines);
    assert_eq!(said(&image), said(&library));
    let (image, library) = (image.base, library.base);
    let (row, other) = (image.row().unwrap(), Rig::row(&library));
    let believed = [
        [row.est_x, row.est_y, row.est_theta],
        [other.est_x, other.est_y, other.est_theta],
    ];
    let true_poses = [image.plant().pose(), library.plant().pose()];
    for [[x, y, theta], [other_x, other_y, other_theta]] in [believed, true_poses] {
        let apart = (x - other_x).hypot(y - other_y);
        let turned = (theta - other_theta).abs();
        println!("{name}: {apart:.6} m and {turned:.6} rad apart");
        assert!(apart <= metres, "{apart} m");
        assert!(turned <= radians, "{turned} rad");
        // It was a drive.
        assert!(x.hypot(y) > 1.0, "{x} {y}");
        assert!(theta.abs() > 0.2, "{theta}");
    }
}

/// What the image's motors are told is what the library's are told, in the same millisecond.
const ALIKE: (f64, f64) = (1e-5, 1e-5);
/// A servo takes what the image tells it with the next pulse, up to 20 ms later; the library's at once. At 0.3 m/s that is 6 mm of way.
const BY_SERVO: (f64, f64) = (0.01, 0.01);

#[test]
fn a_synchro_drive_follows_like_the_library() {
    drive_both("synchro", "synchro", DRIVE, ALIKE);
}

#[test]
fn a_tricycle_follows_like_the_library() {
    drive_both("tricycle", "tricycle", DRIVE, BY_SERVO);
}

#[test]
fn a_bisteerable_car_follows_like_the_library() {
    drive_both("cycab", "bisteerable", DRIVE, BY_SERVO);
}

/// In place of the potentiometers.
fn with_encoder(counts_per_turn: u32) -> String {
    format!("0.5 SetParam steer_counts {counts_per_turn}\n0.5 SetParam pot_scale 0\n{DRIVE}")
}

#[test]
fn a_tricycle_may_have_an_encoder_on_its_steering() {
    drive_both("tricycle", "tricycle", &with_encoder(4096), BY_SERVO);
}

#[test]
fn a_car_may_have_an_encoder_on_its_steering() {
    drive_both("cycab", "bisteerable", &with_encoder(8192), BY_SERVO);
}

#[test]
fn a_servo_is_limp_until_something_is_to_move() {
    let mut client = Client::new(emulated("tricycle", "tricycle"));
    client.wait_for("! boot", 100);
    client.run(500);
    assert_eq!(client.base.servo(), None);
    assert_eq!(client.ask("m 0.2"), "OK");
    client.run(500);
    let pulse = client.base.servo().unwrap();
    // Straight ahead is 1.5 ms; the timer's steps are a third of a microsecond, and the controller holds its heading with a few degrees of 11.1 µs.
    assert!((pulse - 1.5e-3).abs() < 60e-6, "{pulse}");
    client.wait_for("! move done", 3000);
    client.send("EStop");
    client.run(2000);
    assert_eq!(client.base.servo(), None);
}

#[test]
fn an_image_knows_its_vehicle() {
    for (name, vehicle) in [
        ("default", "tricycle"),
        ("tricycle", "differential"),
        ("cycab", "synchro"),
    ] {
        let base = ImageBase::with(&image_of(vehicle), &robot(name), SEED, &Setup::default());
        let error = base.unwrap_err().to_string();
        assert!(
            error.contains(&format!("the vehicle `{vehicle}`")),
            "{error}"
        );
        assert!(error.contains("cargo firmware --vehicle"), "{error}");
    }
    let mut client = Client::new(emulated("cycab", "bisteerable"));
    client.wait_for("! boot", 100);
    let version = client.ask("Version");
    assert!(version.contains(" nucleo-f429zi-bisteerable "), "{version}");
}
