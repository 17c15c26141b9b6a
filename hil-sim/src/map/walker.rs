//! A base with a map, without motors: wheels that turn as they are told, on a base that is not what its controller believes; its counts go through the real
//! vehicle and estimator, and what these make of it into the real atlas. Hours of driving take seconds.

use crate::consistency::world::{Drawing, World};
use crate::peripherals::Harness;
use crate::plant::Chassis;
use crate::random::Random;
use crate::robot::Robot;
use crate::se2::Pose;
use crate::vehicle::{Vehicle, configuration, vehicle};
use anyhow::{Result, anyhow, ensure};
use std::f64::consts::{PI, TAU};
use vehicle_controller::controller::{Estimator, Noise};
use vehicle_controller::map::{Answer, Atlas, Bounds, MapError, Name, Question, Sighting, There};
use vehicle_controller::params::{DEGREES, Id, Params};
use vehicle_controller::vehicle::VirtualVehicle;

/// Between two looks at the encoders, s: idle is not always there at once.
const STEP: f64 = 0.02;
/// How fast it drives, m/s, and turns, rad/s.
const SPEED: f64 = 0.5;
const TURN_SPEED: f64 = 1.0;

/// How wrong a landmark may be seen: its bearing, rad, and its range, m/m.
pub const BEARING: f64 = 0.0175;
/// See [`BEARING`].
pub const RANGE: f64 = 0.02;

/// The bounds that the parameters say.
#[must_use]
pub fn bounds(params: &Params) -> Bounds {
    let get = |id| f64::from(params.get(id));
    Bounds {
        turn: get(Id::BoundTurn) / DEGREES,
        turn_per_metre: get(Id::BoundTurnPerM) / DEGREES,
        distance: get(Id::BoundDist),
        distance_share: get(Id::BoundDistRel),
    }
}

/// A base that walks where it is told, by the truth.
#[derive(Debug)]
pub struct Walker {
    world: World,
    harness: Harness,
    vehicle: Vehicle,
    estimator: Estimator,
    /// What it makes of its drive.
    pub atlas: Atlas,
    bounds: Bounds,
    random: Random,
}

impl Walker {
    /// A base at the origin: this robot, whose wheels are what its physics say and not what its parameters do, with random errors besides by `noise`.
    ///
    /// # Errors
    /// If the robot is no differential drive.
    pub fn new(robot: &Robot, noise: &Params, seed: u64) -> Result<Self> {
        robot.ensure_differential("a walk")?;
        ensure!(
            matches!(robot.physics.chassis, Chassis::Differential),
            "a walk is for differential drives"
        );
        let get = |id| f64::from(robot.params.get(id));
        let wheels = &robot.physics.wheels;
        let gains = [
            wheels.diameter_right / get(Id::RightDiameter),
            wheels.diameter_left / get(Id::LeftDiameter),
            wheels.base / get(Id::WheelBase),
        ];
        let world = World::new(Drawing::of(noise), gains, Random::new(seed, 0));
        let harness = Harness::default();
        for (wires, count) in harness.wheels.iter().zip(world.counts()) {
            wires.edges.set(count);
        }
        let mut vehicle = vehicle(&harness, robot, &robot.params)?;
        vehicle.sense(STEP as f32);
        let config = configuration(&robot.params, crate::rig::PERIOD);
        let mut estimator = Estimator::new(Noise::default());
        estimator.configure(&config, vehicle.influence());
        Ok(Self {
            world,
            harness,
            vehicle,
            estimator,
            atlas: Atlas::new(),
            bounds: bounds(&robot.params),
            random: Random::new(seed, 1),
        })
    }

    /// Where it truly is.
    #[must_use]
    pub fn pose(&self) -> Pose {
        self.world.pose()
    }

