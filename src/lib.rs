//! The standard vehicle controller of Crowley & Reignier (*Asynchronous Control of Rotation and Translation for a Robot Vehicle*, 1992) for robot
//! bases: commands `move`, `turn` and `stop` at any time, each replacing the last; two independent axes; a pose with its covariance, and
//! corrections of both from outside.
//!
//! ```text
//!     bytes ─▶ interpreter ─▶ controller ◀──────── vehicle ◀── encoders (embedded-hal Qei)
//!     reply ◀─ (top)          (middle)   ────────▶ (bottom) ─▶ motors (SetDutyCycle, OutputPin)
//!                              ├ estimator   pose, covariance
//!                              └ two axes    translation, rotation: the same machine twice
//! ```
//!
//! * [`vehicle`]: encoder counts to (ΔS, Δα), (v_s, v_α) to wheel speeds, wheel speeds to duty. Differential drive, synchro drive, tricycle, bi-steerable car.
//! * [`controller`]: odometry and the two axis machines, in terms of a virtual vehicle; the paper's interface procedures.
//! * [`trajectory`]: paths of clothoids, arcs and straight lines, made of nothing but moves and turns; moving targets.
//! * [`interpreter`]: the serial protocol.
//! * [`map`]: places, and the uncertain motions between them.
//! * [`params`]: what a base can be told of itself.
//!
//! Nothing here reads a clock, knows a board, allocates or panics: time comes in as an argument, peripherals through the traits of `embedded-hal`.
//! SI units and radians throughout; degrees exist only in the serial protocol and its parameters.
//!
//! # Example
//!
//! A base on any hardware: two quadrature counters, two PWM channels, two pins. Here they are stand-ins that go nowhere.
//!
//! ```
//! use vehicle_controller::controller::{AxisCommand, Controller, Inputs, Interface};
//! use vehicle_controller::params::Params;
//! use vehicle_controller::time::{Duration, Instant};
//! use vehicle_controller::vehicle::{DifferentialDrive, NoPin, Servo, differential};
//! # use std::convert::Infallible;
//! # struct Counter;
//! # impl embedded_hal_02::Qei for Counter {
//! #     type Count = u16;
//! #     fn count(&self) -> u16 { 0 }
//! #     fn direction(&self) -> embedded_hal_02::Direction { embedded_hal_02::Direction::Upcounting }
//! # }
//! # struct Pwm;
//! # impl embedded_hal::pwm::ErrorType for Pwm { type Error = Infallible; }
//! # impl embedded_hal::pwm::SetDutyCycle for Pwm {
//! #     fn max_duty_cycle(&self) -> u16 { 8400 }
//! #     fn set_duty_cycle(&mut self, _: u16) -> Result<(), Infallible> { Ok(()) }
//! # }
//! # struct Pin;
//! # impl embedded_hal::digital::ErrorType for Pin { type Error = Infallible; }
//! # impl embedded_hal::digital::OutputPin for Pin {
//! #     fn set_low(&mut self) -> Result<(), Infallible> { Ok(()) }
//! #     fn set_high(&mut self) -> Result<(), Infallible> { Ok(()) }
//! # }
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let params = Params::default();
//! let period = Duration::millis(1);
//! let config = params.build::<differential::Config>(period);
//!
//! let left = Servo::new(Pwm, Pin, NoPin, config.vehicle.servo[0])?;
//! let right = Servo::new(Pwm, Pin, NoPin, config.vehicle.servo[1])?;
//! let vehicle = DifferentialDrive::new(Counter, Counter, left, right, &config.vehicle);
//! let mut controller = Controller::new(vehicle, config, None);
//! let mut base = Interface::new(controller.snapshot(), params.limits());
//!
//! // Half a metre ahead at 0.2 m/s. The request is carried out by the next tick.
//! base.move_by(AxisCommand { distance: 0.5, speed: 0.2, acceleration: 0.4 })?;
//! for tick in 0..5 {
//!     if let Some(request) = base.take_request() {
//!         controller.request(request).expect("a tick takes every request");
//!     }
//!     let now = Instant::from_ticks(tick * period.ticks());
//!     let events = controller.tick(now, &Inputs::default());
//!     assert!(events.is_empty());
//!     base.update(controller.snapshot());
//! }
//! assert_eq!(base.snapshot().translation.state.name(), "ACCEL");
//! let estimate = base.get_est_pos();
//! assert_eq!(estimate.pose.x, 0.0);
//! # Ok(())
//! # }
//! ```
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

pub mod controller;
pub mod interpreter;
pub mod map;
pub mod math;
pub mod params;
pub mod supervisor;
pub mod time;
pub mod trajectory;
pub mod vehicle;
