//! The supervisor alone: wheels against the model of their motors.
//!
//! Numbers are powers of two where a comparison is to be hit to the bit: a tick is 2^-10 s, and at a steady speed the model is exact.

use vehicle_controller::supervisor::{
    Config, Cycle, Fault, Following, MotorModel, Place, Supervisor,
};
use vehicle_controller::vehicle::Wheel;

const DT: f32 = 1.0 / 1024.0;
/// A wheel is looked at in every fourth tick, so that whatever is found is found so late at most.
const LOOK: f32 = 4.0 * DT;
const SUPPLY: f32 = 16.0;

/// K_v/K_a is 16/s, the time constant 62.5 ms.
const MOTOR: MotorModel = MotorModel {
    static_friction: 0.5,
    speed_gain: 8.0,
    acceleration_gain: 0.5,
    resistance: 2.0,
    tolerance: 0.25,
    floor: 0.03125,
    rest_floor: 0.125,
};

const CONFIG: Config = Config {
    motor: MOTOR,
    max_wheel_speed: 2.0,
    max_current: f32::INFINITY,
    supply: [f32::NEG_INFINITY, f32::INFINITY],
    deadman: f32::INFINITY,
};

/// Suspicion that is a verdict, s.
const VERDICT: f32 = 0.04;

/// u = V_s sign v + K_v v.
fn voltage(speed: f32) -> f32 {
    if speed == 0.0 {
        0.0
    } else {
        MOTOR.static_friction.copysign(speed) + MOTOR.speed_gain * speed
    }
}

/// A wheel whose motor drives it at one speed, and whose encoder says another.
fn wheel(expected: f32, measured: f32) -> Wheel {
    Wheel {
        count: 0,
        speed: measured,
        duty: voltage(expected) / SUPPLY,
    }
}

/// How much the wheel exceeds what it may differ by, in thresholds.
fn excess(expected: f32, measured: f32) -> f32 {
    let faster = expected.abs().max(measured.abs());
    let threshold = (MOTOR.floor + MOTOR.tolerance * faster).max(MOTOR.rest_floor);
    (measured - expected).abs() / threshold - 1.0
}

#[derive(Clone, Debug)]
struct Bench {
    supervisor: Supervisor,
    config: Config,
    cycle: Cycle,
    /// What the encoders count in addition, from look to look.
    flicker: [i64; 2],
    ticks: u32,
}

impl Bench {
    /// Wheels that have been going at the speeds which their motors give them.
    fn at(speeds: [f32; 2]) -> Self {
        let wheels = speeds.map(|speed| wheel(speed, speed));
        let mut supervisor = Supervisor::default();
        supervisor.start(&wheels);
        Self {
            supervisor,
            config: CONFIG,
            cycle: Cycle {
                dt: DT,
                steps: 1,
                wheels,
                currents: [None; 2],
                supply: SUPPLY,
                motor_supply: SUPPLY,
                turns: false,
                estimate_is_finite: true,
            },
            flicker: [0; 2],
            ticks: 0,
        }
    }

    /// The encoders say this from now on.
    fn measure(&mut self, speeds: [f32; 2]) -> &mut Self {
        for (wheel, speed) in self.cycle.wheels.iter_mut().zip(speeds) {
            wheel.speed = speed;
        }
        self
    }

    fn tick(&mut self) -> Option<(Fault, Place)> {
        self.ticks += 1;
        for (wheel, flicker) in self.cycle.wheels.iter_mut().zip(self.flicker) {
            wheel.count = if (self.ticks / 4).is_multiple_of(2) {
                0
            } else {
                flicker
            };
        }
        self.supervisor
            .watch(&self.config, &self.cycle, || [Following::Closely; 2])
    }

    /// What is found within so many seconds, and when.
    fn run(&mut self, seconds: f32) -> Option<(f32, Fault, Place)> {
        (1..=(seconds / DT) as u32).find_map(|tick| {
            let (fault, place) = self.tick()?;
            Some((tick as f32 * DT, fault, place))
        })
    }