    /// Evenly between two numbers.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.random.fraction()
    }

    /// Drives at these speeds, for so many seconds as its controller counts them.
    fn drive(&mut self, speed: f64, turn_speed: f64, seconds: f64) {
        let steps = (seconds / STEP).ceil().max(1.0);
        for _ in 0..steps as u32 {
            self.world.drive(speed, turn_speed, seconds / steps);
            for (wires, count) in self.harness.wheels.iter().zip(self.world.counts()) {
                wires.edges.set(count);
            }
            let motion = self.vehicle.sense(STEP as f32);
            self.estimator
                .advance(motion.increment, self.vehicle.resolution());
            self.atlas.update(&self.estimator, &self.bounds);
        }
    }

    /// Turns to a direction, by the truth: the short way mostly, in a tenth of all cases the long one, in a twentieth with a full turn more.
    pub fn face(&mut self, direction: f64) {
        let short = wrap(direction - self.pose()[2]);
        let angle = match self.random.fraction() {
            x if x < 0.1 => short - TAU.copysign(short),
            x if x < 0.15 => short + TAU.copysign(short),
            _ => short,
        };
        self.drive(0.0, TURN_SPEED * angle.signum(), angle.abs() / TURN_SPEED);
    }

    /// Drives to a point, by the truth: it turns and drives, and does so again if it is not as near then, m. Some ways it goes backwards, some in two bends.
    pub fn go(&mut self, [x, y]: [f64; 2], near: f64) {
        let backwards = self.random.fraction() < 0.2;
        let bent = self.random.fraction() < 0.2;
        let bend = if bent { self.between(-0.08, 0.08) } else { 0.0 };
        for _ in 0..8 {
            let [here_x, here_y, _] = self.pose();
            let (dx, dy) = (x - here_x, y - here_y);
            let distance = dx.hypot(dy);
            if distance < near {
                return;
            }
            let direction = dy.atan2(dx);
            self.face(if backwards { direction + PI } else { direction });
            let speed = if backwards { -SPEED } else { SPEED };
            for bend in [bend, -bend] {
                self.drive(speed, bend, 0.5 * distance / SPEED);
            }
        }
    }

    /// Asks, and works until there is an answer.
    ///
    /// # Errors
    /// [`MapError`], as the atlas answers.
    ///
    /// # Panics
    /// If there is none.
    pub fn ask(&mut self, question: Question) -> Result<Answer, MapError> {
        self.atlas.ask(question, &self.estimator, &self.bounds);
        while self.atlas.work() {}
        self.atlas.answer().expect("all work is done")
    }

    /// Marks a place.
    ///
    /// # Errors
    /// As the atlas answers.
    pub fn mark(&mut self, name: &str, meadow: f64) -> Result<()> {
        self.ask(Question::Mark(Name::try_from(name)?, Some(meadow)))?;
        Ok(())
    }

    /// Whether it may be at a place.
    ///
    /// # Errors
    /// If there is no such place.
    pub fn am_i_there(&mut self, name: &str) -> Result<There> {
        let Answer::Here(presence) = self.ask(Question::Where)? else {
            return Err(anyhow!("no answer"));
        };
        let place = self.atlas.map().find(name);
        let place = place.ok_or_else(|| anyhow!("no place {name}"))?;
        Ok(self.atlas.there(&presence, place))
    }

    /// Sights a landmark that stands at a point; bearing and range are as wrong as they may be.
    ///
    /// # Errors
    /// As the atlas answers.
    pub fn sight(&mut self, name: &str, [x, y]: [f64; 2]) -> Result<Answer> {
        let [here_x, here_y, theta] = self.pose();
        let (dx, dy) = (x - here_x, y - here_y);
        let bearing = wrap(dy.atan2(dx) - theta) + self.between(-BEARING, BEARING);
        let range = dx.hypot(dy) * (1.0 + self.between(-RANGE, RANGE));
        let sighting = Sighting {
            bearing,
            bearing_bound: BEARING,
            // range = d (1 ± RANGE), so d lies between these.
            range: Some([range / (1.0 + RANGE), range / (1.0 - RANGE)]),
        };
        Ok(self.ask(Question::Sight(Name::try_from(name)?, Some(sighting)))?)
    }
}

/// The angle in ±π.
#[must_use]
pub fn wrap(angle: f64) -> f64 {
    angle - TAU * (angle / TAU).round()
}
