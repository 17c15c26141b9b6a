//! From what the base does to motions with bounds: whatever way it drives, and however its odometry is wrong within them, it is inside.

mod common;
mod mapped;

use common::Random;
use mapped::{Pose, holds, within};
use std::f64::consts::FRAC_PI_2;
use vehicle_controller::map::{Bounds, Cylinder, Leg, Motion, Recorder, Step};

/// The paper's ±5° and ±(5 + 0.05 d) cm, and a drift.
const BOUNDS: Bounds = Bounds {
    turn: 0.087_266_46,
    turn_per_metre: 0.01,
    distance: 0.05,
    distance_share: 0.05,
};

/// A base whose odometry is wrong.
struct Base {
    recorder: Recorder<12>,
    /// As odometry has it, and the truth.
    measured: Pose,
    truth: Pose,
}

/// A turn in place, and a run of a constant curvature.
#[derive(Clone, Copy, Debug)]
struct Piece {
    turn: f64,
    run: f64,
    curvature: f64,
}

/// What is wrong of it: the turn, in all; the run's heading, per metre and of what it turns; its length, per metre.
#[derive(Clone, Copy, Debug, Default)]
struct Wrong {
    turn: f64,
    drift: f64,
    curve: f64,
    scale: f64,
}

impl Base {
    fn new() -> Self {
        Self {
            recorder: Recorder::new(),
            measured: Pose::default(),
            truth: Pose::default(),
        }
    }

    /// Moves on by an arc, and truly by another one.
    fn step(&mut self, [run, turn]: [f64; 2], [true_run, true_turn]: [f64; 2]) {
        self.recorder.take(
            &Step {
                travelled: run,
                turned: turn,
                path: run.abs(),
                swing: turn.abs(),
            },
            &BOUNDS,
        );
        let arc = |pose: Pose, run: f64, turn: f64| {
            let half = 0.5 * turn;
            let chord = run * if half == 0.0 { 1.0 } else { half.sin() / half };
            let turned = pose.after([half, chord]);
            turned.after([half, 0.0])
        };
        self.measured = arc(self.measured, run, turn);
        self.truth = arc(self.truth, true_run, true_turn);
    }

    fn drive(&mut self, leg: &Piece, wrong: &Wrong) {
        let steps = (leg.turn.abs() / 0.017).ceil().max(1.0);
        let turned = leg.turn / steps;
        for _ in 0..steps as u32 {
            let share = if leg.turn == 0.0 {
                0.0
            } else {
                wrong.turn / steps
            };
            self.step([0.0, turned], [0.0, turned + share]);
        }
        let steps = (leg.run.abs() / 0.005).ceil().max(1.0);
        let run = leg.run / steps;
        for _ in 0..steps as u32 {
            let turn = run * leg.curvature;
            let true_turn = turn * (1.0 + wrong.curve) + wrong.drift * run.abs();
            self.step([run, turn], [run * (1.0 + wrong.scale), true_turn]);
        }
    }

    fn check(&self) {
        let (bound, truth) = (self.recorder.bound(), self.truth);
        assert!(self.is_inside(), "{bound:?} {truth:?}");
    }

    /// The heading is off by more than one motion may be that has run so many metres.
    fn check_that_one_bound_is_not_enough(&self, run: f64) {
        let off = (self.truth.theta - self.measured.theta).abs();
        assert!(off > BOUNDS.turn + run * BOUNDS.turn_per_metre, "{off}");
    }

    fn is_inside(&self) -> bool {
        let leg = self.recorder.bound();
        holds(&leg.there, self.truth) && holds(&leg.back, self.truth.inverse())
    }
}

#[test]
fn a_turn_and_a_straight_run_are_one_motion_of_the_paper() {
    let mut base = Base::new();
    let bounds = Bounds {
        turn_per_metre: 0.0,
        ..BOUNDS
    };
    for step in 0..180 {
        let turned = FRAC_PI_2 / 90.0;
        let step = if step < 90 {
            Step {
                turned,
                swing: turned,
                ..Step::default()
            }
        } else {
            Step {
                travelled: 2.0 / 90.0,
                path: 2.0 / 90.0,
                ..Step::default()
            }
        };
        base.recorder.take(&step, &bounds);
    }
    let leg = base.recorder.bound();
    let is = leg.there;
    let motion = Motion {
        turn: FRAC_PI_2,
        turn_bound: BOUNDS.turn,
        nearest: 2.0 - 0.15,
        farthest: 2.0 + 0.15,
    };
    let paper = Cylinder::of_motion(&motion).unwrap();
    // Sums of 90 roundings.
    assert!((is.disc.radius - paper.disc.radius).abs() < 1e-9, "{is:?}");
    assert!((is.disc.x - paper.disc.x).abs() < 1e-9);
    assert!((is.disc.y - paper.disc.y).abs() < 1e-9);
    assert!((is.heading.half() - BOUNDS.turn).abs() < 1e-9);
    // Whoever looks back sees the start straight behind, whatever the turn was wrong by.
    let back = leg.back.disc;
    assert!(
        (back.x + 2.0).abs() < 1e-9 && back.y.abs() < 1e-9,
        "{leg:?}"
    );
    assert!((back.radius - 0.15).abs() < 1e-9, "{leg:?}");
}

#[test]
fn a_base_that_has_not_moved_is_where_it_was() {
    let recorder = Recorder::<12>::new();
    assert_eq!(recorder.bound(), Leg::HERE);
    assert!(recorder.is_empty());
}

