//! What the node hears: a thread that waits for all of it, and puts it into the bridge's inbox.

use super::outgoing::{profile, topic};
use super::said::Said;
use crate::asked::{fix, goal, speeds, stamped_speeds, uncertain};
use crate::network::{Inbox, Request};
use crate::params::{Params, ServiceMapping as Mapping};
use anyhow::{Context as _, Result, anyhow};
use futures_util::StreamExt;
use futures_util::stream::{BoxStream, select_all};
use ros_messages::RosMessage;
use ros_messages::base::names::whole;
use ros_messages::geometry_msgs::{PoseStamped, PoseWithCovarianceStamped, Twist, TwistStamped};
use ros_messages::services::{
    SetBoolRequest, SetBoolResponse, SetPoseRequest, SetPoseResponse, TriggerRequest,
    TriggerResponse,
};
use ros2_client::dds::{Node, Server, ServiceMapping, Subscription};
use ros2_client::qos::{History, QosProfile, WhenFull};
use ros2_client::{Message, Name, RmwRequestId, ServiceTypeName};
use std::sync::Arc;
use std::thread::JoinHandle;

/// Subscriptions and services.
pub struct Ears {
    thread: JoinHandle<()>,
    end: futures_channel::oneshot::Sender<()>,
}

/// Ends the bridge when it is dropped.
struct Deaf(Inbox);

impl Drop for Deaf {
    fn drop(&mut self) {
        self.0.end();
    }
}

/// Something that is heard, as a request to the bridge, and when it was said, in the bridge's seconds.
type Heard = BoxStream<'static, Option<(Request, f64)>>;

impl Ears {
    /// The ears of a node.
    pub fn new(node: &mut Node, namespace: &str, params: &Params, inbox: &Inbox) -> Result<Self> {
        let qos = profile(params.command_qos());
        let name = |each: &str| whole(namespace, each);
        let mut ears = Subscriber { node, qos, inbox };
        let mut heard = Vec::new();
        let mut listen = |topic: &str, to: &mut dyn FnMut(&str) -> Result<Heard>| -> Result<()> {
            // No name: that is left to others.
            if !topic.is_empty() {
                heard.push(to(&name(topic))?);
            }
            Ok(())
        };
        listen(&params.topic_cmd_vel, &mut |topic| {
            // One of the two, never both on one name: a reader of the other type would take its bytes for its own.
            if params.cmd_vel_stamped {
                ears.subscribe(topic, |twist: TwistStamped| stamped_speeds(&twist))
            } else {
                ears.subscribe(topic, |twist: Twist| speeds(&twist, None))
            }
        })?;
        listen(&params.topic_fix, &mut |topic| {
            ears.subscribe(topic, |pose: PoseWithCovarianceStamped| fix(&pose))
        })?;
        listen(&params.topic_goal, &mut |topic| {
            ears.subscribe(topic, |pose: PoseStamped| goal(&pose))
        })?;
        listen(&params.topic_initial, &mut |topic| {
            ears.subscribe(topic, |pose: PoseWithCovarianceStamped| {
                Request::SetPose(uncertain(&pose), None)
            })
        })?;
        heard.extend(services(ears.node, params, &name, inbox)?);
        let mut heard = select_all(heard);
        let (end, mut ended) = futures_channel::oneshot::channel::<()>();
        let inbox = inbox.clone();
        let thread = std::thread::Builder::new()
            .name("dds".into())
            .spawn(move || {
                // Whatever ends this: a bridge that hears nobody must not go on, for nobody could stop its base.
                let _end = Deaf(inbox.clone());
                futures_executor::block_on(async {
                    loop {
                        futures_util::select! {
                            next = heard.next() => {
                                let Some(next) = next else { return };
                                if next.is_some_and(|(request, said)| !inbox.put_said(request, said)) {
                                    return;
                                }
                            }
                            _ = ended => return,
                        }
                    }
                });
            })
            .context("a thread for what is heard")?;
        Ok(Self { thread, end })
    }

    /// Hears nothing more.
    pub fn close(self) {
        let _ = self.end.send(());
        // It ends by itself at the latest when the process does.
        let _ = self.thread.join();
    }
}

/// What all topics have in common.
struct Subscriber<'a> {
    node: &'a mut Node,
    qos: QosProfile,
    inbox: &'a Inbox,
}

