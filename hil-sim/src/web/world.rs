//! The simulated world, as clients see it and meddle with it. It works in the simulation's own thread, between two ticks.

use super::broken::{Broken, possible};
use super::hub::{Asked, Hub};
use super::pace::PaceMeter;
use super::requests::Request;
use anyhow::{Result, ensure};
use hil_sim::base::Base;
use hil_sim::robot::{Model, Robot};
use serde_json::{Value, json};
use std::sync::Arc;
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};
use vehicle_controller::time;
use vehicle_controller::vehicle::Kind;

/// Clients are told of it this often.
const PERIOD: Duration = Duration::from_millis(40);

/// At the end, clients have so long to hear of it.
const LEAVE_TAKING: Duration = Duration::from_millis(500);
/// Requests that are fulfilled between two looks at the base: it is not to wait for a client that asks without end.
const MAX_AT_ONCE: usize = 4;

/// What a client is told of the base when it comes; `name` is the robot's, `image` whether the firmware's image controls it, `speed` how many
/// simulated seconds there are to be in one.
pub fn hello(robot: &Robot, name: &str, image: bool, speed: f64) -> Value {
    let faults: Vec<String> = possible(robot).iter().map(ToString::to_string).collect();
    let wheels = &robot.physics.wheels;
    let vehicle = robot.params.vehicle();
    json!({
        "robot": name,
        "vehicle": match vehicle {
            Kind::Differential => "differential",
            Kind::Synchro => "synchro",
            Kind::Tricycle => "tricycle",
            Kind::BiSteerable => "bisteerable",
        },
        "image": image,
        "speed": speed,
        "faults": faults,
        "push": robot.model == Model::Dynamic,
        "truth": (vehicle == Kind::Differential).then(|| json!({
            "wheel_base": wheels.base,
            "left_diameter": wheels.diameter_left,
            "right_diameter": wheels.diameter_right,
        })),
    })
}

/// The world.
pub struct World {
    hub: Arc<Hub>,
    asked: Receiver<Asked>,
    /// Simulated seconds in a second, as wished.
    wished: f64,
    can_be_pushed: bool,
    began: Instant,
    /// When clients are to be told next, since then.
    due: Duration,
    pace: PaceMeter,
    /// The base's clock when it was last looked at.
    clock: f64,
    broken: Broken,
    estop: bool,
    pushed_until: time::Instant,
}

impl World {
    /// The world of a robot at which nothing is wrong.
    pub fn new(hub: Arc<Hub>, asked: Receiver<Asked>, robot: &Robot, speed: f64) -> Self {
        Self {
            hub,
            asked,
            wished: speed,
            can_be_pushed: robot.model == Model::Dynamic,
            began: Instant::now(),
            due: Duration::ZERO,
            pace: PaceMeter::default(),
            clock: 0.0,
            broken: Broken::default(),
            estop: false,
            pushed_until: time::Instant::from_ticks(0),
        }
    }

    /// Does what was asked, and tells how things are if it is time to.
    ///
    /// # Errors
    /// If the simulation cannot go on.
    pub fn attend(&mut self, base: &mut dyn Base) -> Result<()> {
        for Asked {
            client,
            id,
            request,
        } in self.asked.try_iter().take(MAX_AT_ONCE).collect::<Vec<_>>()
        {
            let done = self.perform(request, base);
            self.hub
                .answer(client, id, done.map_err(|error| format!("{error:#}")));
        }
        let now = self.began.elapsed();
        self.pace.note(now, base.now().ticks() as f64 * 1e-6);
        if now >= self.due {
            // What could not be told in time is not told late.
            self.due = (self.due + PERIOD).max(now);
            let told = self.tell(base)?;
            self.hub.tell_world(&told);
        }
        Ok(())
    }

    fn perform(&mut self, request: Request, base: &mut dyn Base) -> Result<()> {
        match request {
            Request::Push([force, torque, seconds]) => {
                ensure!(
                    self.can_be_pushed,
                    "this robot's wheels turn as they are told: nothing pushes it"
                );
                base.push(force, torque, seconds);
                let lasts = time::Duration::from_ticks((seconds * 1e6) as u64);
                self.pushed_until = time::after(base.now(), lasts);
            }
            Request::Fault(fault) => {
                base.inject(fault)?;
                self.broken.note(fault);
            }
            Request::Clear => {
                base.clear_faults()?;
                if self.broken.clear() {
                    self.hub.link_mended();
                }
            }
            Request::Estop(open) => {
                base.set_estop(open)?;
                self.estop = open;
            }
            Request::PowerCycle => base.power_cycle()?,
        }
        Ok(())
    }

    fn tell(&mut self, base: &dyn Base) -> Result<Value> {
        let clock = base.clock()?;
        if clock < self.clock {
            self.broken.restarted();
        }
        self.clock = clock;
        let [x, y, theta] = base.plant().pose();
        Ok(json!({ "world": {
            "t": rounded(clock, 6),
            "x": rounded(x, 6),
            "y": rounded(y, 6),
            "theta": rounded(degrees(theta), 5),
            "pace": rounded(self.pace.rate().unwrap_or(self.wished) / self.wished, 3),
            "broken": self.broken.list(),
            "estop": self.estop,
            "pushed": base.now() < self.pushed_until,
        }}))
    }
}

impl Drop for World {
    /// The simulation ends: who looks on is told.
    fn drop(&mut self) {
        self.hub.close();
        let end = Instant::now() + LEAVE_TAKING;
        while self.hub.is_visited() && Instant::now() < end {
            std::thread::sleep(Duration::from_millis(5));
        }
    }
}

/// An angle in degrees, in (−180, 180].
fn degrees(radians: f64) -> f64 {
    let turned = radians.to_degrees().rem_euclid(360.0);
    if turned > 180.0 {
        turned - 360.0
    } else {
        turned
    }
}

fn rounded(value: f64, decimals: i32) -> f64 {
    let scale = 10_f64.powi(decimals);
    (value * scale).round() / scale
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn angles_are_wrapped_as_in_the_protocol() {
        for (radians, expected) in [
            (0.0, 0.0),
            (PI, 180.0),
            (-PI, 180.0),
            (-0.5 * PI, -90.0),
            (5.0 * PI, 180.0),
            (-4.5 * PI, -90.0),
        ] {
            let degrees = degrees(radians);
            assert!((degrees - expected).abs() < 1e-9, "{radians}: {degrees}");
        }
    }

    #[test]
    fn the_hello_says_what_the_base_is() {
        let of = |name: &str, speed| hello(&Robot::load(name).unwrap(), name, false, speed);
        let default = of("default", 2.0);
        assert_eq!(default["vehicle"], "differential");
        assert_eq!(default["speed"], 2.0);
        assert_eq!(default["push"], true);
        assert_eq!(default["truth"]["wheel_base"], 0.2);
        assert_eq!(default["truth"]["left_diameter"], 0.084);
        let faults = default["faults"].as_array().unwrap();
        assert!(faults.contains(&json!("left motor weak 0.5")), "{faults:?}");
        let ideal = of("ideal", 1.0);
        assert_eq!(ideal["push"], false);
        let car = of("cycab", 1.0);
        assert_eq!(
            (&car["vehicle"], &car["truth"]),
            (&json!("bisteerable"), &Value::Null)
        );
    }
}
