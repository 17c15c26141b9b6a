//! A path driven by two ideal axes, held against the path that was planned.

use rand_free::Random;
use std::f64::consts::PI;
use vehicle_controller::controller::{Axis, AxisConfig, AxisSnapshot, Cycle, Pose, State};
use vehicle_controller::math::wrap;
use vehicle_controller::time::Instant;
use vehicle_controller::trajectory::{
    Chase, Corner, Follower, KinematicLimits, Leg, Order, Passage, Path, PathError, PathEvent,
    Posture, Progress, Tolerance,
};

const T: f32 = 1e-3;
const POSTURES: usize = 32;
const MISS: f32 = 0.15;

fn limits() -> KinematicLimits {
    KinematicLimits {
        speed: 0.6,
        acceleration: 0.5,
        turn_speed: 1.5,
        turn_acceleration: 3.0,
        max_curvature: f32::INFINITY,
        curvature_rate: f32::INFINITY,
        wheel_speed: 0.75,
        half_track: 0.15,
        slowest: 0.05,
        turns_in_place: true,
    }
}

/// A generator that needs no crate: xorshift64*.
mod rand_free {
    pub(crate) struct Random(u64);

    impl Random {
        pub(crate) fn new(seed: u64) -> Self {
            Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1)
        }

        /// Between two numbers.
        pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
            self.0 ^= self.0 >> 12;
            self.0 ^= self.0 << 25;
            self.0 ^= self.0 >> 27;
            let bits = self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 11;
            low + (high - low) * bits as f64 / (1_u64 << 53) as f64
        }
    }
}

/// A vehicle that follows the references of two of the library's axes exactly.
struct Base {
    config: AxisConfig,
    axes: [Axis; 2],
    moved: [f32; 2],
    pose: Pose,
    fastest: [f32; 2],
    steepest: [f32; 2],
}

impl Base {
    fn new(pose: Pose) -> Self {
        Self {
            config: AxisConfig {
                gain: 0.0,
                max_error: 1.0,
                tolerance: 1e-3,
                rest_speed: 1e-2,
            },
            axes: [Axis::default(); 2],
            moved: [0.0; 2],
            pose,
            fastest: [0.0; 2],
            steepest: [0.0; 2],
        }
    }

    /// One tick, in the controller's order: what has happened, then the command, then what shall happen. Whoever sees its snapshot sees the pose of its
    /// beginning, and commands the next one.
    fn tick(&mut self, order: Option<Order>) {
        // theory section 2
        let (s, a) = (f64::from(self.moved[0]), f64::from(self.moved[1]));
        let h = 0.5 * a;
        let sinc = if h.abs() < 1e-9 { 1.0 } else { h.sin() / h };
        self.pose.x += s * sinc * (self.pose.theta + h).cos();
        self.pose.y += s * sinc * (self.pose.theta + h).sin();
        self.pose.theta += a;
        for (axis, moved) in self.axes.iter_mut().zip(self.moved) {
            axis.measure(moved, 1);
        }
        let [translation, rotation] = &mut self.axes;
        match order {
            Some(Order::Move(command)) => translation.command(&self.config, command),
            Some(Order::Turn(command)) => rotation.command(&self.config, command),
            None => {}
        }
        for (i, axis) in self.axes.iter_mut().enumerate() {
            let before = axis.reference_speed();
            let cycle = Cycle {
                period: T,
                steps: 1,
                speed: before,
                share: 1.0,
            };
            axis.advance(&self.config, &cycle);
            let after = axis.reference_speed();
            self.moved[i] = axis.velocity(&self.config, T) * T;
            self.fastest[i] = self.fastest[i].max(after.abs());
            self.steepest[i] = self.steepest[i].max((after - before).abs() / T);
        }
    }

    fn progress(&self, interval: f32) -> Progress {
        let axis = |axis: &Axis| AxisSnapshot {
            state: axis.state(),
            displacement: axis.displacement(),
            error: axis.error(),
            speed: axis.reference_speed(),
            reference_speed: axis.reference_speed(),
            acceleration: 0.0,
        };
        Progress {
            pose: self.pose,
            translation: axis(&self.axes[0]),
            rotation: axis(&self.axes[1]),
            interval,
            delay: T,
        }
    }

