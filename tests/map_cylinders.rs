//! Uncertainty cylinders: nothing that is possible lies outside.

mod common;
mod mapped;

use common::Random;
use mapped::{Pose, admits, any_motion, covers, holds, off, sample, share};
use std::f64::consts::{FRAC_PI_2, PI};
use vehicle_controller::map::{Cylinder, Disc, FARTHEST, Heading, Improper, Leg, Motion};

/// The vectors' tolerance, m and rad. They are written with nine digits.
const TOLERANCE: f64 = 1e-6;

struct Row {
    motions: Vec<Motion>,
    left: f64,
    right: f64,
    centre: [f64; 2],
    heading: [f64; 2],
}

/// Rows of `vectors/cylinders.csv`: motions, radii by both groupings, centre of the right one, η, α.
fn vectors() -> Vec<Row> {
    include_str!("vectors/cylinders.csv")
        .lines()
        .filter(|line| !line.starts_with('#') && !line.starts_with("motions"))
        .map(|line| {
            let (motions, numbers) = line.split_once(',').unwrap();
            let motions = motions.split('|').map(|motion| {
                let numbers: Vec<f64> = motion.split(' ').map(|w| w.parse().unwrap()).collect();
                let [nearest, farthest, turn, turn_bound] = numbers[..] else {
                    panic!("{motion}");
                };
                Motion {
                    turn,
                    turn_bound,
                    nearest,
                    farthest,
                }
            });
            let numbers: Vec<f64> = numbers.split(',').map(|w| w.parse().unwrap()).collect();
            let [left, right, x, y, eta, alpha] = numbers[..] else {
                panic!("{line}");
            };
            Row {
                motions: motions.collect(),
                left,
                right,
                centre: [x, y],
                heading: [eta, alpha],
            }
        })
        .collect()
}

fn bounds(motions: &[Motion]) -> Vec<Cylinder> {
    let bound = |motion| Cylinder::of_motion(motion).unwrap();
    motions.iter().map(bound).collect()
}

#[test]
fn chains_are_those_of_the_vectors() {
    let rows = vectors();
    assert_eq!(rows.len(), 26);
    let mut worst = 0.0_f64;
    for row in rows {
        let chain = bounds(&row.motions);
        let (left, right) = (Cylinder::from_left(&chain), Cylinder::from_right(&chain));
        for (is, wanted) in [(left, row.left), (right, row.right)] {
            let [eta, alpha] = row.heading;
            for error in [
                is.disc.radius - wanted,
                off(is.heading.centre() - eta),
                is.heading.half() - alpha,
            ] {
                worst = worst.max(error.abs());
                assert!(error.abs() < TOLERANCE, "{is:?}: {wanted} {eta} {alpha}");
            }
        }
        let [x, y] = row.centre;
        let away = (right.disc.x - x).hypot(right.disc.y - y);
        worst = worst.max(away);
        assert!(away < TOLERANCE, "{right:?}: {x} {y}");
        let either = Cylinder::of_chain(&chain).disc.radius;
        assert_eq!(either, left.disc.radius.min(right.disc.radius));
    }
    println!("off by {worst:.1e} at most");
}

