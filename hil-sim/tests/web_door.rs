//! The page's server: what it serves, who gets in, and where it listens.

mod page;

use page::Server;
use serde_json::Value;
use std::io::{Read, Write};
use std::time::{Duration, Instant};

#[test]
fn the_page_is_served_and_may_load_nothing_else() {
    let server = Server::start(&[]);
    let (status, answer) = server.http("GET / HTTP/1.1\nHost: HOST\n");
    assert_eq!(status, 200, "{answer}");
    let (head, body) = answer.split_once("\r\n\r\n").unwrap();
    assert!(body.contains(r#"<meta name="base" content="served">"#));
    assert!(!body.contains(r#"content="static""#));
    let head = head.to_ascii_lowercase();
    let policy = head
        .lines()
        .find_map(|line| line.strip_prefix("content-security-policy: "))
        .unwrap();
    for part in [
        "default-src 'none'",
        "frame-ancestors 'none'",
        "base-uri 'none'",
        "form-action 'none'",
        &format!("connect-src 'self' ws://{}", server.address),
    ] {
        assert!(policy.contains(part), "{part}: {policy}");
    }
    assert!(!policy.contains("script-src 'unsafe"), "{policy}");
    for line in [
        "content-type: text/html; charset=utf-8",
        "x-content-type-options: nosniff",
        "x-frame-options: deny",
    ] {
        assert!(head.lines().any(|found| found == line), "{line}: {head}");
    }
    let ours = "GET / HTTP/1.1\nHost: HOST\nOrigin: http://HOST\n";
    assert_eq!(server.http(ours).0, 200);
}

#[test]
fn loopback_is_asked_for_by_its_names_alone() {
    let server = Server::start(&[]);
    let port = server.port();
    let get = |host: &str| server.http(&format!("GET / HTTP/1.1\nHost: {host}\n")).0;
    for good in ["127.0.0.1", "localhost", "[::1]"] {
        assert_eq!(get(&format!("{good}:{port}")), 200, "{good}");
    }
    for wrong in [
        format!("evil.example:{port}"),
        format!("192.168.1.2:{port}"),
        "127.0.0.1".to_owned(),
        format!("127.0.0.1:{}", port - 1),
    ] {
        assert_eq!(get(&wrong), 421, "{wrong}");
    }
    assert_eq!(server.http("GET / HTTP/1.0\n").0, 421);
    let target = "GET http://evil.example/ HTTP/1.1\nHost: HOST\n";
    assert_eq!(server.http(target).0, 421);
}

#[test]
fn pages_of_other_origins_are_refused() {
    let server = Server::start(&[]);
    for origin in ["http://evil.example", "null", "https://127.0.0.1"] {
        let get = format!("GET / HTTP/1.1\nHost: HOST\nOrigin: {origin}\n");
        assert_eq!(server.http(&get).0, 403, "{origin}");
        let mut socket = server.handshake("drive");
        socket
            .headers_mut()
            .insert("Origin", origin.parse().unwrap());
        assert_eq!(server.try_join(socket).err(), Some(403), "{origin}");
    }
    let mut without = server.handshake("drive");
    without.headers_mut().remove("Origin");
    assert_eq!(server.try_join(without).err(), Some(403));
    // As after DNS rebinding: both are the same, and neither is ours.
    let mut rebound = server.handshake("drive");
    let headers = rebound.headers_mut();
    headers.insert("Host", "evil.example:80".parse().unwrap());
    headers.insert("Origin", "http://evil.example:80".parse().unwrap());
    assert_eq!(server.try_join(rebound).err(), Some(421));
    // None of them has taken the seat.
    server.drive();
}

#[test]
fn there_is_the_page_and_the_base_and_nothing_else() {
    let server = Server::start(&[]);
    let ask = |request: &str| server.http(&format!("{request} HTTP/1.1\nHost: HOST\n")).0;
    assert_eq!(ask("GET /favicon.ico"), 404);
    assert_eq!(ask("GET /../Cargo.toml"), 404);
    assert_eq!(ask("POST /"), 405);
    let base = "/base HTTP/1.1\nHost: HOST\nOrigin: http://HOST\n";
    let plain = server.http(&format!("GET {base}")).0;
    assert!(plain == 400 || plain == 426, "{plain}");
    assert_eq!(server.http(&format!("POST {base}")).0, 405);
    for role in ["steer", "Drive", "drive2"] {
        assert_eq!(server.try_join(server.handshake(role)).err(), Some(400));
    }
    let mut none = server.handshake("drive");
    none.headers_mut().remove("Sec-WebSocket-Protocol");
    assert_eq!(server.try_join(none).err(), Some(400));
}

#[test]
fn other_addresses_than_loopback_must_be_allowed() {
    let mut refused = assert_cmd::Command::new(assert_cmd::cargo::cargo_bin!("hil-sim"));
    let refused = refused
        .args(["drive", "--web", "0.0.0.0:0"])
        .timeout(page::PATIENCE)
        .assert()
        .code(2);
    let error = String::from_utf8_lossy(&refused.get_output().stderr).into_owned();
    assert!(error.contains("--web-allow-remote"), "{error}");
    assert!(refused.get_output().stdout.is_empty());

    // What is printed can be opened.
    let server = Server::at("0.0.0.0:0", &["--web-allow-remote"]);
    assert!(
        server.address.starts_with("127.0.0.1:"),
        "{}",
        server.address
    );
    assert_eq!(server.http("GET / HTTP/1.1\nHost: HOST\n").0, 200);
    server.drive().ask(1, "GetTime");
    let evil = format!("GET / HTTP/1.1\nHost: evil.example:{}\n", server.port());
    assert_eq!(server.http(&evil).0, 421);
    let foreign = "GET / HTTP/1.1\nHost: HOST\nOrigin: http://evil.example\n";
    assert_eq!(server.http(foreign).0, 403);
}

#[test]
fn speed_robot_and_options_are_as_everywhere() {
    let server = Server::start(&["--speed", "100", "--robot", "cycab"]);
    let mut driver = server.join("drive");
    let hello = driver.wait_for_world("hello");
    assert_eq!(hello["speed"], 100.0);
    assert_eq!(hello["vehicle"], "bisteerable");
    assert_eq!(hello["truth"], Value::Null);
    driver.ask(1, "m 2 1");
    driver.wait_for("! move done ");
    for other in [&["--pty"][..], &["--tcp", "127.0.0.1:0"]] {
        let mut both = assert_cmd::Command::new(assert_cmd::cargo::cargo_bin!("hil-sim"));
        both.args(["--web", "0"]).args(other).assert().code(2);
    }
    let mut alone = assert_cmd::Command::new(assert_cmd::cargo::cargo_bin!("hil-sim"));
    alone.arg("--web-allow-remote").assert().code(2);
    for speed in ["101", "max"] {
        let mut fast = assert_cmd::Command::new(assert_cmd::cargo::cargo_bin!("hil-sim"));
        let fast = fast.args(["--web", "0", "--speed", speed]);
        let fast = fast.timeout(page::PATIENCE).assert().code(2);
        let error = String::from_utf8_lossy(&fast.get_output().stderr).into_owned();
        assert!(error.contains("up to 100"), "{error}");
    }
    // A taken port is told, not waited for.
    let mut taken = assert_cmd::Command::new(assert_cmd::cargo::cargo_bin!("hil-sim"));
    let taken = taken
        .args(["--web", &server.address])
        .timeout(page::PATIENCE)
        .assert()
        .code(2);
    let error = String::from_utf8_lossy(&taken.get_output().stderr).into_owned();
    assert!(
        error.contains(&server.address) && error.contains("--web 0"),
        "{error}"
    );
}

#[test]
fn who_connects_and_says_nothing_is_dropped() {
    let server = Server::start(&[]);
    let mut silent = server.connect();
    let mut slow = server.connect();
    slow.write_all(b"GET / HTTP/1.1\r\nHost: ").unwrap();
    let began = Instant::now();
    for stream in [&mut silent, &mut slow] {
        let mut rest = Vec::new();
        // Closed or reset: both are an end.
        let _ = stream.read_to_end(&mut rest);
    }
    let took = began.elapsed().as_secs_f64();
    assert!((4.0..9.0).contains(&took), "{took} s");
}

#[test]
fn there_is_room_for_so_many_and_no_more() {
    let server = Server::start(&[]);
    let mut watchers: Vec<_> = (0..15).map(|_| server.watch()).collect();
    // Who watches keeps nobody from driving.
    let mut driver = server.drive();
    let extra = server.try_join(server.handshake("watch"));
    assert_eq!(extra.err(), Some(503));
    assert!(driver.ask(1, "GetTime").starts_with("Time "));
    for watcher in &mut watchers {
        watcher.wait_for("@1 Time ");
    }
    watchers.pop();
    // Its place is free as soon as the server has seen it go.
    let deadline = Instant::now() + page::PATIENCE;
    while server.try_join(server.handshake("watch")).is_err() {
        assert!(Instant::now() < deadline, "the place stays taken");
        std::thread::sleep(Duration::from_millis(20));
    }

    let idle: Vec<_> = (0..64).map(|_| server.connect()).collect();
    std::thread::sleep(Duration::from_millis(200));
    let mut further = server.connect();
    // It is closed at once, whatever it says.
    let _ = further.write_all(b"GET / HTTP/1.1\r\n\r\n");
    let began = Instant::now();
    let mut answer = Vec::new();
    let _ = further.read_to_end(&mut answer);
    assert!(answer.is_empty() && began.elapsed() < Duration::from_secs(4));
    assert!(driver.ask(2, "GetTime").starts_with("Time "));
    drop(idle);
    let deadline = Instant::now() + page::PATIENCE;
    loop {
        let mut stream = server.connect();
        let get = format!("GET / HTTP/1.1\r\nHost: {}\r\n\r\n", server.address);
        let mut answer = String::new();
        let _ = stream.write_all(get.as_bytes());
        let _ = stream.read_to_string(&mut answer);
        if answer.starts_with("HTTP/1.1 200") {
            break;
        }
        assert!(Instant::now() < deadline, "nobody is let in any more");
        std::thread::sleep(Duration::from_millis(20));
    }
}