    /// It finds this after that time, and not a look later; nor earlier, but for the time since the last look.
    fn finds(&mut self, seconds: f32, fault: Fault, place: Place) {
        let before = if self.ticks > 0 { LOOK } else { 0.0 };
        let (at, found, its_place) = self
            .run(seconds + 1.0)
            .unwrap_or_else(|| panic!("{fault:?} is not found: {self:?}"));
        assert_eq!((found, its_place), (fault, place), "{self:?}");
        let late = at - seconds;
        // Sums of a thousand f32 are good for 1e-5.
        assert!(
            (-before - 1e-5..=LOOK + 1e-5).contains(&late),
            "{fault:?} after {at} s, not {seconds}: {self:?}"
        );
    }
}

/// Which of two wheels a place is about.
const PLACES: [(Place, [bool; 2]); 3] = [
    (Place::Left, [true, false]),
    (Place::Right, [false, true]),
    (Place::Both, [true, true]),
];

/// Wheels that are told to go at a speed; those at the place go at another from some instant.
fn slip(expected: f32, measured: f32, which: [bool; 2]) -> Bench {
    let mut bench = Bench::at([expected; 2]);
    bench.measure(which.map(|slips| if slips { measured } else { expected }));
    bench
}

#[test]
fn wheels_that_do_as_their_motors_are_never_suspected() {
    for speed in [0.0, 0.125, -0.125, 0.5, -0.5, 2.0] {
        for other in [0.0, 0.5, -1.0] {
            assert_eq!(Bench::at([speed, other]).run(10.0), None);
        }
    }
}

#[test]
fn a_difference_within_the_tolerance_is_none_and_one_beyond_it_adds_up() {
    for expected in [0.5_f32, 1.0, -0.5, -1.0] {
        let slower = expected.abs() - (MOTOR.floor + MOTOR.tolerance * expected.abs());
        // measured − expected = floor + tolerance · measured
        let faster = (expected.abs() + MOTOR.floor) / (1.0 - MOTOR.tolerance);
        for (speed, inside) in [(slower, 1.0), (faster, -1.0)] {
            for (place, which) in PLACES {
                let at = |nearer: f32| (speed + inside * nearer).copysign(expected);
                let mut fine = slip(expected, at(1e-5), which);
                assert_eq!(fine.run(60.0), None);
                let beyond = at(-0.02);
                let e = excess(expected, beyond);
                assert!(e > 0.01 && e < 0.5);
                slip(expected, beyond, which).finds(VERDICT / e, Fault::Mismatch, place);
            }
        }
    }
}

#[test]
fn at_rest_the_tolerance_is_what_holds_a_load() {
    for sign in [1.0, -1.0] {
        for (place, which) in PLACES {
            let held = |speed: f32| {
                let speed = speed * sign;
                let mut bench = Bench::at([0.0; 2]);
                let loaded = wheel(speed, 0.0);
                bench.cycle.wheels = which.map(|held| if held { loaded } else { wheel(0.0, 0.0) });
                bench
            };
            assert_eq!(held(0.125).run(60.0), None);
            // The model takes some time to get there: five time constants are e^-5, 0.7 % of the way, from there.
            let found = held(0.15).run(2.0);
            let (at, fault, its_place) = found.expect("more than it may hold");
            assert_eq!((fault, its_place), (Fault::NoMotion, place));
            let steady = VERDICT / excess(0.15, 0.0);
            assert!((steady..steady + 5.0 / 16.0).contains(&at), "{at} {steady}");
        }
    }
}

#[test]
fn how_wrong_a_wheel_is_makes_it_no_faster_than_80_ms_but_for_one_that_runs_away() {
    for sign in [1.0_f32, -1.0] {
        for (place, which) in PLACES {
            for (measured, rate, fault) in [
                // A quarter of what is expected is not yet standing.
                (0.125, 0.5, Fault::Mismatch),
                (0.125_f32.next_down(), 0.5, Fault::NoMotion),
                (0.0, 0.5, Fault::NoMotion),
                (-0.125_f32.next_down(), 0.5, Fault::NoMotion),
                (-0.125, 1.5, Fault::EncoderSign),
                (-0.5, 1.5, Fault::EncoderSign),
                (-1.5, 1.5, Fault::EncoderSign),
                (1.5, 0.5, Fault::Mismatch),
            ] {
                let mut bench = slip(0.5 * sign, measured * sign, which);
                bench.finds(VERDICT / rate, fault, place);
            }
        }
    }
}

