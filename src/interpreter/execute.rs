//! Commands, carried out on a desk; their results as text.

use super::command::{Calibrate, Command, MotionArgs};
use super::error::{Error, refuse, refuse_motion, refuse_param};
use super::keyword::Keyword;
use super::listing::Listing;
use super::storage::Stage;
use super::text::Text;
use super::{Desk, Interpreter, PROTOCOL_VERSION, motion_defaults, reply};
use crate::controller::AxisCommand;
use crate::map::Atlas;
use crate::params::{Blueprint, DEGREES, Id, Kind, Params};

impl Interpreter {
    #[inline(never)]
    pub(super) fn execute<C: Blueprint>(
        &mut self,
        desk: &mut Desk<C>,
        atlas: &mut Atlas,
        command: &Command,
        text: &mut Text,
    ) -> Result<(), Error> {
        match *command {
            Command::Move(args) => {
                let command = complete(self.last_move, args);
                desk.move_by(command)
                    .map_err(|r| refuse_motion(r, 1.0, "m"))?;
                self.last_move = command;
                self.note_given(0, args);
            }
            Command::Turn(args) => {
                let command = complete(self.last_turn, args);
                desk.turn_by(command)
                    .map_err(|r| refuse_motion(r, DEGREES, "deg"))?;
                self.last_turn = command;
                self.note_given(1, args);
            }
            Command::CorrectPos(shift, gain) => desk.correct_pos(shift, &gain).map_err(refuse)?,
            Command::ResetPos(pose, covariance) => {
                desk.reset_pos(pose, &covariance).map_err(refuse)?;
            }
            Command::Observe(observation, age) => {
                let gate = self.params.get(Id::Gate);
                let distance = desk.observe(&observation, age, gate).map_err(refuse)?;
                text.str("Observed").fixed(f64::from(distance), 6);
                return Ok(());
            }
            Command::Stream(period, fields) => self.stream.set(period, fields),
            Command::Help(subject) => {
                reply::help(text, subject);
                return Ok(());
            }
            Command::GetParam(id) | Command::SetParam(id, _)
                if !id.is_of(self.params.vehicle()) =>
            {
                return Err(Error::Unknown);
            }
            Command::GetParam(id) => {
                reply::param(text, &self.params, id);
                return Ok(());
            }
            Command::SetParam(id, value) => {
                self.set_param(desk, id, value)?;
            }
            Command::Calibrate(what) => self.calibrate(desk, what)?,
            Command::Path(command) => self.execute_path(desk, &command)?,
            Command::Map(ref command) => return self.execute_map(desk, atlas, command, text),
            Command::Plain(keyword) => return self.execute_plain(desk, keyword, text),
        }
        text.str("OK");
        Ok(())
    }

    #[inline(never)]
    fn calibrate<C: Blueprint>(
        &mut self,
        desk: &mut Desk<C>,
        what: Calibrate,
    ) -> Result<(), Error> {
        match what {
            Calibrate::Learn(learns) => desk.learn(learns),
            Calibrate::Reset => {
                let mut params = self.params;
                params.unlearn();
                self.take_params(desk, &params, true)?;
            }
            Calibrate::Straight(length) => {
                let gate = self.params.get(Id::Gate);
                desk.calibrate_straight(length, gate).map_err(refuse)?;
            }
        }
        Ok(())
    }

    /// What has been learned, whoever has taught it, is kept with the parameters. A prior that nothing was learned of stays one.
    pub(super) fn note_gains<C: Blueprint>(&mut self, desk: &Desk<C>) {
        let known = desk.calibration();
        if *known != self.params.calibration() {
            self.params.learn(known);
        }
    }

    #[inline(never)]
    fn set_param<C: Blueprint>(
        &mut self,
        desk: &mut Desk<C>,
        id: Id,
        value: f32,
    ) -> Result<(), Error> {
        let mut params = self.params;
        params.set(id, value).map_err(refuse_param)?;
        let kind = id.spec().kind;
        if matches!(kind, Kind::Geometry) && params != self.params {
            // What was learned was learned of another geometry.
            params.doubt_gains();
        }
        let geometry = matches!(kind, Kind::Geometry | Kind::Wiring);
        self.take_params(desk, &params, geometry)
    }

