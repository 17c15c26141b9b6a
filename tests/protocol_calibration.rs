//! Calibrate and GetGains, as lines. What is learned shows on a base with wheels: see hil-sim's `calibration`.

mod common;

use common::Rig;

#[test]
fn the_gains_and_their_deviations_are_told() {
    let mut rig = Rig::new();
    // √(K_scale + (w √K_drift/2)²) twice, and √K_rot.
    assert_eq!(
        rig.ask("GetGains"),
        "Gains 1.000000 1.000000 1.000000 0.005012 0.005012 0.014142"
    );
    rig.ok("SetParam k_drift 0");
    rig.ok("SetParam k_scale 0");
    rig.ok("SetParam gain_base 1.01");
    assert_eq!(
        rig.ask("GetGains"),
        "Gains 1.000000 1.000000 1.010000 0.000000 0.000000 0.014142"
    );
}

#[test]
fn what_calibrate_does_not_understand_is_refused() {
    let mut rig = Rig::new();
    for line in [
        "Calibrate",
        "Calibrate maybe",
        "Calibrate on off",
        "Calibrate straight",
        "Calibrate straight x",
        "Calibrate straight inf",
        "GetGains 1",
    ] {
        rig.refused(line, "syntax");
    }
    for line in [
        "Calibrate straight 0",
        "Calibrate straight -1",
        "Calibrate straight 1001",
    ] {
        rig.refused(line, "range");
    }
    // It has not moved yet.
    rig.refused("Calibrate straight 2", "range");
}

#[test]
fn what_changes_the_geometry_is_refused_while_it_moves() {
    let mut rig = Rig::new();
    rig.ok("m 1");
    rig.run(0.5);
    rig.refused("Calibrate straight 1", "moving");
    rig.refused("Calibrate reset", "moving");
    rig.ok("Calibrate on");
    rig.ok("Calibrate off");
}

#[test]
fn a_correction_considers_the_gains_and_leaves_them() {
    let mut rig = Rig::new();
    let before = rig.ask("GetGains");
    rig.ok("m 1 0.5");
    rig.run(5.0);
    rig.ask("ObservePos 1.01 0.01 0.5 1e-4 0 0 1e-4 0 0.1");
    rig.run(0.1);
    assert_eq!(rig.ask("GetGains"), before);
}
