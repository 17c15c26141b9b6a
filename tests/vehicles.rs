//! The promise: what a vehicle is told to do and what it says that it did are inverse to each other, whatever its geometry; and a car that is not steered is
//! a differential drive.

mod steered;
mod wheeled;

use proptest::prelude::*;
use steered::bits;
use vehicle_controller::params::Id;
use vehicle_controller::vehicle::{Kind, Twist, VirtualVehicle};
use wheeled::{car, differential, driven, params, synchro, tricycle};

/// A cycle, s.
const DT: f32 = 0.01;

/// Counts of a micrometre or less are rounded twice in a cycle, and the rest is f32: products of some five numbers. Relative to the wheels' motion.
fn assert_close(told: Twist, did: Twist, length: f32) {
    let told = [told.translation * DT, told.rotation * DT];
    let did = [did.translation, did.rotation];
    let size = told[0].hypot(told[1] * length);
    let error = (did[0] - told[0]).hypot((did[1] - told[1]) * length);
    assert!(error < 3e-6 + 2e-6 * size, "{told:?} and {did:?}");
}

/// Speeds of a car's front wheels from those of the rear ones and φ: of a rigid body about the common centre, in f64.
fn front_wheels(base: f64, track: f64, opposite: bool) -> impl Fn([f64; 2], f64) -> [f64; 2] {
    move |rear, phi| {
        let phi_r = if opposite { -phi } else { 0.0 };
        let [moved, turned] = steered::exact(rear, track, phi_r);
        // v cos φ is the same along the car, and what is across grows by the turn.
        let (ahead, aside) = (moved * phi_r.cos(), moved * phi_r.sin() + turned * base);
        let front = ahead.hypot(aside).copysign(moved);
        steered::contacts(front, turned, track, phi)
    }
}

proptest! {
    #[test]
    fn a_differential_drive_does_what_it_is_told(v in -1.0..1.0f32, w in -3.0..3.0f32) {
        let params = params(Kind::Differential, &[(Id::GainRight, 1.03), (Id::GainBase, 0.96)]);
        let (mut vehicle, wires) = differential(&params);
        // The wheels are as large as the controller says: its gains are in what it tells them.
        let twist = Twist { translation: v, rotation: w };
        for (wheel, gain) in wires.wheels.iter().zip([1.0, 1.03]) {
            wheel.set_resolution(wheeled::per_metre(&params, Id::LeftDiameter) / gain);
        }
        assert_close(twist, driven(&mut vehicle, &wires, twist, DT, |_, _| [0.0; 2]), 0.1);
    }

    #[test]
    fn a_synchro_drive_does_what_it_is_told(v in -1.0..1.0f32, w in -3.0..3.0f32, drift in -5.0..5.0f32) {
        let params = params(
            Kind::Synchro,
            &[(Id::TurnDrift, drift), (Id::GainDrive, 0.97), (Id::GainTurn, 1.02), (Id::TurnCounts, 1e7)],
        );
        let (mut vehicle, wires) = synchro(&params);
        let twist = Twist { translation: v, rotation: w };
        assert_close(twist, driven(&mut vehicle, &wires, twist, DT, |_, _| [0.0; 2]), 0.1);
    }

    #[test]
    fn a_tricycle_does_what_it_is_told(
        v in -1.0..1.0f32, w in -3.0..3.0f32, offset in -5.0..5.0f32, in_place: bool
    ) {
        let params = params(
            Kind::Tricycle,
            &[
                (Id::SteerMax, 90.0), (Id::SteerRate, 3600.0), (Id::SteerOffset, offset),
                (Id::GainBase, 1.03), (Id::WheelBase, 0.3),
            ],
        );
        let (mut vehicle, wires) = tricycle(&params);
        let twist = Twist { translation: if in_place { 0.0 } else { v }, rotation: w };
        prop_assume!(twist.translation.hypot(0.3 * w) > 0.02);
        // Less translation than a fiftieth of the rotation is a turn in place.
        prop_assume!(in_place || v.abs() > 0.02 * 0.31 * w.abs());
        assert_close(twist, driven(&mut vehicle, &wires, twist, DT, |_, _| [0.0; 2]), 0.3);
    }

    #[test]
    fn a_car_does_what_it_is_told(
        v in 0.1..2.0f32, back: bool, curvature in -0.6..0.6f32, opposite: bool, odometry in 0..3u8
    ) {
        let params = params(
            Kind::BiSteerable,
            &[
                (Id::WheelBase, 1.2), (Id::Track, 1.2), (Id::LeftDiameter, 0.4), (Id::RightDiameter, 0.4),
                (Id::SteerMax, 50.0), (Id::SteerRate, 3600.0), (Id::RearSteered, opposite.into()),
                (Id::Odometry, odometry.into()), (Id::CountsPerTurn, 1e7),
            ],
        );
        let (mut vehicle, wires) = car(&params);
        let v = if back { -v } else { v };
        let twist = Twist { translation: v, rotation: curvature * v };
        let front = front_wheels(1.2, 1.2, opposite);
        assert_close(twist, driven(&mut vehicle, &wires, twist, DT, front), 1.2);
    }

    /// Show 1: α = 0 is the differential drive, bit for bit: any counts, in any cycles, with any gains.
    #[test]
    fn a_car_that_is_not_steered_is_a_differential_drive(
        counts in prop::collection::vec((-400..400i64, -400..400i64, 0..3u8), 1..200),
        gains in prop::array::uniform3(0.9..1.1f32),
        opposite: bool,
        phi in -0.5..0.5f32,
    ) {
        let [right, left, base] = gains;
        let shared = [
            (Id::CountsPerTurn, 2796.8), (Id::LeftDiameter, 0.0841), (Id::RightDiameter, 0.0837),
            (Id::GainRight, right), (Id::GainLeft, left), (Id::GainBase, base),
        ];
        let of_car = [(Id::Track, 0.2), (Id::WheelBase, 0.3), (Id::RearSteered, opposite.into())];
        let (mut car, car_wires) = car(&params(Kind::BiSteerable, &[&shared[..], &of_car].concat()));
        let (mut drive, drive_wires) = differential(&params(Kind::Differential, &shared));
        // An ordinary car's rear axle is never steered, wherever the front wheels point.
        car_wires.pointer.is.set(if opposite { 0.0 } else { phi });
        let mut total = [0; 2];
        for (left, right, cycle) in counts {
            total = [total[0] + left, total[1] + right];
            let dt = [1e-3, 2e-3, 0.1][usize::from(cycle)];
            for wires in [&car_wires, &drive_wires] {
                for (wheel, count) in wires.wheels.iter().zip(total) {
                    wheel.0.count.set(count);
                }
            }
            let (a, b) = (car.sense(dt), drive.sense(dt));
            prop_assert_eq!(bits(a.increment), bits(b.increment));
            prop_assert_eq!(bits(a.speed), bits(b.speed));
            prop_assert_eq!(bits(a.acceleration), bits(b.acceleration));
            prop_assert_eq!(bits(car.resolution()), bits(drive.resolution()));
        }
    }
}

