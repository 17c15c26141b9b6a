//! The paper's interface procedures: what the interpreter calls, and what any code on the same processor may call [C §2, §3].

use super::correction::{self, CorrectionError, Update};
use super::history::{History, MAX_AGE, Past};
use super::{Action, AxisCommand, Config, Estimate, Pose, Request, Snapshot};
use crate::supervisor::Fault;
use crate::time::{self, Duration};
use nalgebra::{Matrix3, RowVector3, SMatrix, SVector, Vector3};

/// The largest speeds and accelerations that a command may ask for, SI and radians.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Limits {
    /// m/s.
    pub speed: f32,
    /// m/s².
    pub acceleration: f32,
    /// rad/s.
    pub turn_speed: f32,
    /// rad/s².
    pub turn_acceleration: f32,
}

/// Why a procedure was refused. Nothing has changed.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Refusal {
    /// The request before is not carried out yet, or a correction not carried through: wait for a snapshot.
    Busy,
    /// A distance is not a number.
    Distance,
    /// A speed is negative, not a number, or above its limit (m/s or rad/s).
    Speed(f32),
    /// An acceleration is not positive or above its limit (m/s² or rad/s²).
    Acceleration(f32),
    /// The age of an observation is negative, not a number or above 1.5 s.
    Age,
    /// An observation is older than what is remembered, so many seconds: since start-up, or since the pose was reset.
    TooOld(f32),
    /// A number is not finite, or beyond any place on earth.
    NotFinite,
    /// A fault is latched, or its cause persists.
    Fault(Fault),
    /// The motors are disabled.
    Disabled,
    /// The vehicle moves.
    Moving,
    /// A correction was not acceptable.
    Correction(CorrectionError),
}

impl core::fmt::Display for Refusal {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Busy => "the request before is not carried out yet",
            Self::Distance => "the distance is not a number",
            Self::Speed(_) => "the speed is out of range",
            Self::Acceleration(_) => "the acceleration is out of range",
            Self::Age | Self::TooOld(_) => "the age is out of range",
            Self::NotFinite => "a number is not finite",
            Self::Fault(_) => "a fault is latched",
            Self::Disabled => "the motors are disabled",
            Self::Moving => "the vehicle moves",
            Self::Correction(_) => "the correction was refused",
        })
    }
}
impl core::error::Error for Refusal {}

impl From<CorrectionError> for Refusal {
    fn from(error: CorrectionError) -> Self {
        Self::Correction(error)
    }
}

/// A measurement of the pose from outside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Observation {
    /// All of it, with its covariance (m², m·rad, rad²).
    Pose {
        /// x, y (m), θ (rad); the innovation's angle is wrapped.
        pose: Pose,
        /// C_o.
        covariance: Matrix3<f64>,
    },
    /// One number that depends on it: innovation ν = z − H P̂ with variance R and row H.
    Scalar {
        /// ν, in the unit of the measurement.
        innovation: f64,
        /// R > 0 or 0, in its square.
        variance: f64,
        /// H, per m, m and rad.
        row: RowVector3<f64>,
    },
}

/// A desk from which the controller is commanded, one to a controller: holds the last snapshot, and hands out one request at a time.
///
/// The glue around it moves [`take_request`](Self::take_request) to [`Controller::request`](super::Controller::request) and
/// [`Controller::snapshot`](super::Controller::snapshot) to [`update`](Self::update); the two may live at different priorities.
#[derive(Clone, Debug)]
pub struct Interface<C> {
    snapshot: Snapshot,
    limits: Limits,
    request: Option<Action<C>>,
    sent: u32,
    /// A sign of life waits to be handed over.
    alive: bool,
    /// An emergency stop waits to be handed over.
    emergency: bool,
    emergencies_sent: u32,
    history: History,
    /// What GetEstPos last answered: clients compute their gains from it.
    answered: Option<Past>,
}

impl<C> Interface<C> {
    /// A desk for the controller that gave `snapshot`.
    #[must_use]
    pub fn new(snapshot: Snapshot, limits: Limits) -> Self {
        Self {
            snapshot,
            limits,
            request: None,
            sent: snapshot.ticket,
            alive: false,
            emergency: false,
            emergencies_sent: snapshot.emergency_ticket,
            history: History::default(),
            answered: None,
        }
    }

    /// Takes the state after a tick over, and does a piece of [`work`](Self::work).
    pub fn update(&mut self, snapshot: Snapshot) {
        self.work();
        if snapshot.time < self.snapshot.time {
            // The clock was set back: the past has no place in its time any more.
            self.history.clear();
            self.answered = None;
        }
        self.snapshot = snapshot;
        // While a request is under way, snapshots may not show its correction yet, and the past already does.
        if self.is_idle() {
            self.history
                .record(snapshot.time, || snapshot.estimator.present());
        }
    }

    /// The last snapshot.
    pub fn snapshot(&self) -> &Snapshot {
        &self.snapshot
    }

