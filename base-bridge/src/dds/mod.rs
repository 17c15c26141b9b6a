//! The network of ROS 2: DDS, by `rustdds`.
//!
//! What is published goes out from the bridge's own thread and never waits: a reader that is too slow misses samples. What comes in is heard by a thread of
//! its own.

pub mod environment;
mod incoming;
mod outgoing;
mod said;

use crate::network::{Inbox, Network};
use crate::params::Params;
use anyhow::{Context as _, Result, anyhow};
use environment::Environment;
use incoming::Ears;
use outgoing::Mouth;
use ros_messages::base::Report;
use ros2_client::dds::rustdds::DomainParticipantBuilder;
use ros2_client::dds::{Context, Node};
use ros2_client::{NodeName, NodeOptions};
use std::net::Ipv4Addr;

/// A node on the network.
pub struct Dds {
    /// What it says.
    mouth: Mouth,
    /// What it hears; none when it has left.
    ears: Option<Ears>,
    // Last: what is theirs goes first.
    _node: Node,
    _context: Context,
}

impl Dds {
    /// Joins the network. `namespace` and `name` are the node's.
    ///
    /// # Errors
    /// If there is no such network, or a name is none.
    pub fn join(
        namespace: &str,
        name: &str,
        params: &Params,
        environment: &Environment,
        inbox: &Inbox,
    ) -> Result<Self> {
        let mut participant = DomainParticipantBuilder::new(environment.domain);
        if environment.localhost_only {
            participant = participant.with_only_networks([Ipv4Addr::LOCALHOST]);
        }
        let participant = participant.build().map_err(|error| anyhow!("{error:?}"));
        let participant = participant.with_context(|| {
            format!(
                "joining the network of ROS_DOMAIN_ID {}",
                environment.domain
            )
        })?;
        let context = Context::from_domain_participant(participant)
            .map_err(|error| anyhow!("the network: {error}"))?;
        let space = format!("/{}", namespace.trim_matches('/'));
        let node_name = NodeName::new(&space, name)
            .map_err(|error| anyhow!("a node cannot be called `{name}` in `{space}`: {error:?}"))?;
        let options = NodeOptions::new()
            .enable_rosout(false)
            .start_parameter_services(false);
        let mut node = context
            .new_node(node_name, options)
            .map_err(|error| anyhow!("the node: {error:?}"))?;
        let mouth = Mouth::new(&mut node, &params.names(namespace, name), params)?;
        let ears = Ears::new(&mut node, namespace, params, inbox)?;
        Ok(Self {
            mouth,
            ears: Some(ears),
            _node: node,
            _context: context,
        })
    }
}

impl Network for Dds {
    fn publish(&mut self, report: &Report) {
        self.mouth.say(report);
    }

    fn close(&mut self) {
        if let Some(ears) = self.ears.take() {
            ears.close();
        }
    }
}
