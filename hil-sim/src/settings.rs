//! Settings of parameters on the command line: `name=value`.

use crate::robot::describe;
use anyhow::{Result, anyhow};
use vehicle_controller::params::{Id, Params};

/// Sets parameters in the order in which they are given.
///
/// # Errors
/// With the setting's text, if it is not `name=value`, or not of a parameter, or beyond its range.
pub fn apply(params: &mut Params, settings: &[String]) -> Result<()> {
    for setting in settings {
        let (name, value) = setting
            .split_once('=')
            .ok_or_else(|| anyhow!("--set {setting}: write name=value"))?;
        let id = Id::find(name.trim().as_bytes())
            .filter(|id| id.is_of(params.vehicle()))
            .ok_or_else(|| anyhow!("--set {setting}: no parameter `{name}`"))?;
        let value: f32 = value
            .trim()
            .parse()
            .map_err(|_| anyhow!("--set {setting}: `{value}` is not a number"))?;
        params
            .set(id, value)
            .map_err(|error| anyhow!("--set {setting}: {}", describe(error)))?;
    }
    Ok(())
}
