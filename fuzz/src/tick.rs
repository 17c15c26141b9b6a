//! The tick with arbitrary counts, times, inputs and requests.
//!
//! The input is a little program: a byte says what happens, the next ones with which numbers. The first byte says what base it happens to; the wheels of
//! every other one follow their motors, so that the counts are plausible until the program says otherwise.

use nalgebra::{Matrix3, RowVector3, Vector3};
use vehicle_controller::controller::{
    AxisCommand, Controller, Inputs, Interface, Observation, Pose, Snapshot,
};
use vehicle_controller::interpreter::Desk;
use vehicle_controller::params::{Kind, Params};
use vehicle_controller::supervisor::{Fault, Reaction};
use vehicle_controller::time::Instant;
use vehicle_controller::vehicle::Counter;

use crate::base::{self, PERIOD, Vehicle, Wheel, vehicle};
use crate::invariant;

/// The wheels follow for so many periods of a gap: after it, they stand where they were.
const LONGEST: u64 = 50;

/// Runs an input.
///
/// # Panics
/// If a promise is broken.
pub fn run(data: &[u8]) {
    let mut source = Source(data);
    let kind = source.byte();
    let follows = kind & 2 != 0;
    match kind & 1 {
        0 => drive(source, follows, |count| count as u16),
        _ => drive(source, follows, |count| count),
    }
}

fn drive<C: Counter>(mut source: Source<'_>, follows: bool, width: fn(u32) -> C) {
    let wheels: [Wheel; 2] = Default::default();
    let mut base = Base::new(&wheels, width, follows, &mut source);
    while !source.0.is_empty() {
        base.step(&mut source);
    }
    base.tick(PERIOD.ticks());
    invariant::check_estimate(&base.snapshot.estimator.present());
}

struct Base<'a, C: Counter> {
    wheels: &'a [Wheel; 2],
    /// Their motors turn them.
    follow: [bool; 2],
    controller: Controller<Vehicle<'a, C>>,
    desk: Desk,
    params: Params,
    inputs: Inputs,
    now: u64,
    snapshot: Snapshot,
    ticks: u32,
    /// The largest v that any command could ask for, m/s and rad/s.
    fastest: [f32; 2],
}

impl<'a, C: Counter> Base<'a, C> {
    fn new(
        wheels: &'a [Wheel; 2],
        width: fn(u32) -> C,
        follows: bool,
        source: &mut Source<'_>,
    ) -> Self {
        let params = base::defaults().params;
        let config = params.build(PERIOD);
        let vehicle = vehicle(wheels, width, &config.vehicle);
        let faults = [
            None,
            Some(Fault::Watchdog),
            Some(Fault::Estop),
            Some(Fault::Output),
        ];
        let fault = faults[usize::from(source.byte() & 3)];
        let controller = Controller::new(vehicle, config, fault);
        let snapshot = controller.snapshot();
        let limits = params.limits();
        Self {
            wheels,
            follow: [follows; 2],
            desk: Interface::new(snapshot, limits),
            controller,
            params,
            inputs: Inputs::default(),
            now: 0,
            snapshot,
            ticks: 0,
            fastest: [limits.speed, limits.turn_speed],
        }
    }

    fn step(&mut self, source: &mut Source<'_>) {
        let [left, right] = self.wheels;
        let [left_follows, right_follows] = &mut self.follow;
        match source.byte() {
            what @ 0..=63 => (0..=what & 15).for_each(|_| self.tick(PERIOD.ticks())),
            64 => self.tick(0),
            65 => self.tick(u64::from(source.byte()) * 100),
            66 => self.tick(u64::from(source.u32())),
            67 => self.tick(u64::from(source.u32()).wrapping_neg()),
            68 => self.tick(u64::from(source.u32()) << 32 | u64::from(source.u32())),
            70..=79 => left.jump(i32::from(source.byte().cast_signed())),
            80..=89 => right.jump(i32::from(source.byte().cast_signed())),
            90 => left.jump(source.u32().cast_signed()),
            91 => right.jump(source.u32().cast_signed()),
            92 => {
                let both = source.u32().cast_signed() >> (source.byte() & 31);
                left.jump(both);
                right.jump(both);
            }
            93 => *left_follows ^= true,
            94 => *right_follows ^= true,
            // Long enough for the slowest fault.
            95 => (0..=u16::from(source.byte()) * 4).for_each(|_| self.tick(PERIOD.ticks())),
            100 => self.inputs.battery = Some(source.f32()),
            101 => self.inputs.battery = None,
            102 => self.inputs.currents = [Some(source.f32()), Some(source.f32())],
            103 => self.inputs.estop_open ^= true,
            104 => self.inputs.stop_button ^= true,
            105 => left.broken.set(!left.broken.get()),
            106 => right.broken.set(!right.broken.get()),
            what => self.ask(what, source),
        }
    }

    /// A request; refused or not, the tick must bear it.
    fn ask(&mut self, what: u8, source: &mut Source<'_>) {
        let desk = &mut self.desk;
        let _ = match what {
            110..=129 => desk.move_by(source.command()),
            130..=149 => desk.turn_by(source.command()),
            150..=154 => desk.stop(),
            155 => {
                desk.emergency_stop();
                Ok(())
            }
            156..=160 => desk.clear_fault(),
            161 => desk.enable(),
            162 => desk.disable(),
            163..=169 => desk.reset_pos(source.pose(), &source.covariance()),
            170..=179 => {
                desk.get_est_pos();
                let shift = Vector3::from(source.f64s());
                desk.correct_pos(shift, &Matrix3::from_iterator(source.f64s::<9>()))
            }
            180..=189 => {
                let observation = Observation::Pose {
                    pose: source.pose(),
                    covariance: source.covariance(),
                };
                desk.observe(&observation, source.f32(), source.f32().abs())
                    .map(drop)
            }
            190..=199 => {
                let [innovation, variance, a, b, c] = source.f64s();
                let observation = Observation::Scalar {
                    innovation,
                    variance,
                    row: RowVector3::new(a, b, c),
                };
                desk.observe(&observation, source.f32(), source.f32().abs())
                    .map(drop)
            }
            200..=239 => {
                self.configure(source);
                Ok(())
            }
            _ => Ok(()),
        };
    }

