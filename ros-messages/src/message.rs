//! What makes a struct a message.

use serde::Serialize;
use serde::de::DeserializeOwned;

/// A message of ROS 2: its serde fields are those of its definition, in that order.
pub trait RosMessage: Serialize + DeserializeOwned {
    /// Its type's name, such as `nav_msgs/msg/Odometry`.
    const NAME: &'static str;
    /// Its fields, a line each, in the language of `.msg` files.
    const DEFINITION: &'static str;
}

/// Writes a struct and its definition down together, so that they cannot differ: each field has its type in Rust and, behind `=`, in the definition.
/// Constants, which take no room, come behind `with`.
macro_rules! message {
    (
        $(#[$meta:meta])*
        $name:ident = $full:literal $(with $constants:literal)? {
            $($(#[$field_meta:meta])* $field:ident: $kind:ty = $definition:literal),* $(,)?
        }
    ) => {
        $(#[$meta])*
        #[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
        pub struct $name {
            $($(#[$field_meta])* pub $field: $kind,)*
        }

        #[cfg(feature = "dds")]
        impl ros2_client::Message for $name {}

        impl $crate::RosMessage for $name {
            const NAME: &'static str = $full;
            const DEFINITION: &'static str =
                concat!($($constants,)? $($definition, " ", stringify!($field), "\n"),*);
        }
    };
}
