//! Logs, read by the library that Foxglove itself uses.

mod common;

use common::Sample;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use ros_messages::geometry_msgs::Twist;
use ros_messages::log::McapLog;
use ros_messages::nav_msgs::Odometry;
use ros_messages::tf2_msgs::TFMessage;
use ros_messages::{RosMessage, schema, to_cdr};
use std::fs::File;
use std::io::{BufWriter, Cursor};

#[test]
fn what_is_written_is_read() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mut file = Cursor::new(Vec::new());
    let mut log = McapLog::new(&mut file, "test").unwrap();
    let static_tf = TFMessage::sample(&mut rng);
    log.write_kept("/tf_static", 5, &static_tf).unwrap();
    let odometry: Vec<_> = (0..3000).map(|_| Odometry::sample(&mut rng)).collect();
    for (at, each) in odometry.iter().enumerate() {
        log.write("/odom", 10 + at as i64, each).unwrap();
    }
    // A topic has messages of one type.
    assert!(log.write("/odom", 1, &Twist::default()).is_err());
    log.finish().unwrap();
    drop(log);
    let file = file.into_inner();

    let messages: Vec<_> = mcap::MessageStream::new(&file)
        .unwrap()
        .map(Result::unwrap)
        .collect();
    assert_eq!(messages.len(), 3001);
    let [first, rest @ ..] = messages.as_slice() else {
        unreachable!()
    };
    assert_eq!(first.channel.topic, "/tf_static");
    let offered = &first.channel.metadata["offered_qos_profiles"];
    assert!(offered.contains("durability: 1"), "{offered}");
    assert_eq!(first.data.as_ref(), to_cdr(&static_tf));
    for (at, (message, expected)) in rest.iter().zip(&odometry).enumerate() {
        assert_eq!(message.channel.topic, "/odom");
        assert_eq!(message.channel.message_encoding, "cdr");
        let kind = message.channel.schema.as_ref().unwrap();
        assert_eq!(
            (kind.name.as_str(), kind.encoding.as_str()),
            (Odometry::NAME, "ros2msg")
        );
        assert_eq!(kind.data.as_ref(), schema::<Odometry>().as_bytes());
        assert_eq!(message.log_time, 10 + at as u64);
        assert_eq!(message.data.as_ref(), to_cdr(expected));
    }
    let summary = mcap::Summary::read(&file).unwrap().unwrap();
    assert_eq!(summary.stats.unwrap().message_count, 3001);
}

/// How many messages can be read of a file without an end, before where it breaks off.
fn readable(bytes: &[u8]) -> usize {
    let options = mcap::read::Options::IgnoreEndMagic;
    mcap::MessageStream::new_with_options(bytes, options.into())
        .unwrap()
        .take_while(Result::is_ok)
        .count()
}

#[test]
fn what_was_flushed_is_there_whenever_the_process_is_killed() {
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    let mut log = McapLog::new(BufWriter::new(File::create(&path).unwrap()), "test").unwrap();
    let mut flushed = 0;
    // Now and then some ten chunks pass without a flush: they end by themselves.
    for at in 0..4000 {
        let odometry = Odometry::sample(&mut rng);
        log.write("/odom", at, &odometry).unwrap();
        if at % 997 == 0 {
            log.flush().unwrap();
            flushed = at as usize + 1;
        }
        if at % 50 == 0 {
            // What the operating system has of the file is what a killed process leaves.
            let there = readable(&std::fs::read(&path).unwrap());
            assert!(
                (flushed..=at as usize + 1).contains(&there),
                "{there} of {flushed}"
            );
        }
    }
}
