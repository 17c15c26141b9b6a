//! Paths made of moves and turns (theory section 8, [C §7]): postures in, commands of the two axes out.
//!
//! At constant v_s the ACCEL, MOVE and DECCEL of a turn are clothoid, arc and clothoid, with the sharpness k = a_α/v_s² and the arc's curvature v_α/v_s. A
//! path is straight legs with such corners between them; nothing here touches an axis but by the commands that anybody may give it.
//!
//! * [`corner`]: one corner, rounded.
//! * [`path`]: postures to legs and corners, with the speeds at which they can be driven.
//! * [`follower`]: where the base is on its path, to what it is to be commanded next.
//! * [`chase`]: the same for a posture that moves.
//! * [`pilot`]: both, on an [`Interface`](crate::controller::Interface).

pub mod chase;
pub mod corner;
pub mod follower;
mod frame;
pub mod limits;
pub mod path;
pub mod pilot;

pub use chase::Chase;
pub use corner::Corner;
pub use follower::{Follower, Order, PathEvent, Progress, Tolerance};
pub use limits::KinematicLimits;
pub use path::{Leg, Passage, Path, PathError, Posture, Vertex};
pub use pilot::{Ending, Errand, Notice, Pilot, Settings, Unable};
