//! A vehicle with an offset: its steering angle's constant error is a fourth gain, and its random error is noise along the path (theory sections 5 and 6).
#![cfg(feature = "vehicles")]

mod counts;

use counts::Random;
use nalgebra::{Matrix3, Matrix4, SMatrix, SVector, Vector3};
use std::f64::consts::TAU;
use vehicle_controller::controller::correction::{Terms, Update, pose_innovation};
use vehicle_controller::controller::estimator::Estimator;
use vehicle_controller::controller::{Belief, Estimate, Noise, Pose};
use vehicle_controller::vehicle::gains::GAINS;
use vehicle_controller::vehicle::{Calibration, Influence, Spread, Twist};

/// Pose and gains.
const STATE: usize = 3 + GAINS;
type State = SVector<f64, STATE>;
type Covariance = SMatrix<f64, STATE, STATE>;

/// From the rear axle to the steered wheel, m.
const BASE: f32 = 1.2;

/// What the gains of a tricycle do: with d the front wheel's way, ΔS = k d cos(φ + δ) and Δα = k d sin(φ + δ)/(k_b L).
fn of_a_tricycle([wheel, _, base, _]: [f32; GAINS]) -> Influence {
    let length = base * BASE;
    Influence {
        by_gain: [
            [1.0 / wheel, 0.0, 0.0, 1.0 / wheel],
            [0.0; 4],
            [0.0, 0.0, 0.0, -1.0 / base],
            [0.0, -length, 1.0 / length, 0.0],
        ],
    }
}

fn steering_noise(kappa: f32) -> Noise {
    Noise {
        steering: [kappa],
        ..Noise::default()
    }
}

fn twist(translation: f64, rotation: f64) -> Twist {
    Twist {
        translation: translation as f32,
        rotation: rotation as f32,
    }
}

/// A tricycle at the origin, certain of that and of its gains, whose steering angle is noise.
fn steered(kappa: f32) -> Estimator {
    let mut estimator = Estimator::new(steering_noise(kappa));
    estimator.set_influence(of_a_tricycle(Calibration::NOMINAL));
    estimator
}

#[test]
fn steering_noise_is_white_along_the_path_whatever_the_window() {
    let (kappa, length, base) = (3e-4, 10.0, f64::from(BASE));
    for steps in [10, 25, 100, 500, 1000, 10_000, 40_000] {
        let mut estimator = steered(kappa);
        for _ in 0..steps {
            estimator.advance(twist(length / f64::from(steps), 0.0), Twist::ZERO);
        }
        let c = estimator.present().covariance;
        // ∫δφ dS has the variance κL; the heading is 1/L_base of it, and y the heading's integral.
        let heading = f64::from(kappa) * length / (base * base);
        // Increments are in f32, 1e-7 of the path each.
        assert!((c.m33 / heading - 1.0).abs() < 1e-5, "{steps}: {c}");
        let crossed = heading * length / 2.0;
        assert!((c.m23 / crossed - 1.0).abs() < 1e-5, "{steps}: {c}");
        // Within a window the heading is taken to change evenly: of n windows each loses a twelfth of its own, 1/(4n²) of all.
        let windows = f64::from(steps.min(1000));
        let aside = heading * length * length / 3.0 * (1.0 - 0.25 / (windows * windows));
        assert!((c.m22 / aside - 1.0).abs() < 1e-5, "{steps}: {c}");
        assert_eq!(c.m11, 0.0);
    }
}

#[test]
fn a_wheel_that_points_aside_is_as_noisy_as_one_that_points_ahead() {
    let kappa = 3e-4;
    // cos 90° in f32 is 4e-8, of either sign, and no count shows it.
    for ahead in [0.0, 4e-8, -4e-8] {
        let mut estimator = steered(kappa);
        let steps = 2000;
        let turned = TAU / f64::from(steps);
        let wheel = turned * f64::from(BASE);
        for _ in 0..steps {
            estimator.advance(twist(ahead * wheel, turned), Twist::ZERO);
        }
        let c = estimator.present().covariance;
        // Where the angle is wrong by δφ, the base goes ahead by δφ times what the wheel rolls.
        let wanted = f64::from(kappa) * TAU * f64::from(BASE);
        assert!(((c.m11 + c.m22) / wanted - 1.0).abs() < 1e-5, "{c}");
        // And a turn has no direction.
        assert!((c.m11 / c.m22 - 1.0).abs() < 1e-3, "{c}");
    }
}