    fn configure(&mut self, source: &mut Source<'_>) {
        let which = usize::from(source.byte());
        let params = Params::default();
        let id = params
            .ids()
            .nth(which % params.count())
            .expect("it is one of them");
        let spec = id.spec();
        let share = f32::from(source.byte()) / 255.0;
        // Both ends and the default are worth more than what lies between.
        let value = match spec.kind {
            Kind::Switch | Kind::Wiring => share.round(),
            Kind::Value | Kind::Geometry if share > 0.7 => spec.default,
            Kind::Value | Kind::Geometry => {
                (spec.min + (spec.max - spec.min) * (share / 0.7)).clamp(spec.min, spec.max)
            }
        };
        let mut params = self.params;
        if params.set(id, value).is_err() {
            return;
        }
        let geometry = matches!(spec.kind, Kind::Geometry | Kind::Wiring);
        let config = params.build(PERIOD);
        if self
            .desk
            .configure(config, params.limits(), geometry)
            .is_ok()
        {
            self.params = params;
            let limits = params.limits();
            self.fastest[0] = self.fastest[0].max(limits.speed);
            self.fastest[1] = self.fastest[1].max(limits.turn_speed);
        }
    }

    fn tick(&mut self, later: u64) {
        while let Some(request) = self.desk.take_request() {
            assert!(self.controller.request(request).is_ok(), "no room");
        }
        self.now = self.now.wrapping_add(later);
        for (wheel, _) in self
            .wheels
            .iter()
            .zip(self.follow)
            .filter(|(_, follows)| *follows)
        {
            (0..(later / PERIOD.ticks()).min(LONGEST)).for_each(|_| wheel.roll());
        }
        let events = self
            .controller
            .tick(Instant::from_ticks(self.now), &self.inputs);
        assert!(events.len() <= 4, "{events:?}");
        let before = self.snapshot;
        self.controller.update_snapshot(&mut self.snapshot);
        let snapshot = &self.snapshot;
        invariant::check(snapshot);
        if let Some(fault) = before.fault
            && snapshot.fault.is_none()
        {
            // Nothing moves by the clearing; a stop under way goes on.
            let off = self.wheels.iter().all(Wheel::is_off);
            assert!(off || fault.reaction() == Reaction::Stop, "{snapshot:?}");
            let v = |snapshot: &Snapshot| {
                [&snapshot.translation, &snapshot.rotation].map(|axis| axis.reference_speed.abs())
            };
            let slower = v(snapshot)
                .iter()
                .zip(v(&before))
                .all(|(now, then)| *now <= then);
            // With the link an axis loses nothing but a motion without an end.
            assert!(slower || fault == Fault::Link, "{snapshot:?}");
        }
        for (axis, fastest) in [&snapshot.translation, &snapshot.rotation]
            .into_iter()
            .zip(self.fastest)
        {
            let v = axis.reference_speed.abs();
            assert!(v <= fastest * 1.000_01, "{v} beyond {fastest}: {axis:?}");
        }
        self.ticks += 1;
        if self.ticks.is_multiple_of(8) {
            assert!(*snapshot == self.controller.snapshot(), "copied in part");
            invariant::check_estimate(&snapshot.estimator.present());
        }
        self.desk.update(*snapshot);
        while self.desk.work() {}
    }
}

/// Numbers from bytes; zeros when there are none left.
struct Source<'a>(&'a [u8]);

impl Source<'_> {
    fn byte(&mut self) -> u8 {
        let Some((first, rest)) = self.0.split_first() else {
            return 0;
        };
        self.0 = rest;
        *first
    }

    fn u32(&mut self) -> u32 {
        u32::from_le_bytes([(); 4].map(|()| self.byte()))
    }

    /// Any number there is; everyday ones and the odd ones more often.
    fn f32(&mut self) -> f32 {
        const ODD: [f32; 24] = [
            0.0,
            -0.0,
            1.0,
            -1.0,
            0.5,
            0.3,
            -0.3,
            0.01,
            2.0,
            10.0,
            -10.0,
            100.0,
            1e3,
            1e6,
            1e-6,
            1e-20,
            f32::MIN_POSITIVE,
            1e-40,
            1e20,
            f32::MAX,
            f32::MIN,
            f32::INFINITY,
            f32::NEG_INFINITY,
            f32::NAN,
        ];
        let which = self.byte();
        match ODD.get(usize::from(which)) {
            Some(odd) => *odd,
            None if which < 128 => (f32::from(which) - 76.0) / 16.0,
            None => f32::from_bits(self.u32()),
        }
    }

    fn f64s<const N: usize>(&mut self) -> [f64; N] {
        [(); N].map(|()| f64::from(self.f32()))
    }

    fn command(&mut self) -> AxisCommand {
        AxisCommand {
            distance: self.f32(),
            speed: self.f32(),
            acceleration: self.f32(),
        }
    }

    fn pose(&mut self) -> Pose {
        let [x, y, theta] = self.f64s();
        Pose { x, y, theta }
    }

    /// A Aᵀ of some A, or anything.
    fn covariance(&mut self) -> Matrix3<f64> {
        let any = self.byte() < 32;
        let a = Matrix3::from_iterator(self.f64s::<9>());
        if any { a } else { a * a.transpose() }
    }
}