#[test]
fn closed_forms() {
    // Straight ahead and certain of the direction: half of what the length is uncertain by.
    let run = Motion {
        turn: 0.0,
        turn_bound: 0.0,
        nearest: 1.9,
        farthest: 2.1,
    };
    let bound = Cylinder::of_motion(&run).unwrap();
    assert!((bound.disc.distance() - 2.0).abs() < 1e-9);
    assert!((bound.disc.radius - 0.1).abs() < 1e-9);
    // A quarter turn and 1 m, and the start as seen from the end: 1 m behind, that is at 180° of the heading.
    let exact = Motion {
        turn: FRAC_PI_2,
        turn_bound: 0.0,
        nearest: 1.0,
        farthest: 1.0,
    };
    let bound = Cylinder::of_motion(&exact).unwrap();
    assert!((bound.disc.bearing() - FRAC_PI_2).abs() < 1e-9);
    let start = bound.inverse();
    assert!((start.disc.x + 1.0).abs() < 1e-9 && start.disc.y.abs() < 1e-9);
    assert_eq!(start.heading.centre(), -FRAC_PI_2);
    // There and back is here.
    let back = bound.then(&start);
    assert!(back.disc.radius < 1e-9 && holds(&back, Pose::default()));
    // The same backwards.
    let backwards = Motion {
        nearest: -2.1,
        farthest: -1.9,
        ..run
    };
    let bound = Cylinder::of_motion(&backwards).unwrap();
    assert!((bound.disc.x + 2.0).abs() < 1e-9);
    assert_eq!(bound.heading, Heading::AHEAD);
    // Either way: 5 cm about the start, whatever the direction.
    let hardly = Motion {
        turn: 1.0,
        turn_bound: 2.0,
        nearest: -0.05,
        farthest: 0.05,
    };
    let bound = Cylinder::of_motion(&hardly).unwrap();
    assert!(bound.disc.distance() == 0.0 && (bound.disc.radius - 0.05).abs() < 1e-9);
    assert_eq!(Cylinder::of_chain(&[]), Cylinder::HERE);
}

#[test]
fn directions_beyond_a_quarter_and_a_half_turn() {
    let motion = |turn_bound| Motion {
        turn: 0.3,
        turn_bound,
        nearest: 1.0,
        farthest: 2.0,
    };
    let run = Cylinder::of_motion(&motion(0.0)).unwrap();
    for alpha in [FRAC_PI_2, 2.0, 3.0] {
        let bound = Cylinder::of_motion(&motion(alpha)).unwrap();
        assert_eq!(bound.disc, Disc::about(2.0));
        assert_eq!(bound.heading.half(), alpha);
        // r₁₂ = r₁ + r₂ + d₂ about c₁.
        let both = bound.then(&run);
        assert_eq!(both.disc.distance(), 0.0);
        assert!((both.disc.radius - 4.0).abs() < 1e-9, "{both:?}");
        let inverse = bound.inverse();
        assert_eq!(inverse.disc.distance(), 0.0);
        assert!((inverse.disc.radius - 2.0).abs() < 1e-9);
        // Two such directions are none.
        assert!(bound.then(&bound).heading.is_any());
    }
    for alpha in [PI, 4.0, 100.0] {
        assert!(
            Cylinder::of_motion(&motion(alpha))
                .unwrap()
                .heading
                .is_any()
        );
    }
    // Between 60° and 90° the disc about the start is the smaller one.
    let bound = Cylinder::of_motion(&motion(1.2)).unwrap();
    assert_eq!(bound.disc, Disc::about(2.0));
}

#[test]
fn what_bounds_no_motion_is_refused() {
    let good = Motion {
        turn: 0.1,
        turn_bound: 0.1,
        nearest: 1.0,
        farthest: 2.0,
    };
    assert!(Cylinder::of_motion(&good).is_ok());
    for bad in [f64::NAN, f64::INFINITY, -f64::INFINITY, 3.0 * FARTHEST] {
        let farthest = Motion {
            farthest: bad,
            ..good
        };
        let nearest = Motion {
            nearest: bad,
            ..good
        };
        for motion in [farthest, nearest] {
            assert_eq!(Cylinder::of_motion(&motion), Err(Improper), "{motion:?}");
        }
    }
    for bad in [f64::NAN, f64::INFINITY] {
        let turn = Motion { turn: bad, ..good };
        let turn_bound = Motion {
            turn_bound: bad,
            ..good
        };
        for motion in [turn, turn_bound] {
            assert_eq!(Cylinder::of_motion(&motion), Err(Improper), "{motion:?}");
        }
    }
}