    fn rests(&self) -> bool {
        self.axes
            .iter()
            .all(|axis| axis.state() == State::Hold && axis.reference_speed() == 0.0)
    }
}

const TOLERANCE: Tolerance = Tolerance {
    distance: 2e-3,
    heading: 2e-3,
};

/// A follower at the start of a path, with all of its legs.
fn follow(
    start: &Pose,
    postures: &[Posture],
    limits: &KinematicLimits,
) -> Result<(Follower<POSTURES>, Vec<Leg>), PathError> {
    let mut follower = Follower::default();
    for posture in postures {
        follower.push(posture, None)?;
    }
    follower.start(start, MISS, TOLERANCE, limits)?;
    let legs = follower.path().legs().collect();
    Ok((follower, legs))
}

/// Points of the planned path, 2 mm apart where it is curved.
fn planned(start: &Pose, legs: &[Leg]) -> Vec<[f64; 2]> {
    let mut points = vec![[start.x, start.y]];
    let mut before: Option<Corner> = None;
    for leg in legs {
        let heading = f64::from(leg.heading);
        let along = |lead: f64| {
            [
                leg.to.x - lead * heading.cos(),
                leg.to.y - lead * heading.sin(),
            ]
        };
        if let Some(corner) = before {
            points.push(along(f64::from(leg.length - corner.lead)));
        }
        before = None;
        match leg.end {
            Passage::Stop(_) => points.push(along(0.0)),
            Passage::Rounded(corner) => {
                let mut at = along(f64::from(corner.lead));
                points.push(at);
                let (v, w) = (f64::from(corner.speed), f64::from(corner.turn_speed));
                let (a, d) = (f64::from(corner.turn_acceleration), f64::from(corner.angle));
                let duration = if w > 0.0 { d.abs() / w + w / a } else { 0.0 };
                let angle = |t: f64| {
                    let ramp = w / a;
                    let turned = if t < ramp {
                        0.5 * a * t * t
                    } else if t < duration - ramp {
                        w * (t - 0.5 * ramp)
                    } else {
                        d.abs() - 0.5 * a * (duration - t) * (duration - t)
                    };
                    heading + d.signum() * turned
                };
                let steps = (duration * v / 2e-3).ceil().max(1.0);
                let dt = duration / steps;
                for k in 0..steps as usize {
                    let middle = angle((k as f64 + 0.5) * dt);
                    at = [at[0] + v * dt * middle.cos(), at[1] + v * dt * middle.sin()];
                    points.push(at);
                }
                before = Some(corner);
            }
        }
    }
    points
}

