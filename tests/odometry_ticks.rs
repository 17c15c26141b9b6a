//! Ticks that come late, twice or not at all, and a clock that errs: no count is lost and no reference steps.

mod counts;

use counts::{COUNT, Random, geometry, quantised, vehicle};
use vehicle_controller::controller::{
    Action, AxisCommand, Config, Controller, Event, Inputs, Snapshot,
};
use vehicle_controller::params::Params;
use vehicle_controller::time::{Duration, Instant};
use vehicle_controller::vehicle::{
    Motion, OutputError, Twist, VirtualVehicle, Wheel, differential,
};

const PERIOD: Duration = Duration::millis(1);

/// A tick: the true time, µs, and what the clock says.
#[derive(Clone, Copy)]
struct Tick {
    at: u64,
    clock: u64,
}

impl Tick {
    fn on_time(at: u64) -> Self {
        Self { at, clock: at }
    }
}

type Disturbance = fn(u64, &mut Random) -> Vec<Tick>;

/// The ticks that replace the one that is due at `k` ms.
const DISTURBANCES: [(&str, Disturbance); 6] = [
    ("dropped", |k, random| {
        if random.between(0.0, 1.0) < 0.2 {
            vec![]
        } else {
            vec![Tick::on_time(k * 1000)]
        }
    }),
    ("a gap of 15 ms each 200 ms", |k, _| {
        if k % 200 < 15 {
            vec![]
        } else {
            vec![Tick::on_time(k * 1000)]
        }
    }),
    ("jitter of 40 %", |k, random| {
        let late = random.between(-400.0, 400.0) as i64;
        vec![Tick::on_time((k * 1000).saturating_add_signed(late))]
    }),
    ("double", |k, random| {
        let n = random.between(1.0, 3.0) as usize;
        vec![Tick::on_time(k * 1000); n]
    }),
    ("the clock goes back", |k, random| {
        let back = if random.between(0.0, 1.0) < 0.05 {
            random.between(0.0, 5000.0) as u64
        } else {
            0
        };
        vec![Tick {
            at: k * 1000,
            clock: (k * 1000).saturating_sub(back),
        }]
    }),
    ("all of it", |k, random| {
        let choice = random.between(0.0, 1.0);
        let late = random.between(-400.0, 400.0) as i64;
        let at = (k * 1000).saturating_add_signed(late);
        let clock = if choice > 0.97 {
            at.saturating_sub(3000)
        } else {
            at
        };
        match choice {
            c if c < 0.1 => vec![],
            c if c < 0.2 => vec![Tick { at, clock }; 2],
            _ => vec![Tick { at, clock }],
        }
    }),
];

fn ticks(seconds: u64, disturb: Disturbance) -> Vec<Tick> {
    let mut random = Random(7);
    let end = seconds * 1000;
    let mut ticks: Vec<_> = (1..end).flat_map(|k| disturb(k, &mut random)).collect();
    // The first and the last are on time, so that the runs begin and end alike.
    ticks.insert(0, Tick::on_time(0));
    ticks.push(Tick::on_time(end * 1000));
    ticks
}

fn undisturbed(k: u64, _: &mut Random) -> Vec<Tick> {
    vec![Tick::on_time(k * 1000)]
}

/// Where encoders that turn on their own have led a controller that was ticked like this for 20 s.
fn counted(ticks: &[Tick]) -> Snapshot {
    let config = Params::default().build(PERIOD);
    let (vehicle, counts) = vehicle::<u16>(&counts::config(geometry()), [0, 0]);
    let mut controller = Controller::new(vehicle, config, None);
    for tick in ticks {
        let t = tick.at as f64 * 1e-6;
        // An arc: of constant curvature, so that where it is cut makes no difference.
        counts[0].set(quantised(0.28 * t / COUNT, 0.0));
        counts[1].set(quantised(0.32 * t / COUNT, 0.5));
        controller.tick(Instant::from_ticks(tick.clock), &Inputs::default());
    }
    controller.snapshot()
}

