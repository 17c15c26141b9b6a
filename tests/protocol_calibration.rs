//! Calibrate and GetGains, as lines. What is learned shows on a base with wheels: see hil-sim's `calibration`.

mod common;

use common::Rig;

#[test]
fn the_gains_and_their_deviations_are_told() {
    let mut rig = Rig::new();
    // √(K_scale + (w √K_drift/2)²) twice, and √K_rot.
    assert_eq!(
        rig.ask("GetGains"),
        "Gains 1.000000 1.000000 1.000000 0.007080 0.007080 0.014142"
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

#[test]
fn gains_that_were_learned_of_another_geometry_are_doubted() {
    let mut rig = Rig::new();
    let learned = [
        "gain_right 1.002",
        "gain_base 1.01",
        "spread_rr 0.0005",
        "spread_ll 0.0005",
        "spread_bb 0.001",
    ];
    for setting in learned {
        rig.ok(&format!("SetParam {setting}"));
    }
    let known = "Gains 1.002000 1.000000 1.010000 0.000500 0.000500 0.001000";
    assert_eq!(rig.ask("GetGains"), known);
    // The same once more is no other geometry, and the gate is none at all.
    rig.ok("SetParam wheel_base 0.2");
    rig.ok("SetParam gate 16");
    assert_eq!(rig.ask("GetGains"), known);
    rig.ok("SetParam left_diameter 0.083");
    assert_eq!(
        rig.ask("GetGains"),
        "Gains 1.002000 1.000000 1.010000 0.007080 0.007080 0.014142"
    );
    assert_eq!(rig.ask("GetParam spread_bb"), "Param spread_bb 0 -");
}

#[test]
fn a_prior_that_nothing_was_learned_of_goes_along_with_its_parameters() {
    let mut rig = Rig::new();
    rig.ok("SetParam gate 9");
    rig.ok("SetParam k_rot 0");
    assert_eq!(
        rig.ask("GetGains"),
        "Gains 1.000000 1.000000 1.000000 0.007080 0.007080 0.000000"
    );
}
