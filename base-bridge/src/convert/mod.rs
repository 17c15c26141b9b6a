//! What the base tells, in the numbers of messages.

pub mod covariance;
pub mod joints;
