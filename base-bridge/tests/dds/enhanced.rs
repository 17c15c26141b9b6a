//! Services as ROS 2 has them on Fast DDS, its default: an answer finds its request by the sample's identity, which Cyclone DDS's Python cannot send. So this is a
//! client of the bridge's own library.

use crate::alone::alone;
use crate::common::sleep;
use crate::peer::Peer;
use crate::stage::{REST, Stage};
use ros_messages::services::{SetBoolRequest, SetBoolResponse, TriggerRequest, TriggerResponse};
use ros2_client::dds::rustdds::DomainParticipantBuilder;
use ros2_client::dds::{Client, Context, Node, ServiceMapping};
use ros2_client::qos::{History, QosProfile, WhenFull};
use ros2_client::{Message, Name, NodeName, NodeOptions, ServiceTypeName};
use std::net::Ipv4Addr;

/// Asks again until it is answered: nobody says when both sides have found each other.
fn call<Q: Message + Clone + 'static, A: Message + 'static>(
    client: &Client<Q, A>,
    request: &Q,
) -> A {
    for _ in 0..20 {
        let asked = client.send_request(request.clone()).unwrap();
        for _ in 0..50 {
            sleep(0.01);
            if let Some((number, answer)) = client.receive_response().unwrap() {
                assert_eq!(number, asked);
                return answer;
            }
        }
    }
    panic!("no answer");
}

fn client<Q: Message + Clone + 'static, A: Message + 'static>(
    node: &mut Node,
    name: &str,
    kind: &str,
) -> Client<Q, A> {
    let qos = QosProfile::publisher_default()
        .reliability_reliable(WhenFull::Fail)
        .history(History::KeepLast { depth: 10 });
    let name = Name::parse(name).unwrap();
    let kind = ServiceTypeName::new("std_srvs", kind);
    node.create_client(ServiceMapping::Enhanced, &name, &kind, qos.clone(), qos)
        .unwrap()
}

#[test]
fn services_are_answered_as_fast_dds_has_them() {
    alone(
        "enhanced::services_are_answered_as_fast_dds_has_them",
        || {
            let stage = Stage::set();
            let _bridge = stage.bridge(&[]);
            let mut peer = Peer::start("r1");
            peer.ask("wait 10");
            let participant = DomainParticipantBuilder::new(0)
                .with_only_networks([Ipv4Addr::LOCALHOST])
                .build()
                .unwrap();
            let context = Context::from_domain_participant(participant).unwrap();
            let options = NodeOptions::new().enable_rosout(false);
            let mut node = context
                .new_node(NodeName::new("/", "client").unwrap(), options)
                .unwrap();
            let enable =
                client::<SetBoolRequest, SetBoolResponse>(&mut node, "/r1/enable", "SetBool");
            let stop = client::<TriggerRequest, TriggerResponse>(&mut node, "/r1/stop", "Trigger");
            peer.ask("begin 0.3 0");
            stage.wait_for_speed(0.25);
            let off = call(&enable, &SetBoolRequest { data: false });
            assert!(off.success, "{off:?}");
            sleep(1.0);
            assert!(stage.base.speed().0 < REST);
            assert!(call(&enable, &SetBoolRequest { data: true }).success);
            stage.wait_for_speed(0.25);
            peer.ask("end");
            assert!(call(&stop, &TriggerRequest::default()).success);
        },
    );
}