#[test]
fn what_stands_or_turns_back_is_no_noisier_than_its_path() {
    let kappa = 3e-4;
    let mut random = Random(3);
    let mut estimator = steered(kappa);
    let mut path = 0.0;
    for _ in 0..10_000 {
        // To and fro, by more and by less than a window, and by next to nothing.
        let step = random.between(-1.0, 1.0) * 10.0_f64.powf(random.between(-12.0, -1.0));
        path += step.abs();
        estimator.advance(twist(step, 0.0), Twist::ZERO);
        let c = estimator.present().covariance;
        let most = f64::from(kappa) * path / f64::from(BASE * BASE);
        assert!((0.0..=most * (1.0 + 1e-5)).contains(&c.m33), "{step} {c}");
    }
}

/// The Kalman filter of pose and gains, with nothing left out.
struct Reference {
    state: State,
    p: Covariance,
}

impl Reference {
    /// P := A P Aᵀ + Q, with A = [F G; 0 I] (theory section 6).
    fn propagate(&mut self, increment: Twist, influence: &Influence, noise: &Noise) {
        let (s, a) = (increment.translation, increment.rotation);
        let (s, a) = (f64::from(s), f64::from(a));
        let middle = self.state[2] + 0.5 * a;
        let chord = if a == 0.0 {
            s
        } else {
            s * (0.5 * a).sin() / (0.5 * a)
        };
        let (dx, dy) = (chord * middle.cos(), chord * middle.sin());
        let by_s = Vector3::new(middle.cos(), middle.sin(), 0.0);
        let by_a = Vector3::new(-0.5 * dy, 0.5 * dx, 1.0);
        let mut along = Covariance::identity();
        along[(0, 2)] = -dy;
        along[(1, 2)] = dx;
        for (gain, by) in influence.by_gain.iter().enumerate() {
            let [ss, sa, as_, aa] = by.map(f64::from);
            let column = by_s * (ss * s + sa * a) + by_a * (as_ * s + aa * a);
            along.fixed_view_mut::<3, 1>(0, 3 + gain).copy_from(&column);
        }
        let steer = along.fixed_view::<3, 1>(0, STATE - 1).into_owned();
        self.p = along * self.p * along.transpose();
        let [q_s, drift, rotation, steering] = [
            noise.translation,
            noise.drift,
            noise.rotation,
            noise.steering[0],
        ]
        .map(f64::from);
        let random = by_s * by_s.transpose() * (q_s * s.abs())
            + by_a * by_a.transpose() * (drift * s.abs() + rotation * a.abs())
            + steer * steer.transpose() * (steering / s.abs());
        let mut pose = self.p.fixed_view_mut::<3, 3>(0, 0);
        pose += random;
        self.state += State::from_fn(|i, _| *[dx, dy, a].get(i).unwrap_or(&0.0));
    }

    fn fix(&mut self, z: &Vector3<f64>, r: &Matrix3<f64>, learns: bool) {
        let h = SMatrix::<f64, 3, STATE>::identity();
        let s = h * self.p * h.transpose() + r;
        let mut k = self.p * h.transpose() * s.try_inverse().unwrap();
        if !learns {
            k.fixed_view_mut::<GAINS, 3>(3, 0).fill(0.0);
        }
        let left = Covariance::identity() - k * h;
        self.state += k * (z - h * self.state);
        self.p = left * self.p * left.transpose() + k * r * k.transpose();
    }
}

/// The whole covariance, of an estimate that is kept in two stages.
fn whole(belief: &Belief, spread: &Spread) -> Covariance {
    let gains = spread.covariance();
    let common = belief.leverage * gains;
    let mut p = Covariance::zeros();
    p.fixed_view_mut::<3, 3>(0, 0)
        .copy_from(&belief.estimate(spread).covariance);
    p.fixed_view_mut::<3, GAINS>(0, 3).copy_from(&common);
    p.fixed_view_mut::<GAINS, 3>(3, 0)
        .copy_from(&common.transpose());
    p.fixed_view_mut::<GAINS, GAINS>(3, 3).copy_from(&gains);
    p
}

fn state(pose: &Pose, gains: [f32; GAINS]) -> State {
    let [right, left, base, offset] = gains.map(f64::from);
    State::from([pose.x, pose.y, pose.theta, right, left, base, offset])
}

fn pose_of(v: &Vector3<f64>) -> Pose {
    let [x, y, theta] = (*v).into();
    Pose { x, y, theta }
}