#[test]
fn excess_up_to_the_cap_counts_as_it_is() {
    // Below 0.5 of a threshold, and between that and 1.5 for a wheel that runs away: it is slow, so its threshold is that at rest.
    let slow = 0.3;
    let e = excess(0.5, slow);
    assert!((0.2..0.5).contains(&e));
    slip(0.5, slow, [true, false]).finds(VERDICT / e, Fault::Mismatch, Place::Left);
    let (expected, backward) = (0.15, -0.1);
    let e = excess(expected, backward);
    assert!((0.6..1.4).contains(&e), "{e}");
    slip(expected, backward, [false, true]).finds(VERDICT / e, Fault::EncoderSign, Place::Right);
}

#[test]
fn what_fits_takes_the_suspicion_away_again() {
    // 0.5 for 64 ms is 32 ms of suspicion; a wheel that fits takes 1 for each second.
    let differs = [0.2, 0.5];
    let mut bench = Bench::at([0.5; 2]);
    assert_eq!(bench.measure(differs).run(0.064), None);
    assert_eq!(bench.measure([0.5; 2]).run(0.016), None);
    let left = 0.032 - 0.016;
    let (at, fault, place) = bench.measure(differs).run(1.0).expect("found");
    assert_eq!((fault, place), (Fault::Mismatch, Place::Left));
    let expected = (VERDICT - left) / 0.5;
    assert!((at - expected).abs() < 3.0 * LOOK, "{at} {expected}");
    // Wrong for a third of the time, it never adds up; and what is forgotten is not owed.
    let mut bench = Bench::at([0.5; 2]);
    for _ in 0..100 {
        assert_eq!(bench.measure(differs).run(0.06), None);
        assert_eq!(bench.measure([0.5; 2]).run(0.06), None);
    }
    assert_eq!(bench.run(10.0), None);
    bench
        .measure(differs)
        .finds(0.08, Fault::Mismatch, Place::Left);
}

#[test]
fn another_contradiction_begins_anew() {
    let mut bench = Bench::at([0.5; 2]);
    for _ in 0..20 {
        // 15 ms at 1.5, 60 ms at 0.5, 60 ms at 0.5: none lasts.
        for (measured, seconds) in [(-0.5, 0.015), (0.0, 0.06), (0.2, 0.06)] {
            bench.measure([measured, 0.5]);
            assert_eq!(bench.run(seconds), None, "{measured}");
        }
    }
}

#[test]
fn a_wheel_that_is_well_on_the_way_shares_the_others_fault() {
    let found = |ahead: f32, left: f32, right: f32| {
        let mut bench = Bench::at([0.5; 2]);
        assert_eq!(bench.measure([left, 0.5]).run(ahead), None);
        let (_, fault, place) = bench.measure([left, right]).run(1.0).expect("found");
        (fault, place)
    };
    // 80 ms are a verdict, and half of it is enough for the other one.
    assert_eq!(found(0.03, 0.0, 0.0), (Fault::NoMotion, Place::Both));
    assert_eq!(found(0.05, 0.0, 0.0), (Fault::NoMotion, Place::Left));
    // Two faults: the one that is suspected more.
    assert_eq!(found(0.03, 0.0, 0.2), (Fault::NoMotion, Place::Left));
    assert_eq!(found(0.05, 0.0, -0.5), (Fault::EncoderSign, Place::Right));
    // Alike in suspicion and not in kind: the left one, if it comes to that.
    for (left, right, fault) in [(0.0, 0.2, Fault::NoMotion), (0.2, 0.0, Fault::Mismatch)] {
        let mut bench = Bench::at([0.5; 2]);
        bench.measure([left, right]).cycle.dt = 0.1;
        assert_eq!(bench.tick(), Some((fault, Place::Left)));
        bench.cycle.dt = 0.0;
        bench.tick();
        assert_eq!(bench.tick(), Some((fault, Place::Left)));
    }
}