#[test]
fn a_motion_reaches_the_edge_of_its_bound() {
    // The corners of the sector lie on the circle as long as it is the bound, here for α < 45° and runs of known length: no smaller disc holds them.
    let mut random = Random(0x5EED_0009);
    for _ in 0..1000 {
        let length = random.between(0.1, 10.0);
        let motion = Motion {
            turn: random.between(-3.0, 3.0),
            turn_bound: random.between(0.01, 0.78),
            nearest: 0.8 * length,
            farthest: length,
        };
        let bound = Cylinder::of_motion(&motion).unwrap();
        let [turn, half] = [motion.turn, motion.turn_bound];
        for direction in [turn - half, turn + half] {
            for run in [motion.nearest, motion.farthest] {
                let pose = Pose::default().after([direction, run]);
                let share = share(&bound.disc, pose.x, pose.y);
                // 2⁻⁴⁰ of 10 radii, or of 70 as a 0.01 rad sector is wide.
                let smaller = bound.disc.radius < 0.999 * length;
                assert!(
                    share <= 1.0 && (!smaller || share > 1.0 - 1e-9),
                    "{motion:?}"
                );
            }
        }
    }
}

#[test]
fn a_square_is_tighter_from_the_right() {
    // Theory section 9: 1 m, ±5°, ±5 cm.
    let side = Motion {
        turn: FRAC_PI_2,
        turn_bound: 5_f64.to_radians(),
        nearest: 0.95,
        farthest: 1.05,
    };
    let chain = bounds(&[side; 4]);
    let radius = |bound: Cylinder| bound.disc.radius;
    assert!((radius(Cylinder::from_left(&chain)) - 0.92).abs() < 0.005);
    assert!((radius(Cylinder::from_right(&chain)) - 0.70).abs() < 0.005);
}

#[test]
fn what_discs_have_in_common() {
    let unit = Disc::about(1.0);
    let at = |x, radius| Disc { x, y: 0.0, radius };
    // The chord of two unit circles a radius apart.
    let lens = unit.common(&at(1.0, 1.0)).unwrap();
    assert!((lens.x - 0.5).abs() < 1e-9 && lens.y == 0.0);
    assert!((lens.radius - 0.75_f64.sqrt()).abs() < 1e-9);
    // One within the other; half of the other, and more than half.
    assert_eq!(unit.common(&at(0.3, 0.5)), Some(at(0.3, 0.5)));
    assert_eq!(unit.common(&at(0.9, 0.2)), Some(at(0.9, 0.2)));
    assert_eq!(unit.common(&unit), Some(unit));
    // They touch: a point, but for a root of the rounding.
    let point = unit.common(&at(1.5, 0.5)).unwrap();
    assert!(
        (point.x - 1.0).abs() < 1e-3 && point.radius < 3e-3,
        "{point:?}"
    );
    assert_eq!(unit.common(&at(1.6, 0.5)), None);
    assert!(!unit.meets(&at(1.6, 0.5)));
    // Without size, and where squares are below an f64's range.
    assert_eq!(at(2.0, 0.0).common(&at(2.0, 0.0)), Some(at(2.0, 0.0)));
    let tiny = at(1e-25, 1e-24).common(&Disc::about(1e-24)).unwrap();
    assert!(covers(&tiny, 5e-26, 0.0));
}

