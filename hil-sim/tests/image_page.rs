//! The shipped image, driven from the page's WebSocket.

mod image;
mod page;

use image::image;
use page::{Heard, Server};

fn server() -> Server {
    Server::start(&["--image", image().to_str().unwrap()])
}

/// However fast the emulated board gets on here: what counts is its own time.
#[test]
fn the_page_drives_the_image() {
    let server = server();
    let mut driver = server.join("drive");
    let hello = driver.wait_for_world("hello");
    assert_eq!(hello["image"], true);
    let version = driver.ask(1, "Version");
    assert!(version.contains(" nucleo-f429zi "), "{version}");
    assert_eq!(driver.ask(2, "Stream 0.02 t x"), "OK");
    assert_eq!(driver.ask(3, "m 0.2"), "OK");
    let mut last = (0.0, 0.0);
    driver.wait("the end of the move", |heard| match heard {
        Heard::Line(line) if line.starts_with("~ ") => {
            let numbers: Vec<f64> = line[2..].split(' ').map(|n| n.parse().unwrap()).collect();
            last = (numbers[0], numbers[1]);
            false
        }
        Heard::Line(line) => line.starts_with("! move done "),
        _ => false,
    });
    assert!((last.1 - 0.2).abs() < 0.005, "{last:?}");
    let world = driver.wait_for_world("world");
    let field = |name: &str| world[name].as_f64().unwrap();
    assert!((field("x") - 0.2).abs() < 0.005, "{world}");
    // The world is told each 40 ms of the clock's time, telemetry each 20 ms of the board's.
    let ahead = field("t") - last.0;
    assert!(
        (-0.001..0.2).contains(&ahead),
        "{ahead} s ahead of {last:?}"
    );
    println!("the emulated board keeps a pace of {}", world["pace"]);
}

#[test]
fn the_world_does_to_the_image_what_the_driver_asks() {
    let server = server();
    let mut driver = server.drive();
    assert_eq!(driver.ask_world(1, r#""fault":"left motor open""#), Ok(()));
    assert_eq!(
        driver.wait_for_world("world")["broken"][0],
        "left motor open"
    );
    assert_eq!(driver.ask_world(2, r#""clear":true"#), Ok(()));
    driver.ask(1, "Stream 0.1 t");
    driver.wait(
        "half a second of the board's time",
        |heard| matches!(heard, Heard::World(word) if word["world"]["t"].as_f64() > Some(0.5)),
    );
    assert_eq!(driver.ask_world(3, r#""power":"cycle""#), Ok(()));
    driver.wait(
        "a boot",
        |heard| matches!(heard, Heard::Line(line) if line.contains("! boot ")),
    );
    let t = driver.wait_for_world("world")["t"].as_f64().unwrap();
    assert!(t < 0.4, "{t}");
    assert!(driver.ask(2, "GetTime").starts_with("Time "));
}