#[test]
fn a_square_is_as_tight_as_the_theory_s() {
    let mut base = Base::new();
    let leg = Piece {
        turn: FRAC_PI_2,
        run: 1.0,
        curvature: 0.0,
    };
    for _ in 0..4 {
        base.drive(&leg, &Wrong::default());
    }
    let radius = base.recorder.bound().there.disc.radius;
    // ±5°, ±5 cm: 0.70 m from the right. The paper's 5 cm per metre doubles the length's part, and 0.01 rad/m adds a tenth of the heading's.
    assert!((0.70..1.15).contains(&radius), "{radius}");
    assert!(base.is_inside());
}

#[test]
fn curves_corners_and_backing_are_inside_however_wrong_odometry_is() {
    let mut random = Random(0x5EED_0081);
    let (mut excluding, mut legs) = (0, 0);
    for drive in 0..1500 {
        let mut base = Base::new();
        for _ in 0..=random.below(10) {
            let run = match random.below(4) {
                0 => -random.between(0.05, 1.5),
                _ => random.between(0.05, 4.0),
            };
            let straight = random.below(2) == 0;
            let curvature = if straight {
                0.0
            } else {
                // No more than a half turn in all.
                random.between(-3.0, 3.0) / run.abs().max(0.3)
            };
            let turn: f64 = random.between(-3.0, 3.0);
            let leg = Piece {
                // Without a turn in place, a motion that is its run turned back or goes on.
                turn: turn.signum() * turn.abs().max(0.05),
                run,
                curvature,
            };
            // What the curve is wrong by and what the turn is are one motion's.
            let in_turn = within(&mut random, -1.0, 1.0) * BOUNDS.turn;
            let swing = (curvature * run).abs();
            let in_curve = (BOUNDS.turn - in_turn.abs()) * within(&mut random, -1.0, 1.0);
            let allowed = BOUNDS.distance + BOUNDS.distance_share * run.abs();
            let wrong = Wrong {
                turn: in_turn,
                drift: within(&mut random, -1.0, 1.0) * BOUNDS.turn_per_metre,
                curve: if swing > 0.1 { in_curve / swing } else { 0.0 },
                scale: within(&mut random, -1.0, 1.0) * allowed / run.abs(),
            };
            base.drive(&leg, &wrong);
            legs += 1;
            assert!(
                base.is_inside(),
                "drive {drive}: {leg:?} {wrong:?}: {:?} {:?}",
                base.recorder.bound(),
                base.truth
            );
        }
        // It is a bound that says something: it does not hold all that the drive could reach.
        let radius = base.recorder.bound().there.disc.radius;
        let far = base.measured.x.hypot(base.measured.y);
        excluding += u32::from(radius < far);
    }
    println!("{legs} legs; {excluding} drives are known not to be back");
    assert!(excluding > 700);
}

#[test]
fn turns_on_the_spot_are_bounded_each_half_turn() {
    // 1.3 % of three turns is 14°, and 2.3° of each half: within 5° each. So are 3° in 120° of turning to and fro, which adds up as well.
    let to_and_fro: Vec<f64> = (0..40)
        .map(|n| if n % 2 == 0 { 0.5 } else { -0.5 })
        .collect();
    let round = vec![0.5; 38];
    for (turns, wrong) in [(round, [0.013, 0.013]), (to_and_fro, [0.025, -0.025])] {
        let mut base = Base::new();
        for turn in turns {
            let wrong = if turn > 0.0 { wrong[0] } else { wrong[1] };
            let piece = Piece {
                turn,
                run: 0.0,
                curvature: 0.0,
            };
            base.drive(
                &piece,
                &Wrong {
                    turn: turn * wrong,
                    ..Wrong::default()
                },
            );
            base.check();
        }
        let run = Piece {
            turn: 0.0,
            run: 3.0,
            curvature: 0.0,
        };
        base.drive(&run, &Wrong::default());
        base.check();
        base.check_that_one_bound_is_not_enough(3.0);
    }
}

#[test]
fn a_turn_and_a_curve_of_180_degrees_each_have_a_bound_each() {
    // 2.4 % of a half turn is 4.3°, of two 8.6°: more than one bound of 5° and 3.8 m of drift allow.
    let mut base = Base::new();
    let wrong = 0.024;
    for (run, curvature) in [(0.0, 0.0), (3.8, std::f64::consts::PI / 3.8)] {
        let piece = Piece {
            turn: if run == 0.0 {
                std::f64::consts::PI
            } else {
                0.0
            },
            run,
            curvature,
        };
        let wrong = Wrong {
            turn: piece.turn * wrong,
            curve: wrong,
            ..Wrong::default()
        };
        base.drive(&piece, &wrong);
        base.check();
    }
    base.check_that_one_bound_is_not_enough(3.8);
}

#[test]
fn the_widest_bounds_of_a_motion_hold_for_all_of_it() {
    let tight = Bounds {
        turn: 0.0,
        turn_per_metre: 0.0,
        distance: 0.0,
        distance_share: 0.0,
    };
    let step = Step {
        travelled: 0.005,
        path: 0.005,
        ..Step::default()
    };
    let mut radii = Vec::new();
    for wide_at in [0, 100, 199, 200] {
        let mut recorder = Recorder::<12>::new();
        for n in 0..200 {
            recorder.take(&step, if n == wide_at { &BOUNDS } else { &tight });
        }
        radii.push(recorder.bound().there.disc.radius);
    }
    // Wherever they were wide, they were for the whole metre; never is another matter.
    assert!(
        radii[0] > 0.1 && radii[0] == radii[1] && radii[1] == radii[2],
        "{radii:?}"
    );
    assert!(radii[3] < 1e-6, "{radii:?}");
}