#[test]
fn a_count_that_flickers_is_a_lost_channel() {
    for speed in [0.5, -0.5] {
        for (place, which) in PLACES {
            for flicker in [1, -1] {
                let mut bench = slip(speed, 0.0, which);
                bench.flicker = which.map(|lost| if lost { flicker } else { 0 });
                bench.finds(0.08, Fault::EncoderChannel, place);
            }
        }
    }
}

#[test]
fn reversals_are_counted_in_a_row_up_to_the_verdict() {
    // The verdict comes at the 22nd look: what turns round at the last four of them flickers, at the last three not yet. Before, it goes on slowly.
    for (from, fault) in [(19, Fault::EncoderChannel), (20, Fault::NoMotion)] {
        let mut bench = slip(0.5, 0.0, [true, false]);
        let mut count = 0;
        let found = (1..100).find_map(|look| {
            let back = look >= from && (look - from) % 2 == 0;
            count += if back { -1 } else { 1 };
            bench.cycle.wheels[0].count = count;
            let found = (0..4).find_map(|_| {
                bench
                    .supervisor
                    .watch(&bench.config, &bench.cycle, || [Following::Closely; 2])
            });
            found.map(|found| (look, found))
        });
        assert_eq!(found, Some((22, (fault, Place::Left))));
    }
}

/// A wheel that stands, by its counts, while its motor takes this current.
fn standing(expected: f32, current: Option<f32>, which: [bool; 2]) -> Bench {
    let mut bench = slip(expected, 0.0, which);
    let sound = 0.5_f32.copysign(expected) / MOTOR.resistance;
    bench.cycle.currents = which.map(|stands| if stands { current } else { Some(sound) });
    bench
}

#[test]
fn the_current_tells_a_stall_from_an_encoder_and_from_a_motor_without_power() {
    for expected in [0.5_f32, -0.5] {
        let u = voltage(expected);
        let resistance = MOTOR.resistance;
        for (place, which) in PLACES {
            // All the voltage is across the winding: no back-EMF, the motor stands. A bump may be longer than 80 ms.
            standing(expected, Some(u / resistance), which).finds(0.5, Fault::Stall, place);
            // What friction takes: it turns, and its encoder does not see it.
            let turns = (u - MOTOR.speed_gain * expected) / resistance;
            standing(expected, Some(turns), which).finds(0.08, Fault::EncoderStuck, place);
            // At a bit more than half the speed it turns, at a bit less it does not.
            let at = |share: f32| (u - MOTOR.speed_gain * share * expected) / resistance;
            standing(expected, Some(at(0.51)), which).finds(0.08, Fault::EncoderStuck, place);
            standing(expected, Some(at(0.49)), which).finds(0.5, Fault::Stall, place);
            // Hardly any: no power, or a broken wire. 5 % of the stall current is the limit.
            for current in [0.0, 0.049 * u / resistance, -0.049 * u / resistance] {
                let mut bench = standing(expected, Some(current), which);
                bench.finds(0.08, Fault::NoMotion, place);
            }
            standing(expected, Some(0.051 * u / resistance), which).finds(
                0.08,
                Fault::EncoderStuck,
                place,
            );
            // Not measured, or nothing known of the winding.
            standing(expected, None, which).finds(0.08, Fault::NoMotion, place);
            let mut bench = standing(expected, Some(u / resistance), which);
            bench.config.motor.resistance = 0.0;
            bench.finds(0.08, Fault::NoMotion, place);
        }
    }
}

