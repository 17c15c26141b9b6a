//! A base that is this computer's business is not heard elsewhere.

use crate::alone::{alone, sent_by};
use crate::common::sleep;
use crate::peer::Peer;
use crate::stage::Stage;

#[test]
fn not_one_packet_leaves_this_computer() {
    alone("loopback::not_one_packet_leaves_this_computer", || {
        let stage = Stage::set();
        let (before, lo) = (sent_by("cable"), sent_by("lo"));
        let bridge = stage.bridge(&[]);
        let mut peer = Peer::start("r1");
        peer.ask("wait 10");
        peer.ask("drive 0.2 0 2");
        sleep(3.0);
        assert!(bridge.terminate().success());
        let (cable, lo) = (sent_by("cable") - before, sent_by("lo") - lo);
        assert!(
            cable == 0 && lo > 300,
            "{cable} by the cable, {lo} by loopback"
        );
        // The cable carries what is sent there: without the option, it is announced to everybody.
        let before = sent_by("cable");
        let bridge = stage.bridge_everywhere(&[]);
        sleep(3.0);
        assert!(bridge.terminate().success());
        let everywhere = sent_by("cable") - before;
        println!("packets on another interface: {cable}; by default {everywhere}");
        assert!(everywhere > 5, "{everywhere}");
    });
}