/// What the gains do is what a small change of them does.
fn assert_influence<V: VirtualVehicle>(
    vehicle: &mut V,
    sense: impl Fn(&mut V) -> Twist,
    gains: [f32; 4],
    step: f32,
    tolerance: f32,
) {
    vehicle.set_gains(gains);
    let motion = sense(vehicle);
    let effects = vehicle.influence().of(motion);
    for (place, effect) in effects.into_iter().enumerate() {
        let at = |vehicle: &mut V, step: f32| {
            let mut changed = gains;
            changed[place] += step;
            vehicle.set_gains(changed);
            sense(vehicle)
        };
        let (more, less) = (at(vehicle, step), at(vehicle, -step));
        let slope = [
            (more.translation - less.translation) / (2.0 * step),
            (more.rotation - less.rotation) / (2.0 * step),
        ];
        let size = motion.translation.abs().max(motion.rotation.abs());
        let error = (effect.translation - slope[0])
            .abs()
            .max((effect.rotation - slope[1]).abs());
        assert!(
            error < tolerance * size,
            "gain {place}: {effect:?}, differences {slope:?}, of {motion:?}"
        );
    }
}

/// One cycle in which the wheels roll by so much.
fn rolled<V: VirtualVehicle>(
    wires: &wheeled::Wires,
    wheels: [f64; 2],
    front: [f64; 2],
) -> impl Fn(&mut V) -> Twist {
    let wires = wires.clone();
    move |vehicle| {
        for (wheel, metres) in wires.wheels.iter().zip(wheels) {
            wheel.roll(metres);
        }
        for (wheel, metres) in wires.front.iter().zip(front) {
            wheel.roll(metres);
        }
        vehicle.sense(DT).increment
    }
}

/// Differences of f32 over a step of 1e-3 have some 1e-4; those of the second order in the step are smaller.
#[test]
fn influences_are_derivatives() {
    let of_synchro = params(Kind::Synchro, &[(Id::TurnCounts, 1e7)]);
    let (mut vehicle, wires) = synchro(&of_synchro);
    let sense = rolled(&wires, [0.5, -0.02], [0.0; 2]);
    assert_influence(&mut vehicle, sense, [1.02, 1.0, 0.97, 0.03], 1e-3, 1e-3);

    let of_tricycle = params(Kind::Tricycle, &[(Id::SteerMax, 90.0)]);
    let (mut vehicle, wires) = tricycle(&of_tricycle);
    wires.pointer.is.set(0.6);
    let sense = rolled(&wires, [0.5, 0.0], [0.0; 2]);
    assert_influence(&mut vehicle, sense, [1.02, 1.0, 0.97, 0.03], 1e-3, 1e-3);
}

/// Where its wheels agree with its steering, as they do on the floor.
#[test]
fn influences_of_a_car_are_derivatives() {
    for (odometry, opposite) in [(0, true), (1, true), (2, true), (1, false), (2, false)] {
        let values = [
            (Id::WheelBase, 1.2),
            (Id::Track, 1.2),
            (Id::LeftDiameter, 0.4),
            (Id::RightDiameter, 0.4),
            (Id::CountsPerTurn, 1e7),
            (Id::Odometry, odometry as f32),
            (Id::RearSteered, f32::from(u8::from(opposite))),
        ];
        let (mut vehicle, wires) = car(&params(Kind::BiSteerable, &values));
        let phi = 0.3_f64;
        wires.pointer.is.set(phi as f32);
        let base = 1.2;
        let phi_r = if opposite { -phi } else { 0.0 };
        let curvature = (phi - phi_r).sin() / (base * phi.cos());
        let rear = steered::contacts(0.5, 0.5 * curvature, 1.2, phi_r);
        let front = front_wheels(base, 1.2, opposite)(rear, phi);
        let sense = rolled(&wires, rear, front);
        assert_influence(&mut vehicle, sense, [1.0, 1.0, 1.0, 0.0], 1e-3, 2e-3);
    }
}
