//! The paper's interface procedures: what the interpreter calls, and what any code on the same processor may call [C §2, §3].

use super::correction::{self, CorrectionError, Terms, Update};
use super::history::{History, MAX_AGE, Past};
use super::{
    Action, AxisCommand, Belief, Config, Estimate, Pose, Refusal, Request, Snapshot, State,
};
use crate::time::{self, Duration, Instant};
use crate::vehicle::Calibration;
use nalgebra::{Matrix3, RowVector3, Vector3};

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
    /// The vehicle turns without moving, too.
    pub turns_in_place: bool,
}

/// A procedure that decides where the vehicle goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Procedure {
    /// `move`.
    Move,
    /// `turn`.
    Turn,
    /// `Stop` or `Disable`.
    Stop,
    /// An emergency stop.
    EmergencyStop,
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
    /// What is known of the gains; a correction under way is in it.
    calibration: Calibration,
    learns: bool,
    /// ΔS at the last move command, m.
    run_from: Option<f64>,
    /// The last motion that was asked for, until somebody takes note of it.
    asked: Option<Procedure>,
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
            calibration: *snapshot.estimator.calibration(),
            learns: false,
            run_from: None,
            asked: None,
        }
    }

    /// The largest speeds and accelerations that a command may ask for.
    pub fn limits(&self) -> &Limits {
        &self.limits
    }

    /// The last motion that was asked for since this was called last. Whoever commands the base over a longer time sees by it that somebody else does, too.
    pub fn take_asked(&mut self) -> Option<Procedure> {
        self.asked.take()
    }

    /// Whether the vehicle may be set in motion.
    ///
    /// # Errors
    /// [`Refusal::Fault`] or [`Refusal::Disabled`].
    pub fn may_move(&self) -> Result<(), Refusal> {
        if let Some(fault) = self.snapshot.fault {
            return Err(Refusal::Fault(fault));
        }
        if !self.snapshot.enabled {
            return Err(Refusal::Disabled);
        }
        Ok(())
    }

    /// What is known of the gains.
    pub fn calibration(&self) -> &Calibration {
        &self.calibration
    }

    /// True while observations correct the gains, too.
    pub fn learns(&self) -> bool {
        self.learns
    }

    /// From here on observations correct the gains, or only consider them: what is not known of them is a part of the pose's covariance in either case.
    pub fn learn(&mut self, learns: bool) {
        self.learns = learns;
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
                .record(snapshot.time, || snapshot.estimator.belief());
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
    #[inline(never)]
    pub fn move_by(&mut self, command: AxisCommand) -> Result<(), Refusal> {
        let (speed, acceleration) = (self.limits.speed, self.limits.acceleration);
        self.check_motion(&command, speed, acceleration)?;
        self.send(Action::Move(command))?;
        self.asked = Some(Procedure::Move);
        self.run_from = Some(self.snapshot.estimator.travelled());
        Ok(())
    }

    /// `turn`: rotate by `distance` (rad, signed, may be infinite) at `speed` with `acceleration`; speed 0 stops this axis alone.
    ///
    /// # Errors
    /// [`Refusal`] if a number is out of range, a fault is latched or the motors are disabled; [`Refusal::Standing`] if the vehicle turns only while it
    /// moves, and stands.
    #[inline(never)]
    pub fn turn_by(&mut self, command: AxisCommand) -> Result<(), Refusal> {
        let (speed, acceleration) = (self.limits.turn_speed, self.limits.turn_acceleration);
        self.check_motion(&command, speed, acceleration)?;
        let stands = self.snapshot.translation.state == State::Hold;
        if stands && !self.limits.turns_in_place && command.speed > 0.0 {
            return Err(Refusal::Standing);
        }
        self.send(Action::Turn(command))?;
        self.asked = Some(Procedure::Turn);
        Ok(())
    }

    /// `Stop`: both axes decelerate and hold. Replaces a move or turn that has not been handed over yet.
    ///
    /// # Errors
    /// [`Refusal::Busy`] only.
    pub fn stop(&mut self) -> Result<(), Refusal> {
        if let Some(Action::Move(_) | Action::Turn(_)) = self.request {
            self.request = Some(Action::Stop);
        } else {
            self.send(Action::Stop)?;
        }
        self.asked = Some(Procedure::Stop);
        Ok(())
    }

    /// Motors off at once; the fault `estop` is latched. Always accepted, and overtakes a request that waits; one that would move the base, or let
    /// it, is dropped.
    pub fn emergency_stop(&mut self) {
        self.asked = Some(Procedure::EmergencyStop);
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
        self.send(Action::Disable)?;
        self.asked = Some(Procedure::Stop);
        Ok(())
    }

    /// `GetEstPos`: the estimate as of the last tick. A CorrectPos within 1.5 s refers to it.
    pub fn get_est_pos(&mut self) -> Estimate {
        let past = self.present();
        // An estimate that a request under way is about to change is no ground for a correction.
        if self.is_idle() {
            self.answered = Some(past);
        }
        past.belief.estimate(&self.calibration.spread)
    }

    /// `CorrectPos`: P := P + K ΔP, C := C − K C, with respect to what [`get_est_pos`](Self::get_est_pos) last answered; carried to now.
    /// `shift` is ΔP in m, m, rad; `gain` is K.
    ///
    /// # Errors
    /// [`Refusal::Correction`] if the covariance would not stay symmetric positive semi-definite; [`Refusal::Busy`] unless
    /// [`takes_corrections`](Self::takes_corrections).
    #[inline(never)]
    pub fn correct_pos(&mut self, shift: Vector3<f64>, gain: &Matrix3<f64>) -> Result<(), Refusal> {
        let then = match &self.answered {
            Some(past) if time::since(self.snapshot.time, past.time) <= MAX_AGE => *past,
            _ => self.present(),
        };
        let mut update = Update::none(&then.belief, &self.calibration.spread);
        update.by_gain(&shift, gain)?;
        self.correct(&update, then.time, false)
    }

    /// Corrects by an observation that is `age` seconds old (0 to 1.5). Returns the squared Mahalanobis distance of its innovation.
    ///
    /// # Errors
    /// [`Refusal::Age`], or [`Refusal::Correction`] if the observation is beyond `gate` (0: no gate) or its covariance is none; [`Refusal::Busy`]
    /// unless [`takes_corrections`](Self::takes_corrections).
    #[inline(never)]
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
        let then = self.then(Duration::from_ticks((age * 1e6) as u64))?;
        let terms = Terms {
            gate: f64::from(gate),
            learns: self.learns,
        };
        let mut update = Update::none(&then.belief, &self.calibration.spread);
        let distance = match observation {
            Observation::Pose { pose, covariance } => {
                let covariance = crate::math::symmetric(covariance, covariance)
                    .map_err(|_| CorrectionError::NotPositive)?;
                let innovation = correction::pose_innovation(pose, &then.belief.pose);
                update.by_pose(&innovation, &covariance, terms)?
            }
            Observation::Scalar {
                innovation,
                variance,
                row,
            } => update.by_number(*innovation, *variance, &row.transpose(), terms)?,
        };
        self.correct(&update, then.time, self.learns)?;
        Ok(distance)
    }

    #[inline(never)]
    fn then(&self, age: Duration) -> Result<Past, Refusal> {
        let present = self.present();
        if age.ticks() == 0 {
            return Ok(present);
        }
        self.history
            .at(time::before(present.time, age), &present)
            .ok_or_else(|| Refusal::TooOld(time::seconds(self.history.reach(present.time))))
    }

    /// Takes the last move for one of `length` m, measured from outside, along a straight line: that tells what the gains of the wheels have in common,
    /// k_d [H eq. 10]. Returns the squared Mahalanobis distance of what it was longer. A move is good for one measurement.
    ///
    /// # Errors
    /// [`Refusal::Moving`] until it has ended; [`Refusal::Run`] if it was shorter than 0.1 m, or the gains have changed since it began;
    /// [`Refusal::Correction`] if the measurement is beyond `gate` (0: no gate), or a gain would be beyond reason; [`Refusal::Busy`] unless
    /// [`takes_corrections`](Self::takes_corrections).
    #[inline(never)]
    pub fn calibrate_straight(&mut self, length: f64, gate: f32) -> Result<f32, Refusal> {
        if self.snapshot.is_moving() {
            return Err(Refusal::Moving);
        }
        let estimator = &self.snapshot.estimator;
        let travelled = match self.run_from {
            Some(start) => (estimator.travelled() - start).abs(),
            None => 0.0,
        };
        if travelled.is_nan() || travelled < 0.1 {
            return Err(Refusal::Run);
        }
        let run = estimator.straight(travelled as f32);
        let mut update = Update::none(&self.present().belief, &self.calibration.spread);
        let distance = update.by_run(run, length - travelled, f64::from(gate))?;
        self.correct(&update, self.snapshot.time, true)?;
        Ok(distance)
    }

    /// `ResetPos`: sets pose and covariance, and forgets the past.
    ///
    /// # Errors
    /// [`Refusal::NotFinite`], or [`Refusal::Correction`] if the covariance is not symmetric positive semi-definite.
    #[inline(never)]
    pub fn reset_pos(&mut self, pose: Pose, covariance: &Matrix3<f64>) -> Result<(), Refusal> {
        let symmetric = crate::math::symmetric(covariance, covariance)
            .map_err(|_| CorrectionError::NotPositive)?;
        let covariance =
            crate::math::written_covariance(&symmetric).map_err(CorrectionError::from)?;
        let after = Estimate { pose, covariance };
        if !after.is_plausible() {
            return Err(Refusal::NotFinite);
        }
        let correction = self
            .snapshot
            .estimator
            .correction(&Belief::from(after), self.calibration);
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
        mut config: Config<C>,
        limits: Limits,
        geometry: bool,
    ) -> Result<(), Refusal> {
        if geometry && self.snapshot.is_moving() {
            return Err(Refusal::Moving);
        }
        config.anew = geometry;
        let calibration = config.calibration;
        self.send(Action::Configure(config))?;
        self.limits = limits;
        if geometry || !calibration.is_same(&self.calibration) {
            self.run_from = None;
            self.history.absorb(&self.calibration.spread);
            if let Some(answered) = &mut self.answered {
                answered.belief.absorb(&self.calibration.spread);
            }
            self.calibration = calibration;
        }
        Ok(())
    }

    #[inline(never)]
    fn present(&self) -> Past {
        Past {
            time: self.snapshot.time,
            belief: self.snapshot.estimator.belief(),
        }
    }

    #[inline(never)]
    fn correct(&mut self, update: &Update, at: Instant, learns: bool) -> Result<(), Refusal> {
        if !self.takes_corrections() {
            return Err(Refusal::Busy);
        }
        let mut after = self.snapshot.estimator.belief();
        update.carry_to_later(&mut after);
        let mut calibration = self.calibration;
        if learns {
            let (change, spread) = update.gains();
            for (gain, change) in calibration.gains.iter_mut().zip(&change) {
                *gain = (f64::from(*gain) + change) as f32;
            }
            calibration.spread = spread;
            if !calibration.is_plausible() {
                return Err(CorrectionError::Gains.into());
            }
        }
        if !after.estimate(&calibration.spread).is_plausible() {
            return Err(CorrectionError::NotFinite.into());
        }
        let correction = self.snapshot.estimator.correction(&after, calibration);
        self.send(Action::Correct(correction))?;
        if learns {
            // The run was counted with other gains.
            self.run_from = None;
        }
        self.calibration = calibration;
        self.history.correct(update, at);
        if let Some(answered) = &mut self.answered {
            answered.correct(update, at);
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
        self.may_move()
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