    /// The request that waits to be handed to the controller; an emergency stop comes first.
    pub fn take_request(&mut self) -> Option<Request<C>> {
        if core::mem::take(&mut self.emergency) {
            return Some(Request {
                action: Action::EStop,
                ticket: Some(self.emergencies_sent),
            });
        }
        // Every request is a sign of life.
        let alive = core::mem::take(&mut self.alive);
        match self.request.take() {
            Some(action) => Some(Request {
                action,
                ticket: Some(self.sent),
            }),
            None => alive.then(|| Action::Live.into()),
        }
    }

    /// Whoever commands the base is there, whatever there is to say: a motion without an end needs this, or any request, every `deadman` seconds.
    pub fn sign_of_life(&mut self) {
        self.alive = true;
    }

    /// Does a piece of what is left to do after a correction; false if nothing is. Call it whenever there is time: corrections are taken again when all
    /// is done.
    pub fn work(&mut self) -> bool {
        self.history.work()
    }

    /// True if a correction would be taken: the one before has gone through all that is remembered.
    pub fn takes_corrections(&self) -> bool {
        self.history.is_consistent()
    }

    /// True if every request has been carried out and the snapshot shows it.
    pub fn is_idle(&self) -> bool {
        self.snapshot.ticket == self.sent && self.snapshot.emergency_ticket == self.emergencies_sent
    }

    /// `move`: translate by `distance` (m, signed, may be infinite) at `speed` with `acceleration`; speed 0 stops this axis alone.
    ///
    /// # Errors
    /// [`Refusal`] if a number is out of range, a fault is latched or the motors are disabled.
    pub fn move_by(&mut self, command: AxisCommand) -> Result<(), Refusal> {
        let (speed, acceleration) = (self.limits.speed, self.limits.acceleration);
        self.check_motion(&command, speed, acceleration)?;
        self.send(Action::Move(command))
    }

    /// `turn`: rotate by `distance` (rad, signed, may be infinite) at `speed` with `acceleration`; speed 0 stops this axis alone.
    ///
    /// # Errors
    /// [`Refusal`] if a number is out of range, a fault is latched or the motors are disabled.
    pub fn turn_by(&mut self, command: AxisCommand) -> Result<(), Refusal> {
        let (speed, acceleration) = (self.limits.turn_speed, self.limits.turn_acceleration);
        self.check_motion(&command, speed, acceleration)?;
        self.send(Action::Turn(command))
    }

    /// `Stop`: both axes decelerate and hold. Replaces a move or turn that has not been handed over yet.
    ///
    /// # Errors
    /// [`Refusal::Busy`] only.
    pub fn stop(&mut self) -> Result<(), Refusal> {
        if let Some(Action::Move(_) | Action::Turn(_)) = self.request {
            self.request = Some(Action::Stop);
            return Ok(());
        }
        self.send(Action::Stop)
    }

    /// Motors off at once; the fault `estop` is latched. Always accepted, and overtakes a request that waits; one that would move the base, or let
    /// it, is dropped.
    pub fn emergency_stop(&mut self) {
        if let Some(action) = &mut self.request
            && action.may_move()
        {
            *action = Action::Live;
        }
        self.emergency = true;
        self.emergencies_sent = self.emergencies_sent.wrapping_add(1);
    }

    /// Clears a latched fault. Nothing moves by it.
    ///
    /// # Errors
    /// [`Refusal::Fault`] while the cause persists.
    pub fn clear_fault(&mut self) -> Result<(), Refusal> {
        match self.snapshot.fault {
            Some(fault) if self.snapshot.fault_persists => Err(Refusal::Fault(fault)),
            _ => self.send(Action::ClearFault),
        }
    }

    /// Motor power on.
    ///
    /// # Errors
    /// [`Refusal::Busy`] only.
    pub fn enable(&mut self) -> Result<(), Refusal> {
        self.send(Action::Enable)
    }

    /// Stops, then switches motor power off.
    ///
    /// # Errors
    /// [`Refusal::Busy`] only.
    pub fn disable(&mut self) -> Result<(), Refusal> {
        self.send(Action::Disable)
    }

    /// `GetEstPos`: the estimate as of the last tick. A CorrectPos within 1.5 s refers to it.
    pub fn get_est_pos(&mut self) -> Estimate {
        let past = self.present();
        // An estimate that a request under way is about to change is no ground for a correction.
        if self.is_idle() {
            self.answered = Some(past);
        }
        past.estimate
    }

    /// `CorrectPos`: P := P + K ΔP, C := C − K C, with respect to what [`get_est_pos`](Self::get_est_pos) last answered; carried to now.
    /// `shift` is ΔP in m, m, rad; `gain` is K.
    ///
    /// # Errors
    /// [`Refusal::Correction`] if the covariance would not stay symmetric positive semi-definite; [`Refusal::Busy`] unless
    /// [`takes_corrections`](Self::takes_corrections).
    pub fn correct_pos(&mut self, shift: Vector3<f64>, gain: &Matrix3<f64>) -> Result<(), Refusal> {
        let present = self.present();
        let then = self
            .answered
            .filter(|past| time::since(present.time, past.time) <= MAX_AGE)
            .unwrap_or(present);
        let update = correction::with_gain(&then.estimate, shift, gain)?;
        self.correct(&update, then, present)
    }

