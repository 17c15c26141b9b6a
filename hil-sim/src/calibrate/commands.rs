//! What was learned, as lines for the serial port of a base that is to know it.

use vehicle_controller::params::{Id, Params};

/// `SetParam` lines of the gains: they replace whatever gains are in force. The base must stand.
#[must_use]
pub fn set_gains(params: &Params) -> String {
    let gains = params.gains().into_iter().flatten();
    gains.map(|id| set(params, id)).collect()
}

/// `SetParam` lines of the gains and of how well they are known, and `SaveParams`: for a base whose other parameters are these. The gains come first: another
/// gain makes a base doubt what it has learned.
#[must_use]
pub fn set_calibration(params: &Params) -> String {
    let vehicle = params.vehicle();
    let spread = Params::spread().into_iter().filter(|id| id.is_of(vehicle));
    let spread: String = spread.map(|id| set(params, id)).collect();
    set_gains(params) + &spread + "SaveParams\n"
}

/// With as few digits as read back to the same number.
fn set(params: &Params, id: Id) -> String {
    format!("SetParam {} {}\n", id.spec().name, params.get(id))
}
