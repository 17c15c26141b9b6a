//! A car whose rear axle may be steered along with the front one [H §II.B].

mod geometry;

use super::gains::OFFSET;
use super::steering::{self, Helm, Steering};
use super::{
    Counter, Drive, Encoder, GAINS, Influence, Motion, OutputError, Relation, Twist,
    VirtualVehicle, Wheel, WheelCommand, differential, observer::Observers, servo,
};
use crate::math::{larger, limit, sqrt};
use differential::Carry;
use embedded_hal_02::Qei;
pub use geometry::{Geometry, RearSteering, Wheels};

/// Which wheels tell the motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Odometry {
    /// Those of the rear axle.
    #[default]
    Rear,
    /// Those of the front axle.
    Front,
    /// All four, each axle by how well it knows.
    Four,
}

/// Everything that parameters decide about this vehicle. Wheels come left first; those of the front axle are like those behind them.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Config {
    /// Distance L of the axles, m.
    pub wheel_base: f32,
    /// Nominal track B of both axles (distance of a pair's contacts), m.
    pub track: f32,
    /// f: how the rear axle is steered.
    pub rear_steering: RearSteering,
    /// How the displacements of an axle's wheels make up its centre's.
    pub relation: Relation,
    /// Which wheels tell the motion. Without encoders in front, those of the rear axle do.
    pub odometry: Odometry,
    /// Nominal metres for each count.
    pub metres_per_count: [f64; 2],
    /// True over nominal: k_r of the right wheels, k_l of the left ones, k_b of the track; φ₀ of the steering, rad.
    pub gains: [f32; GAINS],
    /// Largest speed of a wheel's circumference, m/s.
    pub max_wheel_speed: f32,
    /// Bandwidth of the speed observers, rad/s.
    pub observer_bandwidth: f32,
    /// Encoder counts fall when the wheel rolls forward.
    pub encoder_reversed: [bool; 2],
    /// The servos of the rear wheels' motors.
    pub servo: [servo::Config; 2],
    /// What turns the wheels. Its offset is the gains' φ₀.
    pub steering: steering::Config,
}

/// Below this speed (m/s) the car is all but at rest: it steers first.
const CRAWL: f32 = 1e-3;

/// A car: encoders and motors of the rear wheels, perhaps encoders of the front ones, and what steers it.
#[derive(Debug)]
pub struct BiSteerable<RL, RR, FL, FR, DL, DR, S>
where
    RL: Qei<Count: Counter>,
    RR: Qei<Count: Counter>,
    FL: Qei<Count: Counter>,
    FR: Qei<Count: Counter>,
{
    left: Encoder<RL>,
    right: Encoder<RR>,
    front: Option<(Encoder<FL>, Encoder<FR>)>,
    left_motor: DL,
    right_motor: DR,
    helm: Helm<S>,
    config: Config,
    geometry: Geometry,
    /// The rear axle while it is not steered: a differential drive, to the bit.
    straight: differential::Geometry,
    carry: Carry,
    rear_observers: Observers<2>,
    front_observers: Observers<2>,
    /// Where the wheels are to point while the car is all but at rest, rad.
    aim: f32,
    /// The reference sets out from here: only where it goes matters, not what it is corrected by, or the wheels would never point where they should.
    sets_out: bool,
    duty: [f32; 2],
}

impl<RL, RR, FL, FR, DL, DR, S> BiSteerable<RL, RR, FL, FR, DL, DR, S>
where
    RL: Qei<Count: Counter>,
    RR: Qei<Count: Counter>,
    FL: Qei<Count: Counter>,
    FR: Qei<Count: Counter>,
    DL: Drive,
    DR: Drive,
    S: Steering,
{
    /// Takes encoders, motors and the steering over. `front` are the encoders of the front wheels, where there are some.
    #[allow(clippy::too_many_arguments, reason = "these are its parts")]
    pub fn new(
        left: RL,
        right: RR,
        front: Option<(FL, FR)>,
        left_motor: DL,
        right_motor: DR,
        steering: S,
        config: &Config,
    ) -> Self {
        let mut vehicle = Self {
            left: Encoder::new(left),
            right: Encoder::new(right),
            front: front.map(|(left, right)| (Encoder::new(left), Encoder::new(right))),
            left_motor,
            right_motor,
            helm: Helm::new(steering, &config.steering),
            config: *config,
            geometry: config.geometry(config.track),
            straight: differential::Geometry::default(),
            carry: Carry::default(),
            rear_observers: Observers::new(config.observer_bandwidth),
            front_observers: Observers::new(config.observer_bandwidth),
            aim: 0.0,
            sets_out: false,
            duty: [0.0; 2],
        };
        vehicle.configure(config);
        vehicle.aim = vehicle.helm.sense();
        vehicle
    }

    /// Which wheels tell the motion, of those that can.
    fn odometry(&self) -> Odometry {
        if self.front.is_some() {
            self.config.odometry
        } else {
            Odometry::Rear
        }
    }

    /// What the two axles say of a gain's effect, as one: by ΔS and by Δα it is a twist.
    fn fused(&self, rear: [f32; 4], front: [f32; 4], angle: f32) -> [f32; 4] {
        let twist = |translation, rotation| Twist {
            translation,
            rotation,
        };
        let fuse = |rear, front| self.geometry.fused(rear, front, angle);
        let ([ss, sa, as_, aa], [front_ss, front_sa, front_as, front_aa]) = (rear, front);
        let by_s = fuse(twist(ss, as_), twist(front_ss, front_as));
        let by_a = fuse(twist(sa, aa), twist(front_sa, front_aa));
        [
            by_s.translation,
            by_a.translation,
            by_s.rotation,
            by_a.rotation,
        ]
    }

    /// The twist of the reference point by the wheels' speeds or accelerations.
    fn twist(&self, wheels: &Wheels, angle: f32) -> Twist {
        let twist = match self.odometry() {
            Odometry::Rear => self.geometry.rear(wheels.rear, angle),
            Odometry::Front => self.geometry.front(wheels.front, angle),
            Odometry::Four => self.geometry.four(wheels, angle),
        };
        self.geometry.at_reference(twist, angle)
    }

    fn angle_for(&self, twist: Twist) -> f32 {
        match self.geometry.steering_towards(twist) {
            Some(angle) => limit(angle, self.helm.max_angle()),
            None => self.aim,
        }
    }
}

