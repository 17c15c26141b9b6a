//! A corner rounded by clothoid, arc, clothoid, held against the path's integral in f64.

use std::f64::consts::{FRAC_PI_2, PI};
use vehicle_controller::trajectory::corner::Room;
use vehicle_controller::trajectory::{Corner, KinematicLimits};

fn radians(degrees: f64) -> f64 {
    degrees * PI / 180.0
}

fn limits() -> KinematicLimits {
    KinematicLimits {
        speed: 1.0,
        acceleration: 0.5,
        turn_speed: 1.5,
        turn_acceleration: 2.0,
        max_curvature: f32::INFINITY,
        curvature_rate: f32::INFINITY,
        wheel_speed: 1.2,
        half_track: 0.15,
        slowest: 0.02,
        turns_in_place: true,
    }
}

fn whole(length: f32) -> [Room; 2] {
    [Room { length, at: None }; 2]
}

/// The heading of a turn by `angle` at a time, from the trapezoid itself.
struct Trapezoid {
    angle: f64,
    peak: f64,
    acceleration: f64,
}

impl Trapezoid {
    fn new(angle: f64, speed: f64, acceleration: f64) -> Self {
        Self {
            angle,
            peak: speed.min((angle * acceleration).sqrt()),
            acceleration,
        }
    }

    fn duration(&self) -> f64 {
        self.angle / self.peak + self.peak / self.acceleration
    }

    fn heading(&self, t: f64) -> f64 {
        let (ramp, end) = (self.peak / self.acceleration, self.duration());
        if t < ramp {
            0.5 * self.acceleration * t * t
        } else if t < end - ramp {
            self.peak * (t - 0.5 * ramp)
        } else {
            self.angle - 0.5 * self.acceleration * (end - t) * (end - t)
        }
    }

    /// Adaptive Simpson over the time from `a` to `b`, of the velocity's direction.
    fn reach(&self, a: f64, b: f64, tolerance: f64) -> [f64; 2] {
        let simpson = |a: f64, b: f64| {
            let (fa, fm, fb) = (
                self.heading(a),
                self.heading(0.5 * (a + b)),
                self.heading(b),
            );
            let part = |f: fn(f64) -> f64| (b - a) / 6.0 * (f(fa) + 4.0 * f(fm) + f(fb));
            [part(f64::cos), part(f64::sin)]
        };
        let middle = 0.5 * (a + b);
        let (once, left, right) = (simpson(a, b), simpson(a, middle), simpson(middle, b));
        let twice = [left[0] + right[0], left[1] + right[1]];
        let error = (twice[0] - once[0]).abs() + (twice[1] - once[1]).abs();
        if error < 15.0 * tolerance {
            twice
        } else {
            let left = self.reach(a, middle, 0.5 * tolerance);
            let right = self.reach(middle, b, 0.5 * tolerance);
            [left[0] + right[0], left[1] + right[1]]
        }
    }
}

#[test]
fn lead_is_that_of_the_integrated_path() {
    for angle in [0.5, 3.0, 10.0, 30.0, 60.0, 90.0, 120.0, 150.0, 170.0] {
        for (speed, turn_speed, acceleration) in
            [(0.3, 0.8, 1.5), (1.0, 1.5, 2.0), (0.05, 3.0, 0.7)]
        {
            let corner = Corner::at(radians(angle) as f32, speed, turn_speed, acceleration);
            let angle = f64::from(corner.angle);
            let turn = Trapezoid::new(angle, f64::from(turn_speed), f64::from(acceleration));
            let end = turn.duration();
            let v = f64::from(speed);
            let half = turn.reach(0.0, 0.5 * end, 1e-12);
            let rest = turn.reach(0.5 * end, end, 1e-12);
            let (x, y) = (v * (half[0] + rest[0]), v * (half[1] + rest[1]));
            // theory section 8
            let lead = x - y / angle.tan();
            let off = f64::from(corner.lead) / lead - 1.0;
            assert!(off.abs() < 1e-5, "{angle}: T {} {lead}", corner.lead);
            let off = f64::from(corner.length) / (v * end) - 1.0;
            assert!(off.abs() < 1e-6, "{angle}: length");
            // The corner is at (T, 0); of the whole path its middle is nearest to it. T sin δ/2 − y is a difference: some ulps of its parts are in the result.
            let miss = (v * half[0] - lead).hypot(v * half[1]);
            let scale = lead * (0.5 * angle).sin();
            let off = (f64::from(corner.miss) - miss).abs();
            assert!(off < 1e-5 * miss + 1e-6 * scale, "{angle}: miss {miss}");
            for k in 0..=200 {
                let t = end * f64::from(k) / 200.0;
                let [x, y] = turn.reach(0.0, t, 1e-9);
                assert!((v * x - lead).hypot(v * y) > miss - 1e-7 * (1.0 + lead));
            }
        }
    }
}

#[test]
fn half_a_path_is_the_lead_of_no_corner() {
    for angle in [1e-2_f32, 1e-4, 1e-6, 1e-12] {
        let corner = Corner::at(angle, 0.4, 1.0, 2.0);
        // cos(δ/2) and sinc are 1 − O(δ²): 2e-5 at δ = 0.01.
        assert!(
            (corner.lead / (0.5 * corner.length) - 1.0).abs() < 2e-5,
            "{corner:?}"
        );
        // δ = v_α²/a_α: two ramps.
        let two_ramps = 2.0 * 0.4 * (angle / 2.0).sqrt();
        assert!((corner.length / two_ramps - 1.0).abs() < 1e-6);
    }
    let none = Corner::at(0.0, 0.4, 1.0, 2.0);
    assert_eq!((none.lead, none.miss, none.length), (0.0, 0.0, 0.0));
}

