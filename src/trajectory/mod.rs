//! Paths made of moves and turns (theory section 8, [C §7]): postures in, commands of the two axes out.
//!
//! At constant v_s the ACCEL, MOVE and DECCEL of a turn are clothoid, arc and clothoid, with the sharpness k = a_α/v_s² and the arc's curvature v_α/v_s. A
//! path is straight legs with such corners between them; nothing here touches an axis but by the commands that anybody may give it.
//!
//! * [`corner`]: one corner, rounded.
//! * [`leg`]: what a path is told, and what it is made of.
//! * [`path`]: postures to legs and corners, with the speeds at which they can be driven.
//! * [`follower`]: where the base is on its path, to what it is to be commanded next.
//! * [`progress`]: what it looks at, and what it answers.
//! * [`chase`]: the same for a posture that moves.
//! * [`pilot`]: both, on an [`Interface`](crate::controller::Interface).

pub mod chase;
pub mod corner;
pub mod follower;
mod frame;
pub mod leg;
pub mod limits;
pub mod path;
pub mod pilot;
pub mod progress;

pub use chase::Chase;
pub use corner::Corner;
pub use follower::Follower;
pub use leg::{Leg, Passage, PathError, Posture, Vertex};
pub use limits::KinematicLimits;
pub use path::Path;
pub use pilot::{Ending, Errand, Notice, Pilot, Settings, Unable};
pub use progress::{Order, PathEvent, Progress, Tolerance};
