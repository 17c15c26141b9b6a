//! Foxglove, live: what is published, to who opens the bridge's WebSocket.

use crate::aside::tell;
use crate::network::Network;
use crate::time::now;
use anyhow::{Context as _, Result, anyhow};
use foxglove::{
    ChannelBuilder, Context, PartialMetadata, RawChannel, Schema, WebSocketServer,
    WebSocketServerHandle,
};
use ros_messages::base::{Message, Names, Report, footprint, messages};
use std::collections::HashMap;
use std::net::SocketAddr;
use std::sync::Arc;

/// A server of its own. It has threads of its own, too, and who is too slow for it misses messages.
pub struct Foxglove {
    names: Names,
    context: Arc<Context>,
    /// By topic.
    channels: HashMap<String, Arc<RawChannel>>,
    server: Option<WebSocketServerHandle>,
}

impl Foxglove {
    /// Serves at an address.
    ///
    /// # Errors
    /// If that cannot be had.
    pub fn serve(address: SocketAddr, names: Names) -> Result<Self> {
        let context = Context::new();
        let server = WebSocketServer::new()
            .name(&names.node)
            .bind(address.ip().to_string(), address.port())
            .context(&context)
            .start_blocking()
            .map_err(|error| anyhow!("{error}"))
            .with_context(|| format!("serving Foxglove at {address}"))?;
        Ok(Self {
            names,
            context,
            channels: HashMap::new(),
            server: Some(server),
        })
    }

    fn log(&mut self, message: &Message) -> Result<()> {
        let topic = message.topic(&self.names.topics);
        if !self.channels.contains_key(topic) {
            let schema = Schema::new(message.kind(), "ros2msg", message.schema().into_bytes());
            let channel = ChannelBuilder::new(topic)
                .message_encoding("cdr")
                .schema(schema)
                .context(&self.context)
                .build_raw()?;
            self.channels.insert(topic.to_owned(), channel);
        }
        let time = u64::try_from(now()).unwrap_or(0);
        self.channels[topic].log_with_meta(&message.cdr(), PartialMetadata::with_log_time(time));
        Ok(())
    }
}

impl Network for Foxglove {
    fn publish(&mut self, report: &Report) {
        let mut all = messages(&self.names, report);
        // Nothing is kept here for who comes later: he waits for a second.
        if matches!(report, Report::Diagnostics { .. }) {
            all.extend(footprint(&self.names).map(Message::Kept));
        }
        for message in &all {
            if let Err(error) = self.log(message) {
                // Two topics of one name, say. The base is driven on.
                tell(&format!("Foxglove: {error:#}"));
            }
        }
    }

    fn close(&mut self) {
        if let Some(server) = self.server.take() {
            drop(server.stop());
        }
    }
}