    /// Corrects by an observation that is `age` seconds old (0 to 1.5). Returns the squared Mahalanobis distance of its innovation.
    ///
    /// # Errors
    /// [`Refusal::Age`], or [`Refusal::Correction`] if the observation is beyond `gate` (0: no gate) or its covariance is none; [`Refusal::Busy`]
    /// unless [`takes_corrections`](Self::takes_corrections).
    pub fn observe(
        &mut self,
        observation: &Observation,
        age: f32,
        gate: f32,
    ) -> Result<f32, Refusal> {
        let max_age = time::seconds(MAX_AGE);
        if !(0.0..=max_age).contains(&age) {
            return Err(Refusal::Age);
        }
        if !self.takes_corrections() {
            return Err(Refusal::Busy);
        }
        let present = self.present();
        let age = Duration::from_ticks((age * 1e6) as u64);
        let then = if age.ticks() == 0 {
            present
        } else {
            self.history
                .at(time::before(present.time, age), present)
                .ok_or(Refusal::TooOld(time::seconds(
                    self.history.reach(present.time),
                )))?
        };
        let gate = f64::from(gate);
        let (update, distance) = match observation {
            Observation::Pose { pose, covariance } => {
                let covariance = crate::math::symmetric(covariance, covariance)
                    .map_err(|_| CorrectionError::NotPositive)?;
                let innovation = correction::pose_innovation(pose, &then.estimate.pose);
                let h = SMatrix::<f64, 3, 3>::identity();
                correction::observe(&then.estimate, innovation, &covariance, &h, gate)?
            }
            Observation::Scalar {
                innovation,
                variance,
                row,
            } => correction::observe(
                &then.estimate,
                SVector::<f64, 1>::new(*innovation),
                &SMatrix::<f64, 1, 1>::new(*variance),
                row,
                gate,
            )?,
        };
        self.correct(&update, then, present)?;
        Ok(distance)
    }

    /// `ResetPos`: sets pose and covariance, and forgets the past.
    ///
    /// # Errors
    /// [`Refusal::NotFinite`], or [`Refusal::Correction`] if the covariance is not symmetric positive semi-definite.
    pub fn reset_pos(&mut self, pose: Pose, covariance: &Matrix3<f64>) -> Result<(), Refusal> {
        let symmetric = crate::math::symmetric(covariance, covariance)
            .map_err(|_| CorrectionError::NotPositive)?;
        let covariance =
            crate::math::written_covariance(&symmetric).map_err(CorrectionError::from)?;
        let after = Estimate { pose, covariance };
        if !after.is_plausible() {
            return Err(Refusal::NotFinite);
        }
        let correction = self.snapshot.estimator.correction(after);
        self.send(Action::Correct(correction))?;
        self.history.clear();
        self.answered = None;
        Ok(())
    }

    /// Hands new parameters over. `geometry` says that they change what an encoder count means.
    ///
    /// # Errors
    /// [`Refusal::Moving`] if the geometry changes while the vehicle moves.
    pub fn configure(
        &mut self,
        config: Config<C>,
        limits: Limits,
        geometry: bool,
    ) -> Result<(), Refusal> {
        if geometry && self.snapshot.is_moving() {
            return Err(Refusal::Moving);
        }
        self.send(Action::Configure(config))?;
        self.limits = limits;
        Ok(())
    }

    fn present(&self) -> Past {
        Past {
            time: self.snapshot.time,
            estimate: self.snapshot.estimator.present(),
        }
    }

    fn correct(&mut self, update: &Update, then: Past, present: Past) -> Result<(), Refusal> {
        if !self.takes_corrections() {
            return Err(Refusal::Busy);
        }
        let after = update.carried_to_later(&present.estimate);
        if !after.is_plausible() {
            return Err(CorrectionError::NotFinite.into());
        }
        let correction = self.snapshot.estimator.correction(after);
        self.send(Action::Correct(correction))?;
        self.history.correct(update, then.time);
        if let Some(answered) = &mut self.answered {
            answered.correct(update, then.time);
        }
        Ok(())
    }

    fn check_motion(
        &self,
        command: &AxisCommand,
        max_speed: f32,
        max_acceleration: f32,
    ) -> Result<(), Refusal> {
        if command.distance.is_nan() {
            return Err(Refusal::Distance);
        }
        if !(0.0..=max_speed).contains(&command.speed) {
            return Err(Refusal::Speed(max_speed));
        }
        if !(command.acceleration > 0.0 && command.acceleration <= max_acceleration) {
            return Err(Refusal::Acceleration(max_acceleration));
        }
        if let Some(fault) = self.snapshot.fault {
            return Err(Refusal::Fault(fault));
        }
        if !self.snapshot.enabled {
            return Err(Refusal::Disabled);
        }
        Ok(())
    }

    fn send(&mut self, action: Action<C>) -> Result<(), Refusal> {
        if self.request.is_some() || !self.is_idle() {
            return Err(Refusal::Busy);
        }
        self.request = Some(action);
        self.sent = self.sent.wrapping_add(1);
        Ok(())
    }
}