#[test]
fn a_current_that_says_for_long_enough_that_the_motor_turns_is_needed_for_an_encoder() {
    // The wheel is blocked for 60 ms of the 80, then its current says that it turns: 40 ms of that are the verdict.
    let u = voltage(0.5);
    let mut bench = standing(0.5, Some(u / 2.0), [true, false]);
    assert_eq!(bench.run(0.06), None);
    bench.cycle.currents[0] = Some(0.25);
    bench.finds(0.04, Fault::EncoderStuck, Place::Left);
    // Now and then is not enough: half of the time is taken off again.
    let mut bench = standing(0.5, Some(u / 2.0), [true, false]);
    let mut found = None;
    for _ in 0..9 {
        for current in [u / 2.0, 0.25] {
            bench.cycle.currents[0] = Some(current);
            found = found.or(bench.run(0.032));
        }
    }
    assert!(
        matches!(found, Some((_, Fault::Stall, Place::Left))),
        "{found:?}"
    );
}

#[test]
fn motors_against_each_other_are_told_from_a_turn_and_from_one_wheel() {
    let both = [true, true];
    let opposed = |left: f32| {
        let mut bench = Bench::at([left, -left]);
        bench.measure([0.0; 2]);
        bench
    };
    for left in [0.5, -0.5] {
        opposed(left).finds(0.08, Fault::WheelsFighting, Place::Both);
        // They are to turn the base: it is blocked.
        let mut turn = opposed(left);
        turn.cycle.turns = true;
        turn.finds(0.08, Fault::NoMotion, Place::Both);
        // One turns.
        let mut one = opposed(left);
        one.measure([0.0, -left]);
        one.finds(0.08, Fault::NoMotion, Place::Left);
        // One turns the wrong way, and is found first.
        let mut one = opposed(left);
        one.measure([0.0, left]);
        one.finds(VERDICT / 1.5, Fault::EncoderSign, Place::Right);
        // By current, both stand …
        let mut stall = opposed(left);
        let current = voltage(left) / MOTOR.resistance;
        stall.cycle.currents = [Some(current), Some(-current)];
        stall.finds(0.5, Fault::WheelsFighting, Place::Both);
        // … or both turn.
        let mut stuck = opposed(left);
        let current = 0.25_f32.copysign(left);
        stuck.cycle.currents = [Some(current), Some(-current)];
        stuck.finds(0.08, Fault::EncoderStuck, Place::Both);
    }
    // In the same direction they push together.
    slip(0.5, 0.0, both).finds(0.08, Fault::NoMotion, Place::Both);
}

#[test]
fn without_a_model_nothing_is_compared() {
    for measured in [0.0, -2.0, 2.0] {
        let mut bench = slip(0.5, measured, [true, true]);
        bench.config.motor.speed_gain = 0.0;
        assert_eq!(bench.run(10.0), None);
    }
}

#[test]
fn a_start_forgets_what_wheels_were_suspected_of() {
    let mut bench = Bench::at([0.5; 2]);
    bench.measure([0.2, -0.5]);
    for _ in 0..20 {
        assert_eq!(bench.run(0.02), None);
        bench.supervisor.start(&[wheel(0.5, 0.5); 2]);
    }
    // And it starts from the speed that a wheel has: one that rolls is not expected to stand.
    bench.supervisor.start(&[wheel(0.5, 0.5); 2]);
    assert_eq!(bench.measure([0.5; 2]).run(1.0), None);
}

/// What the motor's differential equation says of a speed, `t` seconds after a step of the voltage: K_a dv/dt = u − V_s sign v − K_v v.
fn step_response(from: f32, u: f32, t: f32) -> f32 {
    let tau = MOTOR.acceleration_gain / MOTOR.speed_gain;
    let end = (u - MOTOR
        .static_friction
        .copysign(if from == 0.0 { u } else { from }))
        / MOTOR.speed_gain;
    let speed = end + (from - end) * (-t / tau).exp();
    // Friction alone reverses nothing.
    if u == 0.0 && speed * from <= 0.0 {
        0.0
    } else {
        speed
    }
}