fn distance(p: [f64; 2], a: [f64; 2], b: [f64; 2]) -> f64 {
    let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
    let square = dx * dx + dy * dy;
    let along = if square > 0.0 {
        (((p[0] - a[0]) * dx + (p[1] - a[1]) * dy) / square).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (p[0] - a[0] - along * dx).hypot(p[1] - a[1] - along * dy)
}

/// Looks for a pose near where the last one was: a path may cross itself.
struct Ruler {
    points: Vec<[f64; 2]>,
    at: usize,
}

impl Ruler {
    fn off(&mut self, pose: &Pose) -> f64 {
        const AHEAD: f64 = 0.05;
        let p = [pose.x, pose.y];
        let mut best = (f64::INFINITY, self.at);
        // From the pose to where the segment begins.
        let mut way = 0.0_f64;
        for (i, ends) in self.points.windows(2).enumerate().skip(self.at) {
            if way > AHEAD {
                break;
            }
            let off = distance(p, ends[0], ends[1]);
            if off < best.0 {
                best = (off, i);
            }
            way = (ends[1][0] - p[0]).hypot(ends[1][1] - p[1]);
        }
        self.at = best.1;
        best.0
    }
}

fn posture(x: f64, y: f64) -> Posture {
    Posture {
        x,
        y,
        heading: None,
        speed: None,
    }
}

struct Run {
    worst: f64,
    events: Vec<PathEvent>,
    base: Base,
    orders: usize,
    seconds: f64,
}

/// Drives a path to its end, with the follower updated every so many cycles.
fn run(
    start: Pose,
    (mut follower, legs): (Follower<POSTURES>, Vec<Leg>),
    every: u32,
    disturb: impl Fn(f64, &mut Pose),
) -> Run {
    let mut run = Run {
        worst: 0.0,
        events: Vec::new(),
        base: Base::new(start),
        orders: 0,
        seconds: 0.0,
    };
    let mut ruler = Ruler {
        points: planned(&start, &legs),
        at: 0,
    };
    let mut order = None;
    for cycle in 0..1_000_000_u32 {
        run.base.tick(order.take());
        disturb(f64::from(cycle) * 1e-3, &mut run.base.pose);
        run.worst = run.worst.max(ruler.off(&run.base.pose));
        if cycle % every == 0 {
            let (next, event) = follower.update(&run.base.progress(every as f32 * T));
            run.events.extend(event);
            run.orders += usize::from(next.is_some());
            order = next;
            if follower.is_done() && run.base.rests() {
                run.seconds = f64::from(cycle) * 1e-3;
                return run;
            }
        }
    }
    panic!("it does not arrive: {follower:?} {:?}", run.base.pose);
}

fn polyline(random: &mut Random) -> (Pose, Vec<Posture>) {
    let start = Pose {
        x: random.between(-20.0, 20.0),
        y: random.between(-20.0, 20.0),
        theta: random.between(-10.0, 10.0),
    };
    let (mut x, mut y, mut heading) = (start.x, start.y, random.between(-PI, PI));
    let count = random.between(1.0, 9.0) as usize;
    let mut postures = Vec::new();
    for _ in 0..count {
        let length = random.between(0.05, 2.5);
        x += length * heading.cos();
        y += length * heading.sin();
        heading += random.between(-PI, PI) * random.between(0.0, 1.0);
        let mut next = posture(x, y);
        if random.between(0.0, 1.0) < 0.1 {
            next.heading = Some(random.between(-PI, PI) as f32);
        }
        if random.between(0.0, 1.0) < 0.3 {
            next.speed = Some(random.between(0.1, 0.9) as f32);
        }
        postures.push(next);
    }
    (start, postures)
}

#[test]
fn a_thousand_polylines_are_driven_as_planned() {
    let (mut worst, mut far, mut askew) = (0.0_f64, 0.0_f64, 0.0_f64);
    let (mut rounded, mut stops, mut orders, mut seconds) = (0, 0, 0, 0.0);
    for seed in 0..1000 {
        let mut random = Random::new(seed + 1);
        let (start, postures) = polyline(&mut random);
        let path = follow(&start, &postures, &limits()).unwrap();
        for leg in &path.1 {
            match leg.end {
                Passage::Rounded(corner) => {
                    rounded += 1;
                    assert!(corner.miss <= MISS && corner.speed <= leg.speed);
                    assert!(corner.speed >= limits().slowest);
                }
                Passage::Stop(_) => stops += 1,
            }
        }
        let run = run(start, path.clone(), 1, |_, _| {});
        worst = worst.max(run.worst);
        orders += run.orders;
        seconds += run.seconds;
        assert!(run.worst < 5e-3, "{seed}: {} off {path:?}", run.worst);
        let last = postures.last().unwrap();
        let pose = run.base.pose;
        far = far.max((pose.x - last.x).hypot(pose.y - last.y));
        assert!(far < 2e-3, "{seed}: ends {far} off");
        let leg = path.1.last().unwrap();
        let heading = last.heading.unwrap_or(leg.heading);
        askew = askew.max(wrap(pose.theta - f64::from(heading)).abs());
        assert!(askew < 0.2 * PI / 180.0, "{seed}: ends {askew} askew");
        // Every posture, in order.
        assert_eq!(run.events.len(), postures.len());
        for (n, event) in run.events.iter().enumerate() {
            let wanted = if n + 1 == postures.len() {
                PathEvent::Done
            } else {
                PathEvent::Posture(n as u32 + 1)
            };
            assert_eq!(*event, wanted, "{seed}");
        }
        let allowed = limits();
        assert!(run.base.fastest[0] <= allowed.speed * (1.0 + 1e-5));
        assert!(run.base.fastest[1] <= allowed.turn_speed * (1.0 + 1e-5));
        // What landing adds to a, and an ulp of the speeds' difference.
        assert!(run.base.steepest[0] <= allowed.acceleration * 1.002 + 1e-4);
        assert!(run.base.steepest[1] <= allowed.turn_acceleration * 1.002 + 2e-4);
    }
    println!(
        "worst {:.3} mm, end {:.3} mm, {:.4}°, {rounded} rounded, {stops} stops, {orders} orders in {seconds:.0} s",
        worst * 1e3,
        far * 1e3,
        askew * 180.0 / PI
    );
    assert!(rounded > 500 && stops > 1000, "{rounded} {stops}");
}

#[test]
fn updates_at_100_hz_will_do() {
    let mut worst = 0.0_f64;
    for seed in 0..100 {
        let mut random = Random::new(seed + 5000);
        let (start, postures) = polyline(&mut random);
        let path = follow(&start, &postures, &limits()).unwrap();
        worst = worst.max(run(start, path.clone(), 10, |_, _| {}).worst);
    }
    println!("worst {:.3} mm", worst * 1e3);
    // Late by half an update at 0.6 m/s is 3 mm, twice in a row by the next corner.
    assert!(worst < 10e-3, "{worst}");
}

#[test]
fn a_correction_is_regained_without_a_step() {
    let start = Pose::default();
    let postures = [posture(3.0, 0.0), posture(3.0, 3.0), posture(0.0, 3.0)];
    let path = follow(&start, &postures, &limits()).unwrap();
    let run = run(start, path.clone(), 1, |t, pose| {
        if (t - 3.0).abs() < 1e-6 {
            pose.y += 0.05;
            pose.theta += 0.02;
        }
        if (t - 9.0).abs() < 1e-6 {
            pose.x -= 0.03;
        }
    });
    let pose = run.base.pose;
    assert!(pose.x.hypot(pose.y - 3.0) < 4e-3, "{pose:?}");
    assert!(wrap(pose.theta - PI).abs() < 0.5 * PI / 180.0, "{pose:?}");
    assert!(run.base.steepest[0] <= limits().acceleration * 1.002 + 1e-4);
    assert!(run.base.steepest[1] <= limits().turn_acceleration * 1.002 + 2e-4);
}

#[test]
fn a_heading_is_taken_at_a_stop() {
    let mut there = posture(1.0, 0.0);
    there.heading = Some(2.0);
    let path = follow(&Pose::default(), &[there, posture(2.0, 1.0)], &limits()).unwrap();
    assert_eq!(path.1[0].end, Passage::Stop(Some(2.0)));
    let run = run(Pose::default(), path, 1, |_, _| {});
    assert_eq!(run.events, [PathEvent::Posture(1), PathEvent::Done]);
    // Here, but turned.
    there.x = 0.0;
    let path = follow(&Pose::default(), &[there], &limits()).unwrap();
    let turned = self::run(Pose::default(), path, 1, |_, _| {});
    assert!((turned.base.pose.theta - 2.0).abs() < 1e-3);
    assert!(turned.base.pose.x.abs() < 1e-6);
}

#[test]
fn a_car_is_refused_what_it_cannot_drive() {
    let car = KinematicLimits {
        max_curvature: 1.0,
        turns_in_place: false,
        ..limits()
    };
    let plan = |postures: &[Posture], miss| {
        let mut path = Path::<POSTURES>::default();
        for posture in postures {
            path.push(posture).unwrap();
        }
        path.plan(&Pose::default(), miss, &car)
    };
    assert_eq!(plan(&[posture(0.0, 1.0)], 0.5), Err(PathError::Start(0)));
    let corner = [posture(5.0, 0.0), posture(5.0, 5.0)];
    assert!(plan(&corner, 0.5).is_ok());
    // An arc of 1 m misses a right angle by 0.41 m.
    assert_eq!(plan(&corner, 0.4), Err(PathError::Sharp(0)));
    let mut heading = posture(5.0, 0.0);
    heading.heading = Some(0.5);
    assert_eq!(plan(&[heading], 0.5), Err(PathError::Sharp(0)));
    heading.heading = Some(0.01);
    assert!(plan(&[heading], 0.5).is_ok());
    let mut follower = Follower::default();
    for posture in &corner {
        follower.push(posture, None).unwrap();
    }
    follower
        .start(&Pose::default(), 0.5, TOLERANCE, &car)
        .unwrap();
    let legs = follower.path().legs().collect();
    let run = run(Pose::default(), (follower, legs), 1, |_, _| {});
    assert!(run.worst < 5e-3, "{}", run.worst);
}

#[test]
fn what_is_no_posture_is_refused() {
    let mut path = Path::<2>::default();
    let plan = |path: &mut Path<2>| path.plan(&Pose::default(), MISS, &limits());
    assert_eq!(plan(&mut path), Err(PathError::Range(0)));
    assert_eq!(path.push(&posture(1.0, f64::NAN)), Err(PathError::Range(0)));
    path.push(&posture(0.5, 0.0)).unwrap();
    let mut slow = posture(1.0, 0.0);
    slow.speed = Some(0.0);
    assert_eq!(path.push(&slow), Err(PathError::Range(1)));
    path.push(&posture(1.0, 0.0)).unwrap();
    assert_eq!(path.push(&posture(1.0, 0.0)), Err(PathError::Full));
    assert_eq!(plan(&mut path), Ok(()));
    let still = KinematicLimits {
        turn_speed: 0.0,
        ..limits()
    };
    let planned = path.plan(&Pose::default(), MISS, &still);
    assert_eq!(planned, Err(PathError::Still));
}

#[test]
fn a_target_on_a_circle_is_kept_up_with() {
    for updates in [1, 5, 20, 50] {
        let every = 1000 / updates;
        let limits = limits();
        let mut base = Base::new(Pose::default());
        let mut chase = Chase::default();
        let mut worst = 0.0_f64;
        let mut order = None;
        let at = |t: f64| {
            let angle = 0.3 * t;
            posture(1.0 + angle.cos(), angle.sin())
        };
        for cycle in 0..40_000_u32 {
            let t = f64::from(cycle) * 1e-3;
            let now = Instant::from_ticks(u64::from(cycle) * 1000);
            if cycle % every == 0 {
                chase.replace(at(t), now, &limits);
            }
            base.tick(order.take());
            if cycle % 10 == 0 {
                order = chase.update(&base.progress(0.01), now, &limits);
            }
            if t > 20.0 {
                let target = at(t);
                worst = worst.max((base.pose.x - target.x).hypot(base.pose.y - target.y));
            }
        }
        println!("{updates} Hz: {:.1} mm", worst * 1e3);
        if updates >= 20 {
            assert!(worst < 0.05, "{updates} Hz: {worst}");
        }
        assert!(base.steepest[0] <= limits.acceleration * 1.002 + 1e-4);
        assert!(base.steepest[1] <= limits.turn_acceleration * 1.002 + 2e-4);
        // No more updates: it comes to rest.
        for cycle in 40_000..48_000_u32 {
            let now = Instant::from_ticks(u64::from(cycle) * 1000);
            base.tick(order.take());
            if cycle % 10 == 0 {
                order = chase.update(&base.progress(0.01), now, &limits);
            }
        }
        assert!(
            base.rests(),
            "{updates} Hz {:?} {:?} {:?}",
            base.pose,
            base.axes,
            chase.goal(Instant::from_ticks(45_000_000), &limits)
        );
    }
}

#[test]
fn a_slow_target_is_followed_smoothly() {
    let limits = limits();
    let mut base = Base::new(Pose::default());
    let mut chase = Chase::default();
    let mut order = None;
    let (mut slowest, mut fastest) = (f32::INFINITY, 0.0_f32);
    for cycle in 0..20_000_u32 {
        let now = Instant::from_ticks(u64::from(cycle) * 1000);
        if cycle % 100 == 0 {
            chase.replace(posture(0.2 + 5e-5 * f64::from(cycle), 0.0), now, &limits);
        }
        base.tick(order.take());
        if cycle % 10 == 0 {
            order = chase.update(&base.progress(0.01), now, &limits);
        }
        if cycle > 8_000 {
            let speed = base.axes[0].reference_speed();
            (slowest, fastest) = (slowest.min(speed), fastest.max(speed));
        }
    }
    println!("{slowest} to {fastest} m/s");
    assert!(slowest > 0.03 && fastest < 0.08, "{slowest} {fastest}");
    assert!((base.pose.x - 1.2).abs() < 0.03, "{:?}", base.pose);
}

/// Drives two legs with a corner of an angle between them, the first 3 m and a bit along x. The disturbance comes once, 2 cm before the turn; the answer is how far the
/// base is beside the second leg, and from its direction, when it has left the corner.
fn round_one(degrees: f64, bit: f64, disturb: impl Fn(&mut Pose)) -> (f64, f64, Base) {
    let angle = degrees * PI / 180.0;
    let corner = 3.0 + bit;
    let end = posture(corner + 3.0 * angle.cos(), 3.0 * angle.sin());
    let (mut follower, legs) =
        follow(&Pose::default(), &[posture(corner, 0.0), end], &limits()).unwrap();
    let Passage::Rounded(rounded) = legs[0].end else {
        panic!("a stop")
    };
    let last = corner - f64::from(rounded.lead) - 0.02;
    let mut base = Base::new(Pose::default());
    let (mut order, mut disturbed) = (None, false);
    for _ in 0..60_000 {
        base.tick(order);
        if !disturbed && base.pose.x > last {
            disturbed = true;
            disturb(&mut base.pose);
        }
        let (next, event) = follower.update(&base.progress(T));
        order = next;
        if event == Some(PathEvent::Posture(1)) {
            let (dx, dy) = (base.pose.x - corner, base.pose.y);
            let beside = dy * angle.cos() - dx * angle.sin();
            return (beside, base.pose.theta - angle, base);
        }
    }
    panic!("no corner")
}

#[test]
fn a_turn_starts_in_the_tick_that_is_nearest() {
    for k in 0..20 {
        let (beside, askew, _) = round_one(60.0, 1.3e-4 * f64::from(k), |_| {});
        // Half a cycle at 0.6 m/s, and what the discrete trapezoid differs by: a quarter.
        assert!(beside.abs() < 0.45e-3, "{k}: {beside}");
        assert!(askew.abs() < 1e-5, "{k}: {askew}");
    }
}

#[test]
fn a_corner_ends_on_the_next_leg_whatever_it_starts_from() {
    for degrees in [40.0, 60.0, 120.0] {
        // Nothing but the corner can set it right.
        let (beside, askew, _) = round_one(degrees, 0.0, |pose| {
            pose.y += 0.01;
            pose.theta += 0.01;
        });
        assert!(beside.abs() < 2e-3, "{degrees}: {beside}");
        assert!(askew.abs() < 2e-3, "{degrees}: {askew}");
    }
}

#[test]
fn a_hairpin_turns_its_own_way() {
    let (_, askew, base) = round_one(150.0, 0.0, |pose| pose.theta -= 0.6);
    // Not by 180° the other way.
    assert!(askew.abs() < 0.1, "{askew}");
    assert!(base.pose.theta > 2.0);
}

#[test]
fn a_leg_is_regained() {
    let (mut follower, _) = follow(&Pose::default(), &[posture(5.0, 0.0)], &limits()).unwrap();
    let mut base = Base::new(Pose::default());
    let (mut order, mut disturbed) = (None, None);
    for _ in 0..60_000 {
        base.tick(order);
        if disturbed.is_none() && base.pose.x > 1.0 {
            base.pose.y += 0.05;
            disturbed = Some(base.pose.x);
        }
        // exp(−S/ℓ) with ℓ = 0.6 m, from where the turn has come about: 5 cm are 7 mm after 1.2 m, and 1.2 mm after 2.2 m.
        for (way, most) in [(0.3, 0.045), (1.4, 0.009), (2.6, 0.003)] {
            if disturbed.is_some_and(|x| base.pose.x > x + way) {
                assert!(base.pose.y.abs() < most, "{way}: {:?}", base.pose);
            }
        }
        order = follower.update(&base.progress(T)).0;
    }
    assert!(follower.is_done() && (base.pose.x - 5.0).abs() < 2e-3);
}

#[test]
fn wheels_that_are_just_fast_enough_leave_room_to_steer() {
    let limits = KinematicLimits {
        wheel_speed: limits().speed,
        ..limits()
    };
    assert!(limits.turn_speed_at(limits.straight_speed()) > 0.0);
    let (mut follower, _) = follow(&Pose::default(), &[posture(5.0, 0.0)], &limits).unwrap();
    let mut base = Base::new(Pose::default());
    let (mut order, mut disturbed) = (None, false);
    for _ in 0..60_000 {
        base.tick(order);
        if !disturbed && base.pose.x > 1.0 {
            base.pose.y += 0.05;
            disturbed = true;
        }
        order = follower.update(&base.progress(T)).0;
    }
    // Five of its lengths later, nothing is left of it.
    assert!(
        follower.is_done() && base.pose.y.abs() < 3e-3,
        "{:?}",
        base.pose
    );
}
