//! Robots: what they truly are, and what their controller believes of them. One TOML file each.

use crate::motor_controller::ControllerParams;
use crate::plant::{Chassis, Physics};
use anyhow::{Context, Result, anyhow, bail, ensure};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::Path;
use toml::Spanned;
use vehicle_controller::params::{Id, ParamError, Params};
use vehicle_controller::vehicle::Kind;

/// The robots that come with the simulator: name and file.
const PRESETS: [(&str, &str); 9] = [
    ("default", include_str!("../robots/default.toml")),
    ("uncalibrated", include_str!("../robots/uncalibrated.toml")),
    ("ideal", include_str!("../robots/ideal.toml")),
    ("robuter", include_str!("../robots/robuter.toml")),
    ("increments", include_str!("../robots/increments.toml")),
    ("synchro", include_str!("../robots/synchro.toml")),
    ("tricycle", include_str!("../robots/tricycle.toml")),
    ("cycab", include_str!("../robots/cycab.toml")),
    (
        "cycab-uncalibrated",
        include_str!("../robots/cycab-uncalibrated.toml"),
    ),
];

/// How the wheels follow their commands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Model {
    /// Motors, gears and tyres.
    Dynamic,
    /// Exactly.
    Ideal,
}

/// What the board has between itself and the motors.
#[derive(Clone, Debug, PartialEq)]
pub enum Drives {
    /// Bridges, which the board's own servos drive.
    Bridge,
    /// Motor controllers that take speeds.
    Speed(ControllerParams),
    /// Motor controllers that take position increments.
    Increment(ControllerParams),
}

/// The same, as a file says it.
#[derive(Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
enum DriveName {
    #[default]
    Bridge,
    Speed,
    Increment,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    description: String,
    model: Model,
    #[serde(default)]
    drive: DriveName,
    controller: Option<ControllerParams>,
    counter_bits: Spanned<u32>,
    physics: Physics,
    #[serde(default)]
    parameters: BTreeMap<String, Spanned<f64>>,
}

/// A robot.
#[derive(Clone, Debug)]
pub struct Robot {
    /// What it is, in a line.
    pub description: String,
    /// How the wheels follow.
    pub model: Model,
    /// What drives the motors of a dynamic one.
    pub drives: Drives,
    /// Encoder counters have 16 bits, not 32.
    pub narrow_counters: bool,
    /// What it truly is.
    pub physics: Physics,
    /// What its controller believes.
    pub params: Params,
}

impl Robot {
    /// A robot by the name of a preset, or by the path of its file.
    ///
    /// # Errors
    /// With file and line, if there is no such robot or its file is wrong.
    pub fn load(name: &str) -> Result<Self> {
        if let Some((_, text)) = PRESETS.iter().find(|(preset, _)| *preset == name) {
            return Self::parse(text, name);
        }
        let path = Path::new(name);
        if path.extension().is_none() {
            let known: Vec<_> = PRESETS.iter().map(|(name, _)| *name).collect();
            bail!(
                "no robot `{name}`: there are {}, or give the path of a .toml file",
                known.join(", ")
            );
        }
        let text = std::fs::read_to_string(path).with_context(|| name.to_owned())?;
        Self::parse(&text, name)
    }

    /// Nothing, for a differential drive.
    ///
    /// # Errors
    /// That `what` is for differential drives only, for another vehicle.
    pub fn ensure_differential(&self, what: &str) -> Result<()> {
        ensure!(
            self.params.vehicle() == Kind::Differential,
            "{what} is for differential drives; this robot is a {}",
            match self.params.vehicle() {
                Kind::Differential => "differential drive",
                Kind::Synchro => "synchro drive",
                Kind::Tricycle => "tricycle",
                Kind::BiSteerable => "car",
            }
        );
        Ok(())
    }

    /// The names of the presets.
    pub fn presets() -> impl Iterator<Item = &'static str> {
        PRESETS.iter().map(|(name, _)| *name)
    }

    /// Reads a robot from its file's text; `name` is for messages.
    ///
    /// # Errors
    /// With `name` and line, if the text is wrong.
    pub fn parse(text: &str, name: &str) -> Result<Self> {
        let line = |offset: usize| text[..offset].matches('\n').count() + 1;
        let file: File = toml::from_str(text).map_err(|error| {
            let at = error.span().map_or(1, |span| line(span.start));
            anyhow!("{name}:{at}: {}", error.message())
        })?;
        let bits = *file.counter_bits.get_ref();
        if bits != 16 && bits != 32 {
            let at = line(file.counter_bits.span().start);
            bail!("{name}:{at}: counter_bits must be 16 or 32, not {bits}");
        }
        file.physics.validate().map_err(|error| {
            // The message begins with the key, as section.key.
            let key = error.split_whitespace().next().unwrap_or_default();
            let at = place(text, &format!("physics.{key}")).map_or(1, line);
            anyhow!("{name}:{at}: {error}")
        })?;
        let drives = drives(file.model, file.drive, file.controller).map_err(|(key, error)| {
            let at = place(text, key).map_or(1, line);
            anyhow!("{name}:{at}: {error}")
        })?;
        let vehicle = match file.physics.chassis {
            Chassis::Differential => Kind::Differential,
            Chassis::Synchro(_) => Kind::Synchro,
            Chassis::Tricycle(_) => Kind::Tricycle,
            Chassis::Bisteerable(_) => Kind::BiSteerable,
        };
        let mut values = Vec::new();
        let mut lines = BTreeMap::new();
        for (key, value) in &file.parameters {
            let at = line(value.span().start);
            let id = Id::find(key.as_bytes()).filter(|id| id.is_of(vehicle));
            let Some(id) = id else {
                bail!("{name}:{at}: no parameter `{key}`");
            };
            lines.insert(id.spec().name, at);
            values.push((id, *value.get_ref() as f32));
        }
        let mut params = Params::of(vehicle);
        params.set_all(&values).map_err(|error| {
            let (ParamError::Range(id) | ParamError::Conflict(id, _)) = error;
            let at = lines.get(id.spec().name).copied().unwrap_or(1);
            anyhow!("{name}:{at}: {}", describe(error))
        })?;
        Ok(Self {
            description: file.description,
            model: file.model,
            drives,
            narrow_counters: bits == 16,
            physics: file.physics,
            params,
        })
    }
}