#[test]
fn wheels_that_follow_the_equation_are_sound_and_those_a_third_off_are_not() {
    for sign in [1.0, -1.0] {
        for (from, u) in [(0.0, 12.5), (0.0, 4.5), (0.5, 12.5), (1.5, 0.0), (0.5, 0.0)] {
            let (from, u) = (from * sign, u * sign);
            for (gain, sound) in [
                (1.0, true),
                (0.9, true),
                (1.1, true),
                (0.5, false),
                (1.8, false),
            ] {
                let mut bench = Bench::at([from; 2]);
                let mut found = None;
                for tick in 1..=400 {
                    let speed = gain * step_response(from, u, tick as f32 * DT);
                    bench.cycle.wheels = [Wheel {
                        count: 0,
                        speed,
                        duty: u / SUPPLY,
                    }; 2];
                    found = found.or(bench.tick());
                }
                // What has come to rest is sound again, and may have been so fast that nothing was made of it.
                if sound {
                    assert_eq!(found, None, "{from} {u} {gain}");
                } else if u != 0.0 {
                    assert_eq!(
                        found,
                        Some((Fault::Mismatch, Place::Both)),
                        "{from} {u} {gain}"
                    );
                }
            }
        }
    }
}

#[test]
fn a_blocked_wheel_is_found_100_ms_after_the_step_that_was_to_turn_it() {
    // v̂ reaches the rest floor of 1/8 after τ ln(4/3) = 18 ms and 3/2 of it after τ ln(8/5) = 29.4 ms; between them the suspicion grows with
    // v̂/floor − 1, 2.8 ms in all, from there with 1/2: 29.4 + (40 − 2.8)/0.5 = 103.8 ms. The model's steps of 4 ms are implicit, and 1.5 ms late.
    let mut bench = Bench::at([0.0; 2]);
    bench.cycle.wheels = [wheel(0.5, 0.0); 2];
    let (at, fault, place) = bench.run(1.0).expect("found");
    assert_eq!((fault, place), (Fault::NoMotion, Place::Both));
    assert!((0.102..0.112).contains(&at), "{at}");
}

#[test]
fn friction_holds_what_it_can_hold() {
    // Below V_s nothing turns: at 0.49 V a wheel that stands is right, and one that runs away is not.
    let mut bench = Bench::at([0.0; 2]);
    let held = Wheel {
        count: 0,
        speed: 0.0,
        duty: 0.49 / SUPPLY,
    };
    bench.cycle.wheels = [held; 2];
    assert_eq!(bench.run(10.0), None);
    for speed in [0.3, -0.3] {
        let mut bench = bench.clone();
        bench.measure([speed, 0.0]);
        // Against a model at rest, 0.3 is 1.4 thresholds beyond.
        bench.finds(0.08, Fault::Mismatch, Place::Left);
    }
}

#[test]
fn the_verdict_is_beyond_its_limit_not_at_it() {
    // One look of 80 ms at the cap is 40 ms of suspicion to the bit.
    let mut bench = slip(0.5, 0.2, [true, false]);
    bench.cycle.dt = 2.0 * VERDICT;
    assert_eq!(bench.tick(), None);
    bench.cycle.dt = 0.0;
    for _ in 0..100 {
        assert_eq!(bench.tick(), None);
    }
    bench.cycle.dt = DT;
    bench.finds(0.0, Fault::Mismatch, Place::Left);
}

/// Ticks of these lengths, s: the left wheel is looked at in the first and the fifth, the right one in the third; what is found in the last.
fn ticks(bench: &mut Bench, lengths: &[f32]) -> Option<(Fault, Place)> {
    let mut found = None;
    for dt in lengths {
        bench.cycle.dt = *dt;
        found = bench.tick();
    }
    found
}

#[test]
fn half_a_verdict_is_enough_to_share_the_fault() {
    // The right wheel has 20 ms to the bit, half a verdict; the left one gets on to 60 ms.
    let mut bench = slip(0.5, 0.2, [true, true]);
    let found = ticks(&mut bench, &[VERDICT, 0.0, 0.0, 0.0, 0.08]);
    assert_eq!(found, Some((Fault::Mismatch, Place::Both)));
    let mut bench = slip(0.5, 0.2, [true, true]);
    let found = ticks(&mut bench, &[VERDICT.next_down(), 0.0, 0.0, 0.0, 0.09]);
    assert_eq!(found, Some((Fault::Mismatch, Place::Left)));
}