impl Config {
    fn geometry(&self, track: f32) -> Geometry {
        Geometry::new(
            self.wheel_base,
            [track; 2],
            self.rear_steering,
            self.relation,
        )
    }
}

impl<RL, RR, FL, FR, DL, DR, S> VirtualVehicle for BiSteerable<RL, RR, FL, FR, DL, DR, S>
where
    RL: Qei<Count: Counter>,
    RR: Qei<Count: Counter>,
    FL: Qei<Count: Counter>,
    FR: Qei<Count: Counter>,
    DL: Drive,
    DR: Drive,
    S: Steering,
{
    type Config = Config;

    fn configure(&mut self, config: &Config) {
        self.config = *config;
        self.carry = Carry::default();
        let [left, right] = config.encoder_reversed;
        self.left.set_reversed(left);
        self.right.set_reversed(right);
        if let Some((front_left, front_right)) = &mut self.front {
            front_left.set_reversed(left);
            front_right.set_reversed(right);
        }
        self.left_motor.configure(&config.servo[0]);
        self.right_motor.configure(&config.servo[1]);
        self.helm.configure(&config.steering);
        self.rear_observers.configure(config.observer_bandwidth);
        self.front_observers.configure(config.observer_bandwidth);
        self.set_gains(config.gains);
    }

    fn set_gains(&mut self, gains: [f32; GAINS]) {
        self.config.gains = gains;
        let [right, left, base, offset] = gains;
        let track = f64::from(self.config.track);
        let [of_left, of_right] = self.config.metres_per_count;
        let of_axle = [right, left, base, 0.0];
        self.straight = differential::Geometry::new(track, of_left, of_right, of_axle);
        self.geometry = self.config.geometry(base * self.config.track);
        self.helm.set_offset(offset);
    }

    fn influence(&self) -> Influence {
        let angle = self.helm.angle();
        let mut influence = match self.odometry() {
            Odometry::Rear => self.geometry.rear_influence(angle),
            Odometry::Front => self.geometry.front_influence(angle),
            Odometry::Four => {
                let mut both = self.geometry.rear_influence(angle);
                let front = self.geometry.front_influence(angle);
                for (of_rear, of_front) in both.by_gain.iter_mut().zip(front.by_gain) {
                    *of_rear = self.fused(*of_rear, of_front, angle);
                }
                both
            }
        };
        // Those of gains of 1; the offset is no ratio.
        for (effect, gain) in influence
            .by_gain
            .iter_mut()
            .zip(self.config.gains)
            .take(OFFSET)
        {
            *effect = effect.map(|element| element / gain);
        }
        influence
    }

    fn resolution(&self) -> Twist {
        self.straight.resolution()
    }

    fn steers(&self) -> bool {
        true
    }

    fn max_curvature(&self) -> f32 {
        self.geometry.path_curvature(self.helm.max_angle())
    }

    /// From the reference point to the front axle.
    fn heading_distance(&self) -> f32 {
        self.config.wheel_base - self.geometry.reference()
    }

    fn prepare(&mut self, present: Twist, next: Twist) -> bool {
        let crawls = present.translation.abs() <= CRAWL;
        self.sets_out = crawls && next != Twist::ZERO;
        if !crawls {
            return true;
        }
        self.aim = self.angle_for(next);
        self.helm.points_to(self.aim)
    }

    fn is_astray(&self) -> bool {
        self.helm.is_astray()
    }

    fn steering(&self) -> f32 {
        self.helm.angle()
    }

    fn sense(&mut self, dt: f32) -> Motion {
        let counts = [self.left.read(), self.right.read()];
        let rear = self.straight.rolled(counts);
        let front = match &mut self.front {
            Some((left, right)) => self.straight.rolled([left.read(), right.read()]),
            None => [0.0; 2],
        };
        let angle = self.helm.sense();
        self.rear_observers.update(rear, dt);
        self.front_observers.update(front, dt);
        let increment =
            if self.odometry() == Odometry::Rear && self.geometry.direction(angle) == 0.0 {
                self.carry.advance(&self.straight, counts)
            } else {
                let by_rear = || self.geometry.rear_scaling(angle).twist(rear);
                let by_front = || {
                    let twist = self.geometry.front_scaling(angle).twist(front);
                    self.geometry.from_front(twist, angle)
                };
                let twist = match self.odometry() {
                    Odometry::Rear => by_rear(),
                    Odometry::Front => by_front(),
                    Odometry::Four => self.geometry.fused(by_rear(), by_front(), angle),
                };
                self.geometry.at_reference(twist, angle)
            };
        let speeds = Wheels {
            rear: self.rear_observers.speeds(),
            front: self.front_observers.speeds(),
        };
        let accelerations = Wheels {
            rear: self.rear_observers.accelerations(),
            front: self.front_observers.accelerations(),
        };
        Motion {
            increment,
            speed: self.twist(&speeds, angle),
            acceleration: self.twist(&accelerations, angle),
            rolled: rear,
        }
    }

    fn share(&self, wanted: Twist, supply: f32) -> f32 {
        // The outer rear wheel, which is not faster than the axle's centre and what the turn adds to it.
        let aside = wanted.rotation * self.geometry.reference();
        let centre = sqrt(wanted.translation * wanted.translation + aside * aside);
        let fastest = centre + 0.5 * (wanted.rotation * self.geometry.rear_axle().track()).abs();
        servo::share(
            fastest,
            self.config.max_wheel_speed,
            &self.config.servo,
            supply,
        )
    }

    fn holds_load(&self) -> bool {
        self.left_motor.holds_load() || self.right_motor.holds_load()
    }

    fn knows_duty(&self) -> bool {
        self.left_motor.knows_duty() && self.right_motor.knows_duty()
    }

    fn drive(
        &mut self,
        speed: Twist,
        acceleration: Twist,
        supply: f32,
        dt: f32,
    ) -> Result<(), OutputError> {
        if !self.sets_out && speed.translation.abs() > CRAWL {
            self.aim = self.angle_for(speed);
        }
        self.helm.steer(self.aim, dt)?;
        // On the circle on which the wheels stand now: against it they would scrub.
        let angle = self.helm.angle_within();
        let wheels = |twist: Twist| {
            let rear = self.geometry.at_rear(twist, angle);
            self.geometry.wheel_speeds(rear.translation, angle).rear
        };
        let (mut speeds, mut accelerations) = (wheels(speed), wheels(acceleration));
        let fastest = larger(speeds[0].abs(), speeds[1].abs());
        let limit = self.config.max_wheel_speed;
        if fastest > limit {
            let scale = limit / fastest;
            speeds = speeds.map(|speed| scale * speed);
            accelerations = accelerations.map(|acceleration| scale * acceleration);
        }
        // How far the wheels' speeds are from each other is the steering's to say. Two servos that both insisted would push against each other through the
        // tyres, by all that track, diameters and steering are off: both take out what they have in common, as behind a differential gear.
        let is = self.rear_observers.speeds();
        let behind = 0.5 * ((speeds[0] - is[0]) + (speeds[1] - is[1]));
        let measured = speeds.map(|speed| speed - behind);
        let command = |wheel: usize| WheelCommand {
            speed: speeds[wheel],
            acceleration: accelerations[wheel],
            measured: measured[wheel],
        };
        let (left, right) = (command(0), command(1));
        self.duty = [
            self.left_motor.command(left, supply, dt)?,
            self.right_motor.command(right, supply, dt)?,
        ];
        Ok(())
    }

    /// The steering is held.
    fn brake(&mut self) -> Result<(), OutputError> {
        self.duty = [0.0; 2];
        let left = self.left_motor.brake();
        let right = self.right_motor.brake();
        left.and(right)
    }

    fn off(&mut self) -> Result<(), OutputError> {
        self.duty = [0.0; 2];
        let left = self.left_motor.off();
        let right = self.right_motor.off();
        let steering = self.helm.off();
        left.and(right).and(steering)
    }

    /// The rear wheels.
    fn wheels(&self) -> [Wheel; 2] {
        let speeds = self.rear_observers.speeds();
        let wheel = |index: usize, count| Wheel {
            count,
            speed: speeds[index],
            duty: self.duty[index],
        };
        [wheel(0, self.left.total()), wheel(1, self.right.total())]
    }
}