/// What drives the motors; otherwise the key that is wrong, and how.
fn drives(
    model: Model,
    drive: DriveName,
    controller: Option<ControllerParams>,
) -> Result<Drives, (&'static str, String)> {
    let controller = match (drive, controller) {
        (DriveName::Bridge, None) => return Ok(Drives::Bridge),
        (DriveName::Bridge, Some(_)) => {
            let error =
                "a bridge has no controller of its own: drive is \"speed\" or \"increment\"";
            return Err(("controller", error.to_owned()));
        }
        (_, None) => {
            let error = "a motor controller needs its section [controller]";
            return Err(("drive", error.to_owned()));
        }
        (_, Some(_)) if model == Model::Ideal => {
            let error = "the wheels of an ideal robot turn as they are told: it has no motors";
            return Err(("drive", error.to_owned()));
        }
        (_, Some(controller)) => controller,
    };
    if let Err(error) = controller.validate() {
        return Err(("controller", format!("controller.{error}")));
    }
    Ok(if drive == DriveName::Speed {
        Drives::Speed(controller)
    } else {
        Drives::Increment(controller)
    })
}

/// Where the value of a dotted key begins.
fn place(text: &str, key: &str) -> Option<usize> {
    let document = toml::de::DeTable::parse(text).ok()?;
    let mut keys = key.split('.');
    let mut value = document.get_ref().get(keys.next()?)?;
    for key in keys {
        value = value.get_ref().get(key)?;
    }
    Some(value.span().start)
}

/// A parameter error with the range.
pub fn describe(error: ParamError) -> String {
    match error {
        ParamError::Range(id) => {
            let spec = id.spec();
            format!(
                "{} must be {} to {} {}",
                spec.name, spec.min, spec.max, spec.unit
            )
        }
        ParamError::Conflict(..) => error.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn presets_load() {
        for name in Robot::presets() {
            Robot::load(name).unwrap();
        }
    }

    #[test]
    fn motor_controllers_come_with_their_section_and_with_motors() {
        let preset = |name: &str| PRESETS.iter().find(|preset| preset.0 == name).unwrap().1;
        let (bridge, increments) = (preset("default"), preset("increments"));
        let dynamic = "model = \"dynamic\"";
        for (text, from, to, message) in [
            (
                bridge,
                dynamic,
                "model = \"dynamic\"\ndrive = \"speed\"",
                ":6: a motor controller needs its section [controller]",
            ),
            (
                increments,
                "drive = \"increment\"",
                "",
                ": a bridge has no controller of its own",
            ),
            (
                increments,
                dynamic,
                "model = \"ideal\"",
                ": the wheels of an ideal robot turn as they are told",
            ),
            (
                increments,
                "timeout = 0.1",
                "timeout = 0.0",
                ": controller.timeout = 0 must be positive and finite",
            ),
            (
                increments,
                "timeout = 0.1",
                "time = 0.1",
                ": unknown field `time`",
            ),
            (
                increments,
                "drive = \"increment\"",
                "drive = \"torque\"",
                ": unknown variant `torque`",
            ),
        ] {
            assert!(text.contains(from), "{from}");
            let error = Robot::parse(&text.replacen(from, to, 1), "r.toml").unwrap_err();
            assert!(error.to_string().contains(message), "{error}");
        }
        let speed = increments.replacen("\"increment\"", "\"speed\"", 1);
        let speed = Robot::parse(&speed, "r.toml").unwrap();
        assert!(matches!(speed.drives, Drives::Speed(_)));
    }

    #[test]
    fn mistakes_are_told_with_their_line() {
        let good = PRESETS[0].1;
        let line = 1 + good[..good.find("wheel_base").unwrap()]
            .matches('\n')
            .count();
        for (wrong, message) in [
            ("wheel_bass = 0.2", "no parameter `wheel_bass`"),
            ("wheel_base = -1.0", "wheel_base must be 0.02 to 5 m"),
            ("wheel_base = \"a\"", "invalid type"),
        ] {
            let text = good.replacen("wheel_base = 0.2", wrong, 1);
            let error = Robot::parse(&text, "r.toml").unwrap_err().to_string();
            assert!(error.starts_with(&format!("r.toml:{line}: ")), "{error}");
            assert!(error.contains(message), "{error}");
        }
        assert!(
            Robot::load("nobody")
                .unwrap_err()
                .to_string()
                .contains("uncalibrated")
        );
    }
}