#[test]
fn a_stall_is_one_beyond_half_a_second_not_at_it() {
    let stall = || standing(0.5, Some(voltage(0.5) / MOTOR.resistance), [true, false]);
    assert_eq!(ticks(&mut stall(), &[0.5]), None);
    assert_eq!(
        ticks(&mut stall(), &[0.5_f32.next_up()]),
        Some((Fault::Stall, Place::Left))
    );
}

#[test]
fn a_current_has_to_say_for_longer_than_40_ms_that_the_motor_turns() {
    // The wheel stands for 40.1 ms and, by its current, turns for the next ones: suspicion enough in both cases.
    for (length, found) in [
        (VERDICT, None),
        (VERDICT.next_up(), Some((Fault::EncoderStuck, Place::Left))),
    ] {
        let mut bench = standing(0.5, Some(voltage(0.5) / MOTOR.resistance), [true, false]);
        assert_eq!(ticks(&mut bench, &[0.0401, 0.0, 0.0, 0.0]), None);
        bench.cycle.currents[0] = Some(0.25);
        assert_eq!(ticks(&mut bench, &[length]), found);
    }
}

#[test]
fn limits_of_the_current_to_the_bit() {
    let u = voltage(0.5);
    // Half the speed is not more than half the speed.
    let half = (u - MOTOR.speed_gain * 0.25) / MOTOR.resistance;
    standing(0.5, Some(half), [true, false]).finds(0.5, Fault::Stall, Place::Left);
    // 5 % of the stall current is not less than that.
    let least = 0.05 * u / MOTOR.resistance;
    standing(0.5, Some(least), [true, false]).finds(0.08, Fault::EncoderStuck, Place::Left);
}

/// A wheel that is driven at 2 m/s, and then by this voltage only; its encoder is stuck at the same time.
fn coasting(u: f32) -> Bench {
    let mut bench = Bench::at([2.0, 2.0]);
    bench.cycle.wheels[0] = Wheel {
        count: 0,
        speed: 0.0,
        duty: u / SUPPLY,
    };
    bench.cycle.currents = [Some(0.0), Some(0.25)];
    bench
}

#[test]
fn no_current_at_little_voltage_is_no_lack_of_power() {
    // K_v times the rest floor is 1 V. Beyond it a motor that takes nothing has no power.
    coasting(1.0_f32.next_up()).finds(0.08, Fault::NoMotion, Place::Left);
    // Up to it that says that the motor turns at u/K_v, 1/8 m/s; and that is half of v̂ = 1/16 + 31/16 e^(−t/τ) from τ ln(31/3) = 146 ms on. The
    // implicit model is some 4 ms late.
    let (at, fault, place) = coasting(1.0).run(1.0).expect("found");
    assert_eq!((fault, place), (Fault::EncoderStuck, Place::Left));
    assert!((0.186..0.202).contains(&at), "{at}");
    // Without a resistance a current says nothing at all.
    let mut bench = coasting(0.0);
    bench.config.motor.resistance = 0.0;
    bench.finds(0.08, Fault::NoMotion, Place::Left);
}

#[test]
fn floors_are_shares_of_the_free_speed() {
    // 16 V over 8 V/(m/s) is 2 m/s: 4 % and 11 % of that.
    let model = MotorModel::new([0.5, 8.0, 0.25], 1.5, 0.3, 16.0);
    let expected = MotorModel {
        static_friction: 0.5,
        speed_gain: 8.0,
        acceleration_gain: 0.25,
        resistance: 1.5,
        tolerance: 0.3,
        floor: 0.08,
        rest_floor: 0.22,
    };
    assert_eq!(model, expected);
    let none = MotorModel::new([0.5, 0.0, 0.25], 1.5, 0.3, 16.0);
    assert_eq!((none.floor, none.rest_floor), (0.0, 0.0));
}
