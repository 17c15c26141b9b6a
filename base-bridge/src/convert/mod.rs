//! What the base tells, in the numbers of messages, and messages as what the bridge is asked.

pub mod covariance;
pub mod joints;
pub mod messages;
