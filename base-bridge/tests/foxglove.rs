//! `--foxglove`: a client of its WebSocket subscribes, and reads what is published.

use assert_cmd::cargo::cargo_bin;
use ros_messages::nav_msgs::Odometry;
use ros_messages::{RosMessage, from_cdr, schema};
use serde_json::{Value, json};
use std::net::TcpListener;
use std::process::{Child, Command, Stdio};
use std::time::Duration;
use tungstenite::client::IntoClientRequest;
use tungstenite::{Message, WebSocket};

struct Bridge(Child);

impl Drop for Bridge {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Someone who speaks Foxglove's protocol, as far as it goes here.
fn open(address: &str) -> WebSocket<std::net::TcpStream> {
    for _ in 0..200 {
        if let Ok(stream) = std::net::TcpStream::connect(address) {
            stream
                .set_read_timeout(Some(Duration::from_secs(10)))
                .unwrap();
            let mut request = format!("ws://{address}").into_client_request().unwrap();
            let protocol = "foxglove.sdk.v1".parse().unwrap();
            request
                .headers_mut()
                .insert("Sec-WebSocket-Protocol", protocol);
            return tungstenite::client(request, stream).unwrap().0;
        }
        std::thread::sleep(Duration::from_millis(50));
    }
    panic!("nobody serves at {address}");
}

#[test]
fn what_is_published_is_seen_live() {
    let free = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = free.local_addr().unwrap().to_string();
    drop(free);
    let mut bridge = Command::new(cargo_bin!("base-bridge"));
    bridge.args(["--sim", "--namespace", "r1", "--foxglove", &address]);
    if cfg!(feature = "node") {
        bridge.arg("--offline");
    }
    let _bridge = Bridge(bridge.stderr(Stdio::null()).spawn().unwrap());
    let mut client = open(&address);
    let channel = loop {
        let Message::Text(text) = client.read().unwrap() else {
            continue;
        };
        let said: Value = serde_json::from_str(&text).unwrap();
        let channels = said["channels"].as_array().cloned().unwrap_or_default();
        if let Some(odom) = channels
            .into_iter()
            .find(|each| each["topic"] == "/r1/odom")
        {
            break odom;
        }
    };
    assert_eq!(channel["schemaName"], Odometry::NAME);
    assert_eq!(
        (
            channel["encoding"].as_str(),
            channel["schemaEncoding"].as_str()
        ),
        (Some("cdr"), Some("ros2msg"))
    );
    assert_eq!(channel["schema"], schema::<Odometry>());
    let subscribe =
        json!({"op": "subscribe", "subscriptions": [{"id": 7, "channelId": channel["id"]}]});
    client.send(Message::text(subscribe.to_string())).unwrap();
    let mut stamps = Vec::new();
    while stamps.len() < 50 {
        let Message::Binary(bytes) = client.read().unwrap() else {
            continue;
        };
        // What it is, of which subscription, when, and the message.
        if bytes[0] != 1 {
            continue;
        }
        assert_eq!(bytes[1..5], 7_u32.to_le_bytes());
        let odometry: Odometry = from_cdr(&bytes[13..]).unwrap();
        assert_eq!(odometry.child_frame_id, "base_link");
        assert!(odometry.pose.covariance.0[35] > 0.0);
        stamps.push(odometry.header.stamp.nanoseconds());
    }
    let seconds = (stamps[49] - stamps[0]) as f64 * 1e-9;
    assert!((0.9..1.5).contains(&seconds), "50 in {seconds} s");
}