/// Takes a fix as the desk does.
fn fix(estimator: &mut Estimator, z: &Pose, r: &Matrix3<f64>, learns: bool, of: Influences) {
    let mut belief = estimator.belief();
    let mut calibration = *estimator.calibration();
    let mut update = Update::none(&belief, &calibration.spread);
    let terms = Terms { gate: 0.0, learns };
    let innovation = pose_innovation(z, &belief.pose);
    update.by_pose(&innovation, r, terms).unwrap();
    update.carry_to_later(&mut belief);
    if learns {
        let (change, spread) = update.gains();
        for (gain, change) in calibration.gains.iter_mut().zip(&change) {
            *gain = (f64::from(*gain) + change) as f32;
        }
        calibration.spread = spread;
    }
    let correction = estimator.correction(&belief, calibration);
    estimator.apply(&correction, of(calibration.gains));
}
type Influences = fn([f32; GAINS]) -> Influence;

/// An estimator at the origin, as sure of it as that, whose gains are as uncertain as this.
fn uncertain(noise: Noise, own: &Matrix3<f64>, spread: Spread, influence: Influence) -> Estimator {
    let estimate = Estimate {
        pose: Pose::default(),
        covariance: *own,
    };
    let calibration = Calibration {
        spread,
        ..Calibration::default()
    };
    Estimator::resume(
        &Belief::from(estimate),
        vehicle_controller::controller::estimator::Compound::default(),
        noise,
        calibration,
        influence,
    )
}

#[test]
fn it_is_the_kalman_filter_of_pose_and_four_gains() {
    let noise = Noise {
        translation: 1e-5,
        drift: 2.7e-5,
        rotation: 2e-4,
        steering: [1e-5],
    };
    let mut random = Random(17);
    for run in 0..20 {
        let mut draw = |scale: f64| random.between(-scale, scale);
        let root = Matrix4::from_fn(|_, _| draw(0.01));
        let spread = Spread::of(&(root * root.transpose()));
        let own = Matrix3::from_diagonal(&Vector3::new(1e-4, 1e-4, 1e-4));
        let mut estimator = uncertain(noise, &own, spread, Influence::default());
        let mut reference = Reference {
            state: state(&Pose::default(), Calibration::NOMINAL),
            p: whole(&estimator.belief(), &spread),
        };
        for step in 0..400 {
            // Each is a window of its own: then what is taken together is the same in both.
            let increment = twist(draw(0.02) + 0.03, draw(0.1));
            let mut influence = Influence {
                by_gain: [[(); 4]; GAINS].map(|by| by.map(|()| draw(1.0) as f32)),
            };
            // The steered wheel points ahead rather than aside: then the noise is white along ΔS.
            let [.., [ss, sa, _, _]] = &mut influence.by_gain;
            (*ss, *sa) = (0.5 * *ss, 0.05 * *sa);
            estimator.set_influence(influence);
            estimator.advance(increment, Twist::ZERO);
            reference.propagate(increment, &influence, &noise);
            if step % 20 == 19 {
                let off = Vector3::new(draw(0.02), draw(0.02), draw(0.02));
                let z = reference.state.fixed_rows::<3>(0) + off;
                let root = Matrix3::from_fn(|_, _| draw(0.02));
                let r = root * root.transpose() + Matrix3::from_diagonal_element(1e-6);
                let learns = draw(1.0) > 0.0;
                fix(&mut estimator, &pose_of(&z), &r, learns, |_| {
                    Influence::default()
                });
                reference.fix(&z, &r, learns);
            }
        }
        let calibration = estimator.calibration();
        let belief = estimator.belief();
        let deviations = reference.p.diagonal().map(f64::sqrt);
        let apart = state(&belief.pose, calibration.gains) - reference.state;
        let off = apart.component_div(&deviations).abs().max();
        // Of a standard deviation. The influences are f32, and so are the gains: a sixteen-millionth, of a deviation of some thousandths.
        assert!(off < 2e-4, "{run}: {off:.1e} {apart}");
        let apart = whole(&belief, &calibration.spread) - reference.p;
        let scale = deviations * deviations.transpose();
        let off = apart.component_div(&scale).abs().max();
        assert!(off < 2e-6, "{run}: {off:.1e}");
    }
}

/// A tricycle that is not what it is said to be, and its estimator.
struct Tricycle {
    truth: [f64; GAINS],
    pose: Vector3<f64>,
    estimator: Estimator,
}

/// ΔS and Δα for what the front wheel rolls, where it points.
fn moved([wheel, _, base, offset]: [f64; GAINS], rolled: f64, angle: f64) -> [f64; 2] {
    let (sin, cos) = (angle + offset).sin_cos();
    let length = base * f64::from(BASE);
    [wheel * rolled * cos, wheel * rolled * sin / length]
}

