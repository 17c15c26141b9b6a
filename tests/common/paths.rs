//! What tests of paths and chases have in common.

use super::Rig;

/// A path of three postures, under way.
pub(crate) fn under_way(rig: &mut Rig) {
    for line in ["Follow 1 0", "Follow 1 1", "Follow 0 1 180", "Follow start"] {
        rig.ok(line);
    }
    rig.run(1.0);
    assert_eq!(rig.ask("GetPath"), "Path 3 path");
    rig.unsolicited();
}

/// All that is said until the base rests.
pub(crate) fn until_rest(rig: &mut Rig) -> Vec<String> {
    let mut lines = rig.unsolicited();
    for _ in 0..60 {
        rig.run(1.0);
        lines.extend(rig.unsolicited());
        if !rig.snapshot().is_moving() && rig.ask("GetPath").ends_with(" idle") {
            lines.extend(rig.unsolicited());
            lines.retain(|line| !line.starts_with("~ "));
            return lines;
        }
    }
    panic!("it never rests: {lines:?}");
}

/// Sends a line; all that is said in the ticks after it.
pub(crate) fn said(rig: &mut Rig, line: &str) -> Vec<String> {
    rig.receive(format!("{line}\n").as_bytes());
    rig.pump();
    // An order of the path's own may be on its way, and an event takes a tick or two.
    rig.run(0.01);
    rig.lines()
}

/// It stands there.
pub(crate) fn assert_at(rig: &mut Rig, x: f64, y: f64, theta: f64) {
    let pose = rig.data("GetEstPos", "EstPos");
    // The default tolerances of arrival.
    let off = (pose[0] - x).hypot(pose[1] - y);
    let turn = (pose[2] - theta) / 360.0;
    assert!(off <= 0.003, "{pose:?}");
    assert!((turn - turn.round()).abs() * 360.0 <= 0.4, "{pose:?}");
}
