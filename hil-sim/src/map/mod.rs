//! The relational map in simulation: landmarks that are sighted, tours of many places, and pictures of what is known.

pub mod figures;
pub mod landmarks;
pub mod sketch;
pub mod tour;
pub mod walker;
