//! A bridge and a simulated base, in real time.

mod common;

use base_bridge::params::Params;
use common::cable::Wire;
use common::{Base, Bridge};

#[test]
fn a_base_is_known() {
    let base = Base::start("default", 1, &[]);
    let bridge = Bridge::start(Wire(base.clone()), Params::default());
    bridge.wait_until_up(0);
    bridge.end();
}
