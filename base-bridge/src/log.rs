//! A log of what is published: an MCAP file that Foxglove and `ros2 bag` open.

use crate::convert::messages::{Message, messages};
use crate::names::whole;
use crate::network::{Network, Report};
use crate::params::Params;
use anyhow::{Context, Result};
use ros_messages::log::McapLog;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// What was published before this outlives the process, whatever becomes of it.
const FLUSH: Duration = Duration::from_secs(1);

/// Writes reports down as messages.
pub struct Log {
    /// None, when it could not be written any more.
    file: Option<McapLog<BufWriter<File>>>,
    params: Params,
    topics: Topics,
    flushed: Instant,
}

/// Their names.
struct Topics {
    odom: String,
    tf: String,
    joints: String,
    battery: String,
    diagnostics: String,
}

impl Log {
    /// A new file; one of that name is replaced.
    ///
    /// # Errors
    /// If it cannot be made.
    pub fn create(path: &Path, params: &Params, namespace: &str) -> Result<Self> {
        let make = || -> Result<_> {
            let file = BufWriter::new(File::create(path)?);
            Ok(McapLog::new(
                file,
                concat!("base-bridge ", env!("CARGO_PKG_VERSION")),
            )?)
        };
        let log = make().with_context(|| path.display().to_string())?;
        let name = |topic: &str| whole(namespace, topic);
        Ok(Self {
            file: Some(log),
            topics: Topics {
                odom: name(&params.topic_odom),
                tf: name(&params.topic_tf),
                joints: name(&params.topic_joints),
                battery: name(&params.topic_battery),
                diagnostics: name(&params.topic_diagnostics),
            },
            params: params.clone(),
            flushed: Instant::now(),
        })
    }

    fn write(&mut self, message: &Message) -> Result<()> {
        let Some(log) = &mut self.file else {
            return Ok(());
        };
        let topics = &self.topics;
        let now = now();
        match message {
            Message::Odometry(odometry) => log.write(&topics.odom, now, odometry.as_ref()),
            Message::Transforms(transforms) => log.write(&topics.tf, now, transforms),
            Message::Joints(joints) => log.write(&topics.joints, now, joints),
            Message::Battery(battery) => log.write(&topics.battery, now, battery.as_ref()),
            Message::Diagnostics(diagnostics) => log.write(&topics.diagnostics, now, diagnostics),
        }?;
        if self.flushed.elapsed() >= FLUSH {
            self.flushed = Instant::now();
            log.flush()?;
        }
        Ok(())
    }
}

/// When a message is published, ns since 1970: its own stamp says when it was measured.
fn now() -> i64 {
    let wall = SystemTime::now().duration_since(UNIX_EPOCH);
    wall.unwrap_or(Duration::ZERO).as_nanos() as i64
}

impl Network for Log {
    fn publish(&mut self, report: &Report) {
        for message in messages(&self.params, report) {
            if let Err(error) = self.write(&message) {
                // A full disk must not stop a base that somebody drives.
                eprintln!("the log ends here: {error:#}");
                self.file = None;
            }
        }
    }

    fn close(&mut self) {
        if let Some(mut log) = self.file.take()
            && let Err(error) = log.finish()
        {
            eprintln!("the log has no end: {error:#}");
        }
    }
}