#[test]
fn no_disturbance_of_the_ticks_loses_a_count() {
    let wanted = counted(&ticks(20, undisturbed));
    let pose = wanted.estimator.present().pose;
    for (name, disturb) in DISTURBANCES {
        let snapshot = counted(&ticks(20, disturb));
        let counts = |s: &Snapshot| s.wheels.map(|wheel| wheel.count);
        assert_eq!(counts(&snapshot), counts(&wanted), "{name}");
        let disturbed = snapshot.estimator.present().pose;
        // The sums carry their rounding: 20 000 of them in 48 bits.
        assert!((disturbed.theta - pose.theta).abs() < 1e-8, "{name}");
        let distance = (disturbed.x - pose.x).hypot(disturbed.y - pose.y);
        // 15 ms are 48 counts: which of them came first within the gap is not known, half a count each time.
        assert!(distance < 1e-4, "{name}: {distance} m");
        println!("{name}: {:.4} mm", distance * 1e3);
    }
}

/// A vehicle that does what it is told, exactly, in true time.
struct Ideal {
    twist: Twist,
    moved: [f64; 2],
}

impl Ideal {
    fn pass(&mut self, seconds: f64) {
        self.moved[0] += f64::from(self.twist.translation) * seconds;
        self.moved[1] += f64::from(self.twist.rotation) * seconds;
    }
}

/// Shared with the test, which lets time pass.
struct Shared(std::rc::Rc<std::cell::RefCell<Ideal>>);

impl VirtualVehicle for Shared {
    type Config = differential::Config;

    fn configure(&mut self, _: &Self::Config) {}

    fn resolution(&self) -> Twist {
        Twist::ZERO
    }

    fn sense(&mut self, _: f32) -> Motion {
        let mut ideal = self.0.borrow_mut();
        // What an f32 does not hold stays for the next time.
        let [translation, rotation] = ideal.moved.map(|moved| moved as f32);
        ideal.moved[0] -= f64::from(translation);
        ideal.moved[1] -= f64::from(rotation);
        Motion {
            increment: Twist {
                translation,
                rotation,
            },
            speed: ideal.twist,
            acceleration: Twist::ZERO,
            // It has no wheels.
            rolled: [0.0; 2],
        }
    }

    fn drive(&mut self, speed: Twist, _: Twist, _: f32, _: f32) -> Result<(), OutputError> {
        self.0.borrow_mut().twist = speed;
        Ok(())
    }

    fn off(&mut self) -> Result<(), OutputError> {
        self.0.borrow_mut().twist = Twist::ZERO;
        Ok(())
    }

    fn wheels(&self) -> [Wheel; 2] {
        [Wheel::default(); 2]
    }
}

const ACCELERATION: f32 = 0.5;
const TURN_ACCELERATION: f32 = 3.0;

/// Servoed to a micrometre before it rests, so that what a disturbance leaves behind is seen.
fn precise() -> Config<differential::Config> {
    let mut config = Params::default().build(PERIOD);
    config.translation.tolerance = 1e-6;
    config.rotation.tolerance = 1e-6;
    config
}

/// Forward, a quarter turn, back: each in its five seconds.
fn course(leg: usize) -> Action<differential::Config> {
    let command = |distance, speed, acceleration| AxisCommand {
        distance,
        speed,
        acceleration,
    };
    match leg {
        0 => Action::Move(command(0.8, 0.4, ACCELERATION)),
        1 => Action::Turn(command(std::f32::consts::FRAC_PI_2, 1.5, TURN_ACCELERATION)),
        _ => Action::Move(command(-0.5, 0.3, ACCELERATION)),
    }
}

/// How many nominal periods the clock has shown, and never fewer than before.
fn nominal_periods(clock: u64, before: u64) -> u64 {
    ((clock + PERIOD.ticks() / 2) / PERIOD.ticks()).max(before)
}