impl Tricycle {
    fn drive(&mut self, rolled: f64, angle: f64, disturbed: f64) {
        let [s, a] = moved(self.truth, rolled, angle + disturbed);
        let middle = self.pose.z + 0.5 * a;
        self.pose += Vector3::new(s * middle.cos(), s * middle.sin(), a);
        let gains = self.estimator.calibration().gains.map(f64::from);
        let [s, a] = moved(gains, rolled, angle);
        self.estimator.advance(twist(s, a), Twist::ZERO);
    }
}

#[test]
fn the_offset_is_learned_with_the_other_gains_and_is_as_wrong_as_it_says() {
    let (kappa, step) = (1e-6, 5e-3);
    let prior = Vector3::new(0.02, 0.02, 0.03);
    let r = Matrix3::from_diagonal(&Vector3::new(1e-4_f64, 1e-4, 7.6e-5));
    let runs = 100;
    let (mut nees, mut shrunk) = (0.0, Vector3::zeros());
    for run in 0..runs {
        let mut random = Random(1000 + run);
        let mut normal = || random.normal();
        let [wheel, base, offset] = [0, 1, 2].map(|i| prior[i] * normal());
        let spread = Spread {
            root: [0.02, 0.0, 0.0, 0.0, 0.0, 0.02, 0.0, 0.0, 0.0, 0.03],
        };
        let mut tricycle = Tricycle {
            truth: [1.0 + wheel, 1.0, 1.0 + base, offset],
            pose: Vector3::zeros(),
            estimator: uncertain(
                steering_noise(kappa),
                &Matrix3::zeros(),
                spread,
                of_a_tricycle(Calibration::NOMINAL),
            ),
        };
        for k in 0..12_000 {
            let t = 0.01 * f64::from(k);
            let disturbed = (f64::from(kappa) / step).sqrt() * normal();
            tricycle.drive(step, 0.1 + 0.5 * (0.3 * t).sin(), disturbed);
            if k % 100 == 99 {
                let noise = Vector3::from_fn(|i, _| r[(i, i)].sqrt() * normal());
                let z = pose_of(&(tricycle.pose + noise));
                fix(&mut tricycle.estimator, &z, &r, true, of_a_tricycle);
            }
        }
        let belief = tricycle.estimator.belief();
        let calibration = tricycle.estimator.calibration();
        // The left wheel, which it has not, is known: it stays what it is.
        assert_eq!(calibration.gains[1], 1.0);
        let known = |v: &State| SVector::<f64, 6>::from([v[0], v[1], v[2], v[3], v[5], v[6]]);
        let [wheel, left, base, offset] = tricycle.truth;
        let [x, y, theta] = tricycle.pose.into();
        let truth = State::from([x, y, theta, wheel, left, base, offset]);
        let apart = known(&(state(&belief.pose, calibration.gains) - truth));
        let p = whole(&belief, &calibration.spread)
            .remove_row(4)
            .remove_column(4);
        let p = p.try_inverse().unwrap();
        nees += apart.dot(&(p * apart)) / 6.0;
        let [wheel, _, base, offset] = calibration.spread.deviations().map(f64::from);
        shrunk += Vector3::new(wheel, base, offset).component_div(&prior);
    }
    let runs = runs as f64;
    // The mean of 600 squares of normal numbers: ± 0.058, of which this is three.
    assert!((nees / runs - 1.0).abs() < 0.18, "{}", nees / runs);
    assert!(shrunk.max() / runs < 0.1, "{}", shrunk / runs);
}

#[test]
fn a_measured_run_says_nothing_of_an_offset_however_the_wheel_points_now() {
    let mut estimator = Estimator::new(Noise::default());
    let mut influence = of_a_tricycle(Calibration::NOMINAL);
    // As of a car whose reference point goes along its steered axle.
    influence.by_gain[3][0] = -0.3;
    estimator.set_influence(influence);
    let run = estimator.straight(5.0);
    assert_eq!(run, ([5.0, 0.0, 0.0, 0.0], 0.0));
    let spread = Spread {
        root: [0.02, 0.0, 0.0, 0.0, 0.0, 0.02, 0.0, 0.0, 0.0, 0.03],
    };
    let mut update = Update::none(&estimator.belief(), &spread);
    update.by_run(run, 0.05, 0.0).unwrap();
    let (change, known) = update.gains();
    // 10 cm of the prior, 5 mm of the tape.
    let share = 0.1 * 0.1 / (0.1 * 0.1 + 5e-3 * 5e-3);
    assert!((change[0] - 0.01 * share).abs() < 1e-6, "{change}");
    assert_eq!((change[1], change[2], change[3]), (0.0, 0.0, 0.0));
    assert_eq!(known.deviations()[3], 0.03);
}
