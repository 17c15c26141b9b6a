//! The reference of an axis: it lands exactly, in the shortest time, and never changes its speed by more than a T in a cycle.

use proptest::prelude::*;
use vehicle_controller::controller::profile::Profile;
use vehicle_controller::controller::{Axis, AxisCommand, AxisConfig, Cycle, State};

const T: f32 = 1e-3;

const CONFIG: AxisConfig = AxisConfig {
    gain: 8.0,
    max_error: 0.01,
    tolerance: 1e-3,
    rest_speed: 5e-3,
};

/// a T, and what f32 cannot show of it: half an ulp of each speed, and the thousandth of a T that the landing may add.
fn allowed_change(acceleration: f32, speed: f32) -> f32 {
    acceleration * T * 1.001 + 1.2e-7 * speed.abs()
}

/// An axis whose vehicle follows exactly, with the displacement of its reference since the last command.
struct Ideal {
    axis: Axis,
    last: f64,
    travelled: f64,
}

impl Ideal {
    fn new() -> Self {
        Self {
            axis: Axis::default(),
            last: 0.0,
            travelled: 0.0,
        }
    }

    fn command(&mut self, distance: f32, speed: f32, acceleration: f32) {
        let command = AxisCommand {
            distance,
            speed,
            acceleration,
        };
        self.axis.command(&CONFIG, command);
        self.travelled = 0.0;
    }

    /// One cycle; the change of the reference speed.
    fn cycle(&mut self) -> f32 {
        let before = self.axis.reference_speed();
        self.axis.measure(self.last as f32, 1);
        let cycle = Cycle {
            period: T,
            steps: 1,
            speed: before,
            share: 1.0,
        };
        self.axis.advance(&CONFIG, &cycle);
        // v_ref of the cycle under way, times T: what an ideal vehicle will have moved.
        self.last = f64::from(self.axis.velocity(&CONFIG, T)) * f64::from(T);
        self.travelled += self.last;
        self.axis.reference_speed() - before
    }
}

/// Rows of `vectors/trapezoids.csv`: v0, d, v, a, duration.
fn vectors() -> Vec<[f32; 5]> {
    include_str!("vectors/trapezoids.csv")
        .lines()
        .filter(|line| !line.starts_with('#') && !line.starts_with("v0"))
        .map(|line| {
            let mut row = [0.0; 5];
            for (value, word) in row.iter_mut().zip(line.split(',')) {
                *value = word.parse().unwrap();
            }
            row
        })
        .collect()
}

#[test]
fn durations_are_those_of_continuous_time_within_a_cycle() {
    let rows = vectors();
    assert_eq!(rows.len(), 23);
    for [v0, d, v, a, duration] in rows {
        let mut ideal = Ideal::new();
        if v0 != 0.0 {
            // So steep that the speed is there at once.
            ideal.command(v0.signum() * f32::INFINITY, v0.abs(), 1e4);
            ideal.cycle();
            assert_eq!(ideal.axis.reference_speed(), v0);
        }
        // The command comes when the cycle before is over.
        ideal.axis.measure(ideal.last as f32, 1);
        ideal.last = 0.0;
        ideal.command(d, v, a);
        let mut cycles = 0_u32;
        loop {
            let allowed = allowed_change(a, ideal.axis.reference_speed());
            let change = ideal.cycle();
            assert!(change.abs() <= allowed, "{v0} -> {d}: {change} > {allowed}");
            if ideal.axis.state() == State::Hold {
                break;
            }
            cycles += 1;
            assert!(cycles < 30_000, "{v0} -> {d}: no landing");
        }
        // The cycle that lands counts.
        let seconds = (cycles + 1) as f32 * T;
        assert!(
            (seconds - duration).abs() <= T * 1.001,
            "{v0} -> {d}: {seconds} s instead of {duration} s"
        );
        // 30 000 cycles' velocities are each rounded to f32 here: 30 000 × 1.75 mm × 6e-8.
        assert!(
            (ideal.travelled - f64::from(d)).abs() < 3e-6,
            "{v0} -> {d}: {}",
            ideal.travelled
        );
    }
}

#[test]
fn the_reference_lands_on_d_to_the_last_digit() {
    for [_, d, v, a, _] in vectors() {
        let mut profile = Profile::at_rest();
        profile.go(d, v, a);
        let mut travelled = 0.0;
        while !profile.has_landed() {
            travelled += f64::from(profile.step(T, 1.0).displacement);
        }
        // The remainder is kept in 48 bits; the sum in f64 here is not better.
        assert!((travelled - f64::from(d)).abs() < 1e-10, "{d}: {travelled}");
    }
}

#[test]
fn stop_takes_v_over_a() {
    let mut ideal = Ideal::new();
    ideal.command(f32::INFINITY, 0.6, 1e4);
    ideal.cycle();
    ideal.command(0.0, 0.0, 0.5);
    let mut cycles = 0;
    while ideal.axis.reference_speed() != 0.0 {
        let change = ideal.cycle();
        assert!(change.abs() <= allowed_change(0.5, 0.6));
        cycles += 1;
    }
    assert!((1199..=1201).contains(&cycles), "{cycles}");
}

proptest! {
    #[test]
    fn a_command_every_ten_cycles_breaks_neither(
        commands in proptest::collection::vec((-0.05..0.05f32, 0.0..1.5f32, 0.1..4.0f32), 1..60),
    ) {
        let mut ideal = Ideal::new();
        for (d, v, a) in &commands {
            // The command comes when the cycle before is over.
            ideal.axis.measure(ideal.last as f32, 1);
            ideal.last = 0.0;
            ideal.command(*d, *v, *a);
            for _ in 0..10 {
                let allowed = allowed_change(*a, ideal.axis.reference_speed());
                let change = ideal.cycle();
                prop_assert!(change.abs() <= allowed, "{change} > {allowed} for {d} {v} {a}");
            }
        }
        let (d, v, _) = commands[commands.len() - 1];
        for _ in 0..60_000 {
            ideal.cycle();
            if ideal.axis.state() == State::Hold {
                break;
            }
        }
        prop_assert_eq!(ideal.axis.state(), State::Hold);
        if v > 0.0 {
            // As above: the rounding of this test's own velocities.
            prop_assert!((ideal.travelled - f64::from(d)).abs() < 3e-6, "{} for {d}", ideal.travelled);
        }
    }
}