/// Drives the course; checks the reference at each tick, and returns the state at the end.
fn driven(name: &str, ticks: &[Tick]) -> Snapshot {
    let ideal = std::rc::Rc::new(std::cell::RefCell::new(Ideal {
        twist: Twist::ZERO,
        moved: [0.0; 2],
    }));
    let mut controller = Controller::new(Shared(std::rc::Rc::clone(&ideal)), precise(), None);
    let mut last = controller.snapshot();
    let (mut at, mut periods, mut leg, mut done) = (0, 0, 0, 0);
    for tick in ticks {
        ideal
            .borrow_mut()
            .pass(tick.at.saturating_sub(at) as f64 * 1e-6);
        at = tick.at.max(at);
        if leg < 3 && at >= leg as u64 * 5_000_000 {
            controller.request(course(leg)).unwrap();
            leg += 1;
        }
        let events = controller.tick(Instant::from_ticks(tick.clock), &Inputs::default());
        let is_done = |event: &&Event| matches!(event, Event::MoveDone(_) | Event::TurnDone(_));
        done += events.iter().filter(is_done).count();
        let snapshot = controller.snapshot();
        let elapsed = nominal_periods(tick.clock, periods) - periods;
        periods += elapsed;
        // At the first tick a cycle begins although no time has passed.
        let cycles = if at == 0 { 1.0 } else { elapsed as f32 };
        // A thousandth for the landing, and half an ulp of each speed.
        let allowed = |a: f32, v: f32| 1.001 * a * 1e-3 * cycles + 1.2e-7 * v.abs();
        let changes = [
            (last.translation, snapshot.translation, ACCELERATION),
            (last.rotation, snapshot.rotation, TURN_ACCELERATION),
        ];
        for (before, after, a) in changes {
            let change = (after.reference_speed - before.reference_speed).abs();
            let allowed = allowed(a, before.reference_speed);
            assert!(change <= allowed, "{name}, {at} µs: {change} > {allowed}");
        }
        last = snapshot;
    }
    assert_eq!((leg, done), (3, 3), "{name}");
    last
}

#[test]
fn no_disturbance_of_the_ticks_steps_a_reference_or_moves_the_end() {
    let pose = driven("undisturbed", &ticks(15, undisturbed))
        .estimator
        .present()
        .pose;
    // Rounding, and the micrometre within which the vehicle rests.
    assert!(
        (pose.x - 0.8).abs() < 2e-6 && (pose.y + 0.5).abs() < 2e-6,
        "{pose:?}"
    );
    for (name, disturb) in DISTURBANCES {
        let end = driven(name, &ticks(15, disturb)).estimator.present().pose;
        let distance = (end.x - pose.x).hypot(end.y - pose.y);
        println!("{name}: {:.3} µm", distance * 1e6);
        // As above, of both runs and all three legs; and 0.5 m × 1e-6 rad.
        assert!(distance < 5e-6, "{name}: {distance} m");
        assert!((end.theta - pose.theta).abs() < 2e-6, "{name}: {end:?}");
    }
}

#[test]
fn gaps_of_any_length_leave_the_speed_that_of_the_wheels() {
    for gap in [0.02, 0.04, 0.06, 0.1, 0.3, 1.0, 3.0, 10.0, 600.0] {
        for between in [1, 3, 10, 30] {
            let (mut vehicle, counts) = vehicle::<u32>(&counts::config(geometry()), [0, 0]);
            let mut t = 0.0;
            let mut tick = |dt: f64| {
                t += dt;
                for (count, speed) in counts.iter().zip([0.28, -0.32]) {
                    count.set(quantised(speed * t / COUNT, 0.0));
                }
                vehicle.sense(dt as f32);
                vehicle.wheels().map(|wheel| wheel.speed)
            };
            for _ in 0..50 {
                for _ in 0..between {
                    let [left, right] = tick(1e-3);
                    // While it settles, a count more or less is 0.1 m/s.
                    assert!((left - 0.28).abs() < 0.35 && (right + 0.32).abs() < 0.35);
                }
                tick(gap);
            }
            // One count in the innovation is up to 10 mm/s.
            let mut last = [0.0; 2];
            (0..300).for_each(|_| last = tick(1e-3));
            let [left, right] = last;
            assert!((left - 0.28).abs() < 0.012, "{gap} s: {left}");
            assert!((right + 0.32).abs() < 0.012, "{gap} s: {right}");
        }
    }
}
