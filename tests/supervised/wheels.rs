//! Wheels before a supervisor: motors that are given voltages, and encoders that say what they like.
//!
//! Numbers are powers of two where a comparison is to be hit to the bit: a tick is 2^-10 s, and at a steady speed the model is exact.
#![allow(dead_code, reason = "each test file uses a part of it")]

use vehicle_controller::supervisor::{
    Config, Cycle, Fault, Following, MotorModel, Place, Supervisor,
};
use vehicle_controller::vehicle::Wheel;

pub(crate) const DT: f32 = 1.0 / 1024.0;
/// A wheel is looked at in every fourth tick, so that whatever is found is found so late at most.
pub(crate) const LOOK: f32 = 4.0 * DT;
pub(crate) const SUPPLY: f32 = 16.0;

/// K_v/K_a is 16/s, the time constant 62.5 ms.
pub(crate) const MOTOR: MotorModel = MotorModel {
    static_friction: 0.5,
    speed_gain: 8.0,
    acceleration_gain: 0.5,
    resistance: 2.0,
    tolerance: 0.25,
    floor: 0.03125,
    rest_floor: 0.125,
};

pub(crate) const CONFIG: Config = Config {
    motor: MOTOR,
    max_wheel_speed: 2.0,
    max_current: f32::INFINITY,
    supply: [f32::NEG_INFINITY, f32::INFINITY],
    deadman: f32::INFINITY,
};

/// Suspicion that is a verdict, s.
pub(crate) const VERDICT: f32 = 0.04;

/// u = V_s sign v + K_v v.
pub(crate) fn voltage(speed: f32) -> f32 {
    if speed == 0.0 {
        0.0
    } else {
        MOTOR.static_friction.copysign(speed) + MOTOR.speed_gain * speed
    }
}

/// A wheel whose motor drives it at one speed, and whose encoder says another.
pub(crate) fn wheel(expected: f32, measured: f32) -> Wheel {
    Wheel {
        count: 0,
        speed: measured,
        duty: voltage(expected) / SUPPLY,
    }
}

/// How much the wheel exceeds what it may differ by, in thresholds.
pub(crate) fn excess(expected: f32, measured: f32) -> f32 {
    let faster = expected.abs().max(measured.abs());
    let threshold = (MOTOR.floor + MOTOR.tolerance * faster).max(MOTOR.rest_floor);
    (measured - expected).abs() / threshold - 1.0
}

#[derive(Clone, Debug)]
pub(crate) struct Bench {
    pub(crate) supervisor: Supervisor,
    pub(crate) config: Config,
    pub(crate) cycle: Cycle,
    /// What the encoders count in addition, from look to look.
    pub(crate) flicker: [i64; 2],
    pub(crate) ticks: u32,
}

impl Bench {
    /// Wheels that have been going at the speeds which their motors give them.
    pub(crate) fn at(speeds: [f32; 2]) -> Self {
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
    pub(crate) fn measure(&mut self, speeds: [f32; 2]) -> &mut Self {
        for (wheel, speed) in self.cycle.wheels.iter_mut().zip(speeds) {
            wheel.speed = speed;
        }
        self
    }

    pub(crate) fn tick(&mut self) -> Option<(Fault, Place)> {
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
    pub(crate) fn run(&mut self, seconds: f32) -> Option<(f32, Fault, Place)> {
        (1..=(seconds / DT) as u32).find_map(|tick| {
            let (fault, place) = self.tick()?;
            Some((tick as f32 * DT, fault, place))
        })
    }

    /// It finds this after that time, and not a look later; nor earlier, but for the time since the last look.
    pub(crate) fn finds(&mut self, seconds: f32, fault: Fault, place: Place) {
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
pub(crate) const PLACES: [(Place, [bool; 2]); 3] = [
    (Place::Left, [true, false]),
    (Place::Right, [false, true]),
    (Place::Both, [true, true]),
];

/// Wheels that are told to go at a speed; those at the place go at another from some instant.
pub(crate) fn slip(expected: f32, measured: f32, which: [bool; 2]) -> Bench {
    let mut bench = Bench::at([expected; 2]);
    bench.measure(which.map(|slips| if slips { measured } else { expected }));
    bench
}

/// A wheel that stands, by its counts, while its motor takes this current.
pub(crate) fn standing(expected: f32, current: Option<f32>, which: [bool; 2]) -> Bench {
    let mut bench = slip(expected, 0.0, which);
    let sound = 0.5_f32.copysign(expected) / MOTOR.resistance;
    bench.cycle.currents = which.map(|stands| if stands { current } else { Some(sound) });
    bench
}

/// Ticks of these lengths, s: the left wheel is looked at in the first and the fifth, the right one in the third; what is found in the last.
pub(crate) fn ticks(bench: &mut Bench, lengths: &[f32]) -> Option<(Fault, Place)> {
    let mut found = None;
    for dt in lengths {
        bench.cycle.dt = *dt;
        found = bench.tick();
    }
    found
}