impl Subscriber<'_> {
    fn subscribe<M: RosMessage + Send + Sync + 'static>(
        &mut self,
        name: &str,
        request: impl Fn(M) -> Request + Send + 'static,
    ) -> Result<Heard> {
        let topic = topic::<M>(self.node, name, &self.qos)?;
        let subscription: Subscription<M> = self
            .node
            .create_subscription(&topic, Some(self.qos.clone()))
            .map_err(|error| anyhow!("the topic `{name}`: {error}"))?;
        let heard = futures_util::stream::unfold(subscription, |subscription| async {
            let taken = subscription.async_take().await;
            Some((taken, subscription))
        });
        let (inbox, mut said) = (self.inbox.clone(), Said::default());
        Ok(heard
            .map(move |taken| {
                // What cannot be read as its type says is nothing.
                let (message, info) = taken.ok()?;
                Some((request(message), said.note(&info, inbox.now())))
            })
            .boxed())
    }
}

/// The services, each as what is asked by it.
fn services(
    node: &mut Node,
    params: &Params,
    name: &impl Fn(&str) -> String,
    inbox: &Inbox,
) -> Result<Vec<Heard>> {
    let mapping = match params.service_mapping() {
        Mapping::Enhanced => ServiceMapping::Enhanced,
        Mapping::Cyclone => ServiceMapping::Cyclone,
    };
    let trigger = |outcome: Result<String, String>| {
        let success = outcome.is_ok();
        let message = outcome.unwrap_or_else(|why| why);
        TriggerResponse { success, message }
    };
    Ok(vec![
        serve(
            node,
            inbox,
            mapping,
            &name(&params.service_stop),
            ("std_srvs", "Trigger"),
            trigger,
            |_: TriggerRequest, reply| Request::Stop(reply),
        )?,
        serve(
            node,
            inbox,
            mapping,
            &name(&params.service_clear),
            ("std_srvs", "Trigger"),
            trigger,
            |_: TriggerRequest, reply| Request::ClearFault(reply),
        )?,
        serve(
            node,
            inbox,
            mapping,
            &name(&params.service_enable),
            ("std_srvs", "SetBool"),
            |outcome| {
                let success = outcome.is_ok();
                let message = outcome.unwrap_or_else(|why| why);
                SetBoolResponse { success, message }
            },
            |asked: SetBoolRequest, reply| Request::Enable(asked.data, reply),
        )?,
        serve(
            node,
            inbox,
            mapping,
            &name(&params.service_set_pose),
            ("robot_localization", "SetPose"),
            |_| SetPoseResponse::default(),
            |asked: SetPoseRequest, reply| Request::SetPose(uncertain(&asked.pose), Some(reply)),
        )?,
    ])
}

fn serve<Q, A>(
    node: &mut Node,
    inbox: &Inbox,
    mapping: ServiceMapping,
    name: &str,
    (package, kind): (&str, &str),
    answer: impl Fn(Result<String, String>) -> A + Clone + Send + 'static,
    request: impl Fn(Q, crate::network::Reply) -> Request + Send + 'static,
) -> Result<Heard>
where
    Q: Message + Clone + Send + Sync + 'static,
    A: Message + Send + Sync + 'static,
{
    let parsed = Name::parse(name).map_err(|error| anyhow!("the service `{name}`: {error:?}"))?;
    let qos = QosProfile::publisher_default()
        .reliability_reliable(WhenFull::Fail)
        .history(History::KeepLast { depth: 10 });
    let server: Server<Q, A> = node
        .create_server(
            mapping,
            &parsed,
            &ServiceTypeName::new(package, kind),
            qos.clone(),
            qos,
        )
        .map_err(|error| anyhow!("the service `{name}`: {error}"))?;
    let server = Arc::new(server);
    let asked = futures_util::stream::unfold(Arc::clone(&server), |server| async {
        let taken = server.async_receive_request().await;
        Some((taken, server))
    });
    let inbox = inbox.clone();
    Ok(asked
        .map(move |taken| {
            let (id, asked): (RmwRequestId, Q) = taken.ok()?;
            let (server, answer) = (Arc::clone(&server), answer.clone());
            let reply: crate::network::Reply = Box::new(move |outcome| {
                // Who has asked may have gone.
                let _ = server.send_response(id, answer(outcome));
            });
            Some((request(asked, reply), inbox.now()))
        })
        .boxed())
}
