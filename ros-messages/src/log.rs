//! Logs of messages: MCAP files with the profile `ros2`, which Foxglove and `ros2 bag` open.
//!
//! A log is written in chunks, each of which ends after [`CHUNK`] bytes or with [`McapLog::flush`]: what is not in a chunk that has ended is lost when the
//! process is killed, so a writer flushes about once a second. The file of a killed process has no index and no end. Foxglove and `mcap` read it up to where
//! it breaks off; for `ros2 bag`, `mcap recover BROKEN.mcap -o WHOLE.mcap` makes a whole one. A power failure takes what the operating system has not yet
//! written, too: who minds calls `File::sync_data` after a flush.

use crate::{RosMessage, schema, to_cdr};
use mcap::records::MessageHeader;
use mcap::{McapError, WriteOptions, Writer};
use std::collections::{BTreeMap, HashMap};
use std::io::{Seek, Write};

/// Bytes in a chunk.
pub const CHUNK: u64 = 256 << 10;

/// How the topic's publisher offers its messages, in the YAML of `ros2 bag`: reliable, and kept for who comes later.
const KEPT: &str = "- history: 1\n  depth: 1\n  reliability: 1\n  durability: 1\n  deadline:\n    sec: 9223372036\n    nsec: 854775807\n  lifespan:\n    sec: 9223372036\n    nsec: 854775807\n  liveliness: 1\n  liveliness_lease_duration:\n    sec: 9223372036\n    nsec: 854775807\n  avoid_ros_namespace_conventions: false";

/// A log that is being written.
pub struct McapLog<W: Write + Seek> {
    writer: Writer<W>,
    /// Of each topic: its channel, the type of its messages, and how many there were.
    topics: HashMap<String, Topic>,
}

struct Topic {
    channel: u16,
    kind: &'static str,
    written: u32,
}

impl<W: Write + Seek> McapLog<W> {
    /// An empty one. `library` is who writes it.
    ///
    /// # Errors
    /// If nothing can be written there.
    pub fn new(output: W, library: &str) -> Result<Self, McapError> {
        let writer = WriteOptions::new()
            .profile("ros2")
            .library(library)
            // Those that there are, are written in C; `mcap compress` makes a log smaller afterwards.
            .compression(None)
            .chunk_size(Some(CHUNK))
            .create(output)?;
        Ok(Self {
            writer,
            topics: HashMap::new(),
        })
    }

    /// Writes a message of a topic down. `stamp`: when it was published, ns since 1970; it is the log's time, too.
    ///
    /// # Errors
    /// If it cannot be written, or the topic has had messages of another type.
    ///
    /// # Panics
    /// After [`Self::finish`].
    pub fn write<M: RosMessage>(
        &mut self,
        topic: &str,
        stamp: i64,
        message: &M,
    ) -> Result<(), McapError> {
        self.put(topic, stamp, message, false)
    }

    /// The same for what a publisher keeps for who comes later, as `/tf_static`.
    ///
    /// # Errors
    /// As of [`Self::write`].
    ///
    /// # Panics
    /// As there.
    pub fn write_kept<M: RosMessage>(
        &mut self,
        topic: &str,
        stamp: i64,
        message: &M,
    ) -> Result<(), McapError> {
        self.put(topic, stamp, message, true)
    }

    fn put<M: RosMessage>(
        &mut self,
        name: &str,
        stamp: i64,
        message: &M,
        kept: bool,
    ) -> Result<(), McapError> {
        if !self.topics.contains_key(name) {
            let topic = self.begin::<M>(name, kept)?;
            self.topics.insert(name.to_owned(), topic);
        }
        let Some(topic) = self.topics.get_mut(name) else {
            return Ok(());
        };
        if topic.kind != M::NAME {
            return Err(McapError::ConflictingSchemas(M::NAME.to_owned()));
        }
        topic.written = topic.written.wrapping_add(1);
        let time = u64::try_from(stamp).unwrap_or(0);
        let header = MessageHeader {
            channel_id: topic.channel,
            sequence: topic.written,
            log_time: time,
            publish_time: time,
        };
        self.writer
            .write_to_known_channel(&header, &to_cdr(message))
    }

    fn begin<M: RosMessage>(&mut self, name: &str, kept: bool) -> Result<Topic, McapError> {
        let schema = self
            .writer
            .add_schema(M::NAME, "ros2msg", schema::<M>().as_bytes())?;
        let mut metadata = BTreeMap::new();
        let offered = if kept { KEPT } else { "" };
        metadata.insert("offered_qos_profiles".to_owned(), offered.to_owned());
        let channel = self.writer.add_channel(schema, name, "cdr", &metadata)?;
        Ok(Topic {
            channel,
            kind: M::NAME,
            written: 0,
        })
    }

    /// Ends the chunk: what was written until now outlives the process.
    ///
    /// # Errors
    /// If it cannot be written.
    ///
    /// # Panics
    /// After [`Self::finish`].
    pub fn flush(&mut self) -> Result<(), McapError> {
        self.writer.flush()
    }

    /// Ends the log: nothing can be written after that. A log that is dropped ends, too, but nobody hears of an error.
    ///
    /// # Errors
    /// If its end cannot be written.
    pub fn finish(&mut self) -> Result<(), McapError> {
        self.writer.finish().map(drop)
    }
}
