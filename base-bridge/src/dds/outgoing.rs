//! What the node says.

use crate::params::{Params, Qos};
use anyhow::{Result, anyhow};
use ros_messages::RosMessage;
use ros_messages::base::{Message, Names, Report, footprint, messages};
use ros_messages::diagnostic_msgs::DiagnosticArray;
use ros_messages::nav_msgs::Odometry;
use ros_messages::sensor_msgs::{BatteryState, JointState};
use ros_messages::tf2_msgs::TFMessage;
use ros2_client::dds::{Node, Publisher};
use ros2_client::qos::{Durability, History, QosProfile, WhenFull};
use ros2_client::{MessageTypeName, Name};

/// The publishers.
pub struct Mouth {
    names: Names,
    odometry: Publisher<Odometry>,
    transforms: Publisher<TFMessage>,
    joints: Publisher<JointState>,
    battery: Publisher<BatteryState>,
    diagnostics: Publisher<DiagnosticArray>,
    /// Kept, so that who comes later gets what it said.
    _kept: Option<Publisher<TFMessage>>,
}

impl Mouth {
    /// The publishers of a node.
    pub fn new(node: &mut Node, names: &Names, params: &Params) -> Result<Self> {
        let topics = &names.topics;
        let kept = match footprint(names) {
            Some(transform) => Some(keep(node, &topics.tf_static, *transform)?),
            None => None,
        };
        Ok(Self {
            odometry: publisher(node, &topics.odom, params.odom_qos())?,
            transforms: publisher(node, &topics.tf, params.tf_qos())?,
            joints: publisher(node, &topics.joints, params.state_qos())?,
            battery: publisher(node, &topics.battery, params.state_qos())?,
            diagnostics: publisher(node, &topics.diagnostics, params.state_qos())?,
            _kept: kept,
            names: names.clone(),
        })
    }

    /// Says what a report tells. A sample for which there is no room is lost: the next one is newer.
    pub fn say(&mut self, report: &Report) {
        for message in messages(&self.names, report) {
            let _ = match message {
                Message::Odometry(odometry) => self.odometry.publish(*odometry).is_ok(),
                Message::Transforms(transforms) => self.transforms.publish(*transforms).is_ok(),
                // It was said at the start.
                Message::Kept(_) => true,
                Message::Joints(joints) => self.joints.publish(*joints).is_ok(),
                Message::Battery(battery) => self.battery.publish(*battery).is_ok(),
                Message::Diagnostics(diagnostics) => self.diagnostics.publish(*diagnostics).is_ok(),
            };
        }
    }
}

/// What a topic is called in the network of its node.
pub fn topic<M: RosMessage>(
    node: &Node,
    name: &str,
    qos: &QosProfile,
) -> Result<ros2_client::dds::rustdds::Topic> {
    let parsed = Name::parse(name).map_err(|error| anyhow!("the topic `{name}`: {error:?}"))?;
    node.create_topic(&parsed, type_name::<M>(), qos)
        .map_err(|error| anyhow!("the topic `{name}`: {error}"))
}

fn type_name<M: RosMessage>() -> MessageTypeName {
    let mut parts = M::NAME.split('/');
    let package = parts.next().unwrap_or_default();
    MessageTypeName::new(package, parts.next_back().unwrap_or_default())
}

/// The profile of a topic that is written or read so.
pub fn profile(qos: Qos) -> QosProfile {
    let profile = QosProfile::publisher_default().history(History::KeepLast {
        depth: usize::try_from(qos.depth).unwrap_or(1),
    });
    if qos.reliable {
        profile.reliability_reliable(WhenFull::Fail)
    } else {
        profile.reliability_best_effort()
    }
}

fn publisher<M: RosMessage>(node: &mut Node, name: &str, qos: Qos) -> Result<Publisher<M>> {
    let profile = profile(qos);
    let topic = topic::<M>(node, name, &profile)?;
    node.create_publisher(&topic, Some(profile))
        .map_err(|error| anyhow!("the topic `{name}`: {error}"))
}

/// Says it once, for everybody who comes.
fn keep(node: &mut Node, name: &str, transform: TFMessage) -> Result<Publisher<TFMessage>> {
    let profile = QosProfile::publisher_default()
        .reliability_reliable(WhenFull::Fail)
        .durability(Durability::TransientLocal)
        .history(History::KeepLast { depth: 1 });
    let topic = topic::<TFMessage>(node, name, &profile)?;
    let publisher = node
        .create_publisher(&topic, Some(profile))
        .map_err(|error| anyhow!("the topic `{name}`: {error}"))?;
    publisher
        .publish(transform)
        .map_err(|error| anyhow!("the topic `{name}`: {error:?}"))?;
    Ok(publisher)
}