#[test]
fn what_headings_have_in_common() {
    let degrees = |centre: f64, half: f64| Heading::new(centre.to_radians(), half.to_radians());
    let near = |is: Option<Heading>, centre: f64, half: f64| {
        let is = is.unwrap();
        let turned = off(is.centre() - centre.to_radians());
        // 2⁻³⁹ of widening, and roundings.
        assert!(turned.abs() < 1e-9, "{is:?}");
        assert!((is.half() - half.to_radians()).abs() < 1e-9, "{is:?}");
    };
    near(degrees(0.0, 20.0).common(&degrees(30.0, 20.0)), 15.0, 5.0);
    // Across ±180°.
    near(
        degrees(170.0, 15.0).common(&degrees(-170.0, 15.0)),
        180.0,
        5.0,
    );
    near(
        degrees(530.0, 15.0).common(&degrees(-170.0, 15.0)),
        180.0,
        5.0,
    );
    // One within the other.
    near(degrees(10.0, 90.0).common(&degrees(30.0, 5.0)), 30.0, 5.0);
    near(Heading::ANY.common(&degrees(30.0, 5.0)), 30.0, 5.0);
    near(degrees(30.0, 5.0).common(&Heading::ANY), 30.0, 5.0);
    // Around the back too: of both parts, the interval about them is the narrower one.
    near(
        degrees(0.0, 100.0).common(&degrees(180.0, 120.0)),
        0.0,
        100.0,
    );
    // They touch, and they do not.
    near(degrees(0.0, 20.0).common(&degrees(40.0, 20.0)), 20.0, 0.0);
    assert_eq!(degrees(0.0, 20.0).common(&degrees(41.0, 20.0)), None);
    assert!(!degrees(0.0, 20.0).meets(&degrees(41.0, 20.0)));
    assert!(Heading::new(0.0, PI).is_any() && Heading::new(f64::NAN, 0.1).is_any());
    assert!(Heading::new(0.0, f64::NAN).is_any() && Heading::new(1e9, 0.1).is_any());
}

#[test]
fn no_sample_is_outside_any_bound() {
    let mut random = Random(0x5EED_0008);
    let (mut cut, mut outside, mut nothing) = (0_u32, 0_u32, 0_u32);
    for _ in 0..10_000 {
        let motions: Vec<_> = (0..=random.below(5))
            .map(|_| any_motion(&mut random))
            .collect();
        let chain = bounds(&motions);
        let (left, right) = (Cylinder::from_left(&chain), Cylinder::from_right(&chain));
        let both = left.common(&right).expect("both hold what is true");
        assert!(both.disc.radius <= left.disc.radius.min(right.disc.radius));
        let inverse = left.inverse();
        let legs = motions.iter().map(|motion| Leg::of_motion(motion).unwrap());
        let leg = legs.reduce(|all, next| all.then(&next)).unwrap();
        // Something else that is known, and cuts off a part.
        let size = left.disc.radius * random.between(0.05, 1.5);
        let away = left.disc.radius * random.between(0.0, 1.5);
        let (sin, cos) = random.between(-3.2, 3.2).sin_cos();
        let other = Cylinder {
            disc: Disc {
                x: (left.disc.x + away * cos),
                y: (left.disc.y + away * sin),
                radius: size,
            },
            heading: Heading::new(
                left.heading.centre() + random.between(-3.2, 3.2),
                random.between(0.0, 3.3),
            ),
        };
        let discs = left.disc.common(&other.disc);
        let headings = left.heading.common(&other.heading);
        if discs.is_some_and(|disc| disc.radius < left.disc.radius.min(other.disc.radius)) {
            cut += 1;
        }
        for _ in 0..1000 {
            let pose = motions.iter().fold(Pose::default(), |pose, motion| {
                pose.after(sample(&mut random, motion))
            });
            assert!(holds(&left, pose), "{motions:?} {left:?} {pose:?}");
            assert!(holds(&right, pose), "{motions:?} {right:?} {pose:?}");
            assert!(holds(&both, pose), "{motions:?} {both:?} {pose:?}");
            let start = pose.inverse();
            assert!(holds(&inverse, start), "{motions:?} {inverse:?} {start:?}");
            assert!(holds(&leg.back, start), "{motions:?} {leg:?} {start:?}");
            if covers(&other.disc, pose.x, pose.y) {
                let held = discs.is_some_and(|disc| covers(&disc, pose.x, pose.y));
                assert!(held, "{left:?} {other:?} {discs:?} {pose:?}");
            } else {
                outside += 1;
            }
            if admits(other.heading, pose.theta) {
                let held = headings.is_some_and(|heading| admits(heading, pose.theta));
                assert!(held, "{left:?} {other:?} {headings:?} {pose:?}");
            } else {
                nothing += 1;
            }
        }
    }
    // Each of these was put to the test.
    println!("{cut} discs cut, {outside} samples outside, {nothing} headings outside");
    assert!(cut > 1000 && outside > 1_000_000 && nothing > 1_000_000);
}