    #[inline(never)]
    pub(super) fn execute_plain<C: Blueprint>(
        &mut self,
        desk: &mut Desk<C>,
        keyword: Keyword,
        text: &mut Text,
    ) -> Result<(), Error> {
        match keyword {
            Keyword::GetEstPos => reply::est_pos(text, &desk.get_est_pos()),
            Keyword::GetEstSpeed => reply::est_speed(text, desk.snapshot()),
            Keyword::GetGains => reply::gains(text, desk.calibration(), &self.params),
            Keyword::GetStatus => reply::status(text, desk.snapshot()),
            Keyword::GetState => reply::state(text, desk.snapshot()),
            Keyword::GetTime => reply::time(text, desk.snapshot()),
            Keyword::GetBattery => reply::battery(text, desk.snapshot()),
            Keyword::GetWheels => reply::wheels(text, desk.snapshot()),
            Keyword::GetSteering => reply::steering(text, desk.snapshot()),
            Keyword::Version => {
                text.str("Version")
                    .word(env!("CARGO_PKG_NAME"))
                    .word(env!("CARGO_PKG_VERSION"))
                    .word(self.identity.target)
                    .integer(i64::from(PROTOCOL_VERSION));
            }
            Keyword::ListParams => {
                text.str("Params").integer(self.params.count() as i64);
                self.listing = Some(Listing::Params(0));
            }
            Keyword::GetPath => self.list_path(text),
            Keyword::SaveParams => return self.send_to_store(Stage::Save, desk),
            Keyword::LoadParams => return self.send_to_store(Stage::Load, desk),
            _ => {
                self.act(desk, keyword)?;
                text.str("OK");
            }
        }
        Ok(())
    }

    /// Commands without parameters that are answered `OK`.
    fn act<C: Blueprint>(&mut self, desk: &mut Desk<C>, keyword: Keyword) -> Result<(), Error> {
        match keyword {
            Keyword::Stop => {
                self.halt = false;
                desk.stop().map_err(refuse)
            }
            Keyword::EStop => {
                desk.emergency_stop();
                Ok(())
            }
            Keyword::ClearFault => desk.clear_fault().map_err(refuse),
            Keyword::Enable => desk.enable().map_err(refuse),
            Keyword::Disable => desk.disable().map_err(refuse),
            Keyword::ResetParams => self.take_params(desk, &{ self.defaults }, true),
            // Those with parameters never come here: they are commands of their own.
            _ => Err(Error::Syntax("unknown command, try Help")),
        }
    }

    pub(super) fn take_params<C: Blueprint>(
        &mut self,
        desk: &mut Desk<C>,
        params: &Params,
        geometry: bool,
    ) -> Result<(), Error> {
        let config = params.build(self.identity.period);
        desk.configure(config, params.limits(), geometry)
            .map_err(refuse)?;
        self.params = *params;
        self.take_motion_defaults();
        Ok(())
    }

    /// v and a that no command has given yet are the parameters'.
    fn take_motion_defaults(&mut self) {
        let axes = [&mut self.last_move, &mut self.last_turn];
        let defaults = motion_defaults(&self.params);
        for ((last, given), default) in axes.into_iter().zip(self.given).zip(defaults) {
            let [speed_given, acceleration_given] = given;
            if !speed_given {
                last.speed = default.speed;
            }
            if !acceleration_given {
                last.acceleration = default.acceleration;
            }
        }
    }

    fn note_given(&mut self, axis: usize, args: MotionArgs) {
        if let Some([speed, acceleration]) = self.given.get_mut(axis) {
            *speed |= args.speed.is_some();
            *acceleration |= args.acceleration.is_some();
        }
    }
}

/// What a command leaves out keeps its last value.
fn complete(last: AxisCommand, args: MotionArgs) -> AxisCommand {
    AxisCommand {
        distance: args.distance.unwrap_or(last.distance),
        speed: args.speed.unwrap_or(last.speed),
        acceleration: args.acceleration.unwrap_or(last.acceleration),
    }
}