#[test]
fn an_arc_is_left_when_ramps_are_short() {
    // a_α → ∞: T = R tan(δ/2), the miss is R (1/cos(δ/2) − 1). The ramps' share goes with v_α/a_α.
    let radius = 0.5_f64;
    let corner = Corner::at(FRAC_PI_2 as f32, 0.5, 1.0, 1e5);
    assert!((f64::from(corner.lead) - radius).abs() < 1e-5 * radius);
    let miss = radius * (2.0_f64.sqrt() - 1.0);
    assert!((f64::from(corner.miss) - miss).abs() < 1e-5);
}

#[test]
fn left_and_right_are_alike() {
    let left = Corner::at(1.0, 0.4, 1.0, 2.0);
    let right = Corner::at(-1.0, 0.4, 1.0, 2.0);
    assert_eq!(
        (left.lead, left.miss, left.length),
        (right.lead, right.miss, right.length)
    );
    assert_eq!(right.turn().distance, -1.0);
    // k = a_α/v_s², within an ulp or two.
    assert!((left.sharpness() - 2.0 / 0.16).abs() < 2e-6);
    assert_eq!(right.sharpness(), -left.sharpness());
}

#[test]
fn the_fastest_that_fits_is_found() {
    let limits = limits();
    for degrees in [2.0, 30.0, 90.0, 135.0, 170.0] {
        let angle = radians(degrees) as f32;
        for miss in [0.01, 0.1, 0.5] {
            for length in [0.2, 1.0, 5.0] {
                let fits = |speed: f32| {
                    let turn_speed = limits
                        .turn_speed
                        .min((limits.wheel_speed - speed) / limits.half_track);
                    let corner = Corner::at(angle, speed, turn_speed, limits.turn_acceleration);
                    corner.lead <= length && corner.miss <= miss
                };
                // By trying them all, in steps of a thousandth.
                let best = (20..=1000)
                    .map(|mm| f32::from(u16::try_from(mm).unwrap()) * 1e-3)
                    .filter(|speed| fits(*speed))
                    .fold(0.0, f32::max);
                let found = Corner::fit(angle, 1.0, whole(length), miss, &limits);
                let speed = found.map_or(0.0, |corner| corner.speed);
                assert!(
                    // The search ends at 1/128 of 1 m/s.
                    (speed - best).abs() < 8.9e-3,
                    "{degrees} {miss} {length}: {speed} {best}"
                );
                if let Some(corner) = found {
                    assert!(corner.lead <= length && corner.miss <= miss);
                    let wheel = corner.speed + limits.half_track * corner.turn_speed;
                    assert!(wheel <= limits.wheel_speed * (1.0 + 1e-6));
                }
            }
        }
    }
}

#[test]
fn a_car_keeps_to_its_tightest_arc_and_its_steering() {
    let car = KinematicLimits {
        max_curvature: 0.5,
        curvature_rate: 0.4,
        turns_in_place: false,
        ..limits()
    };
    let corner = Corner::fit(FRAC_PI_2 as f32, 1.0, whole(10.0), 2.0, &car).unwrap();
    assert!(corner.turn_speed <= 0.5 * corner.speed * (1.0 + 1e-6));
    // κ' = a_α/v_s
    assert!(corner.turn_acceleration <= 0.4 * corner.speed * (1.0 + 1e-6));
    // The arc of 2 m alone takes 2 m of both legs, and misses the corner by 0.83 m.
    assert!(corner.lead > 2.0 && corner.miss > 0.828);
    assert_eq!(
        Corner::fit(FRAC_PI_2 as f32, 1.0, whole(1.9), 2.0, &car),
        None
    );
    assert_eq!(
        Corner::fit(FRAC_PI_2 as f32, 1.0, whole(10.0), 0.8, &car),
        None
    );
}

#[test]
fn a_stop_leaves_room_to_speed_up() {
    let limits = limits();
    let from_rest = |length| {
        [
            Room {
                length,
                at: Some(0.0),
            },
            Room {
                length: 10.0,
                at: None,
            },
        ]
    };
    let corner = Corner::fit(1.0, 1.0, from_rest(1.0), 1.0, &limits).unwrap();
    let run = 1.0 - corner.lead;
    // v²/(2a) ≤ 1 m − T, with a tenth of a to spare; and no more of it is left than the search's step of speed: a hundredth of 1 m/s, and what T changes by.
    let reached = (2.0 * 0.9 * limits.acceleration * run).sqrt();
    assert!(corner.speed <= reached * (1.0 + 1e-6) && corner.speed > reached - 1.5e-2);
}

#[test]
fn what_is_no_corner_is_refused() {
    let limits = limits();
    let fit = |angle: f32, speed: f32, length: f32, miss: f32| {
        Corner::fit(angle, speed, whole(length), miss, &limits)
    };
    assert_eq!(fit(f32::NAN, 0.5, 1.0, 0.1), None);
    assert_eq!(fit(f32::INFINITY, 0.5, 1.0, 0.1), None);
    assert_eq!(fit(1.0, f32::NAN, f32::NAN, 0.1), None);
    assert_eq!(fit(1.0, -0.5, 1.0, 0.1), None);
    assert_eq!(fit(1.0, 0.0, 1.0, 0.1), None);
    assert_eq!(fit(1.0, 0.5, 0.0, 0.1), None);
    assert_eq!(fit(1.0, 0.5, 1.0, f32::NAN), None);
    // Back the way it came: no legs are long enough.
    assert_eq!(fit(core::f32::consts::PI, 0.5, 1e3, 1e3), None);
    // Straight on is no corner for any legs.
    let straight = fit(0.0, 1.0, 0.1, 0.0).unwrap();
    assert_eq!((straight.speed, straight.length), (1.0, 0.0));
}
