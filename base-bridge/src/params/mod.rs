//! The bridge's own parameters, with ROS 2's names and files.

pub mod yaml;

use anyhow::{Context, Result, bail, ensure};
use ros_messages::base::names::{Names, Topics, whole};
use yaml::Value;

/// How a topic is carried.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Qos {
    /// Lost samples are sent again. A reader that wants that never matches a writer that does not offer it.
    pub reliable: bool,
    /// So many samples are kept for a reader that is slow.
    pub depth: i32,
}

/// How the request of a service and its answer find each other: the engines of ROS 2 do it in two ways.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ServiceMapping {
    /// By the sample's related identity, as Fast DDS.
    Enhanced,
    /// By a header in the sample, as Cyclone DDS.
    Cyclone,
}

/// A type that a parameter can have.
trait Parameter: Sized {
    fn take(value: &Value) -> Result<Self>;
    fn show(&self) -> String;
}

impl Parameter for bool {
    fn take(value: &Value) -> Result<Self> {
        match value {
            Value::Bool(value) => Ok(*value),
            other => bail!("true or false, not {other}"),
        }
    }
    fn show(&self) -> String {
        self.to_string()
    }
}

impl Parameter for f64 {
    fn take(value: &Value) -> Result<Self> {
        match value {
            Value::Real(value) if value.is_finite() => Ok(*value),
            Value::Integer(value) => Ok(*value as f64),
            other => bail!("a number, not {other}"),
        }
    }
    fn show(&self) -> String {
        format!("{self:?}")
    }
}

impl Parameter for i32 {
    fn take(value: &Value) -> Result<Self> {
        match value {
            Value::Integer(value) => Ok(i32::try_from(*value)?),
            other => bail!("a whole number, not {other}"),
        }
    }
    fn show(&self) -> String {
        self.to_string()
    }
}

impl Parameter for String {
    fn take(value: &Value) -> Result<Self> {
        match value {
            Value::Text(value) => Ok(value.clone()),
            other => bail!("a text, not {other}"),
        }
    }
    fn show(&self) -> String {
        format!("\"{self}\"")
    }
}

macro_rules! parameters {
    ($($section:literal { $($field:ident $name:literal: $type:ty = $default:expr, $is:expr, $doc:literal;)* })*) => {
        /// All of them.
        #[derive(Clone, Debug, PartialEq)]
        pub struct Params {
            $($(#[doc = $doc] pub $field: $type,)*)*
        }

        impl Default for Params {
            fn default() -> Self {
                Self { $($($field: $default.into(),)*)* }
            }
        }

        impl Params {
            /// Sets one by its dotted name.
            ///
            /// # Errors
            /// If there is none of that name, or the value is not one that it can have.
            pub fn set(&mut self, name: &str, value: &Value) -> Result<()> {
                match name {
                    $($(concat!($section, $name) => {
                        let new: $type = Parameter::take(value).with_context(|| format!("{name} is"))?;
                        let is: fn(&$type) -> bool = $is;
                        ensure!(is(&new), "{name} cannot be {value}: {}", $doc);
                        self.$field = new;
                    })*)*
                    // Every node of ROS 2 has this one. This one lives in real time.
                    "use_sim_time" => ensure!(*value == Value::Bool(false), "a base lives in real time: use_sim_time is false"),
                    _ => bail!("no parameter `{name}`"),
                }
                Ok(())
            }

            /// All, as a parameter file.
            pub fn file(&self) -> String {
                let mut text = String::from("/**:\n  ros__parameters:\n");
                $($({
                    let name = concat!($section, $name);
                    text += &format!("    # {}\n    {name}: {}\n", $doc, self.$field.show());
                })*)*
                text
            }
        }
    };
}

/// A name of a topic or a service, of ROS 2: letters, digits and `_` between slashes, not empty.
fn is_name(name: &str) -> bool {
    let tokens = name.strip_prefix('/').unwrap_or(name).split('/');
    let is_token = |token: &str| {
        token.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
            && token.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
    };
    tokens.clone().all(is_token)
}

#[allow(clippy::ptr_arg, reason = "a check takes what its parameter is")]
fn is_topic(name: &String) -> bool {
    is_name(name)
}

#[allow(clippy::ptr_arg, reason = "a check takes what its parameter is")]
fn is_topic_or_none(name: &String) -> bool {
    name.is_empty() || is_name(name)
}

#[allow(clippy::ptr_arg, reason = "a check takes what its parameter is")]
fn is_frame(name: &String) -> bool {
    !name.is_empty() && name.chars().all(|c| c.is_ascii_graphic()) && !name.starts_with('/')
}

#[allow(clippy::ptr_arg, reason = "a check takes what its parameter is")]
fn is_frame_or_none(name: &String) -> bool {
    name.is_empty() || is_frame(name)
}

#[allow(clippy::ptr_arg, reason = "a check takes what its parameter is")]
fn is_mapping(name: &String) -> bool {
    ["enhanced", "cyclone"].contains(&name.as_str())
}

#[allow(
    clippy::trivially_copy_pass_by_ref,
    reason = "a check takes what its parameter is"
)]
fn is_rate(rate: &f64) -> bool {
    (0.0..=50.0).contains(rate)
}

#[allow(
    clippy::trivially_copy_pass_by_ref,
    reason = "a check takes what its parameter is"
)]
fn is_depth(depth: &i32) -> bool {
    (1..=1000).contains(depth)
}

fn any<T>(_: &T) -> bool {
    true
}

parameters! {
    "cmd_vel." {
        cmd_vel_timeout "timeout": f64 = 0.25, |s| (0.05..=5.0).contains(s), "s, 0.05 to 5: the base is stopped when no speed has come for so long";
        cmd_vel_stamped "stamped": bool = false, any, "speeds come as TwistStamped, not as Twist: one of the two, for a reader of both on one name takes one for the other";
    }
    "frames." {
        frame_prefix "prefix": String = "", is_frame_or_none, "in front of frames.odom, base and footprint, as r1/, for bases that share tf";
        frame_map "map": String = "map", is_frame, "the frame that the base's estimate, fixes and goals are in";
        frame_odom "odom": String = "odom", is_frame, "the frame that is continuous";
        frame_footprint "footprint": String = "", is_frame_or_none, "a frame where the base's is, as base_footprint: on tf_static; empty: none";
        frame_base "base": String = "base_link", is_frame, "the frame of the base, at the point that its heading is of";
    }
    "tf." {
        publish_tf "odom_to_base": bool = true, any, "publish odom to base_link";
        publish_map_tf "map_to_odom": bool = true, any, "publish map to odom; not where another localisation does";
    }
    "rates." {
        rate_odom "odom": f64 = 50.0, |hz| (1.0..=50.0).contains(hz), "Hz, 1 to 50: telemetry, and with it odom, tf and joint_states";
        rate_covariance "covariance": f64 = 10.0, |hz| (0.1..=50.0).contains(hz), "Hz, 0.1 to 50: the covariance, which costs a line each way";
        rate_battery "battery_state": f64 = 1.0, is_rate, "Hz, 0 to 50";
        rate_diagnostics "diagnostics": f64 = 1.0, is_rate, "Hz, 0 to 50; besides at each change of the fault or the line";
        rate_joints "joint_states": f64 = 50.0, is_rate, "Hz, 0 to 50";
    }
    "topics." {
        topic_odom "odom": String = "odom", is_topic, "nav_msgs/Odometry";
        topic_tf "tf": String = "/tf", is_topic, "tf2_msgs/TFMessage";
        topic_tf_static "tf_static": String = "/tf_static", is_topic, "tf2_msgs/TFMessage, kept for who comes later";
        topic_battery "battery_state": String = "battery_state", is_topic, "sensor_msgs/BatteryState";
        topic_diagnostics "diagnostics": String = "/diagnostics", is_topic, "diagnostic_msgs/DiagnosticArray";
        topic_joints "joint_states": String = "joint_states", is_topic, "sensor_msgs/JointState";
        topic_cmd_vel "cmd_vel": String = "cmd_vel", is_topic_or_none, "geometry_msgs/Twist or TwistStamped; empty: not listened to";
        topic_fix "pose_fix": String = "pose_fix", is_topic_or_none, "geometry_msgs/PoseWithCovarianceStamped: where somebody else sees the base; empty: not listened to";
        topic_goal "goal_pose": String = "goal_pose", is_topic_or_none, "geometry_msgs/PoseStamped: where to go; empty: not listened to";
        topic_initial "initialpose": String = "initialpose", is_topic_or_none, "geometry_msgs/PoseWithCovarianceStamped: where the base is, from now on; empty: not listened to";
    }
    "services." {
        service_stop "stop": String = "stop", is_topic, "std_srvs/Trigger";
        service_clear "clear_fault": String = "clear_fault", is_topic, "std_srvs/Trigger";
        service_enable "enable": String = "enable", is_topic, "std_srvs/SetBool: motor power";
        service_set_pose "set_pose": String = "set_pose", is_topic, "robot_localization/SetPose";
        mapping "mapping": String = "enhanced", is_mapping, "how a request finds its answer: enhanced, as Fast DDS has it (what ROS 2 brings), or cyclone";
    }
    "joints." {
        joint_left "left": String = "left_wheel_joint", is_frame, "of a differential drive or a car";
        joint_right "right": String = "right_wheel_joint", is_frame, "of a differential drive or a car";
        joint_drive "drive": String = "drive_wheel_joint", is_frame, "of a synchro drive or a tricycle";
        joint_steer "steer": String = "steering_joint", is_frame, "of what steers";
    }
    "qos." {
        odom_reliable "odom.reliable": bool = true, any, "false: best effort";
        odom_depth "odom.depth": i32 = 10, is_depth, "1 to 1000";
        tf_reliable "tf.reliable": bool = true, any, "false: best effort, which no listener of tf matches";
        tf_depth "tf.depth": i32 = 100, is_depth, "1 to 1000";
        state_reliable "state.reliable": bool = true, any, "of battery_state, diagnostics and joint_states; false: best effort";
        state_depth "state.depth": i32 = 10, is_depth, "1 to 1000";
        command_reliable "commands.reliable": bool = false, any, "of all that comes in; true never matches a best-effort writer";
        command_depth "commands.depth": i32 = 1, is_depth, "1 to 1000; of speeds only the newest counts";
    }
    "line." {
        baud "baud": i32 = 115_200, |baud| (1200..=4_000_000).contains(baud), "1200 to 4000000";
        line_checks "checks": bool = false, any, "the base puts checks on telemetry, too, for a line that damages what it carries: its require_crc is 1 while the bridge is there, and a person who types needs them as well";
    }
}

impl Params {
    /// Takes what a file says to a node.
    ///
    /// # Errors
    /// If the file is none, or names what is not there.
    pub fn read(&mut self, text: &str, node: &str) -> Result<()> {
        for (name, value) in yaml::parameters(text, node)? {
            self.set(&name, &value)?;
        }
        self.consistent()
    }

    /// Takes `name:=value`.
    ///
    /// # Errors
    /// If it is none.
    pub fn assign(&mut self, assignment: &str) -> Result<()> {
        let Some((name, text)) = assignment.split_once(":=") else {
            bail!("`{assignment}` is not name:=value");
        };
        self.set(name, &yaml::value(text)?)?;
        self.consistent()
    }

    fn consistent(&self) -> Result<()> {
        let Names {
            map, odom, base, ..
        } = &self.names("", "");
        ensure!(
            map != odom && odom != base && map != base,
            "frames.map, frames.odom and frames.base are three"
        );
        Ok(())
    }

    /// What topics, frames and joints are called, in the namespace of its node, and the node itself.
    pub fn names(&self, namespace: &str, node: &str) -> Names {
        let topic = |name: &str| whole(namespace, name);
        let own = |frame: &str| match frame {
            "" => String::new(),
            frame => format!("{}{frame}", self.frame_prefix),
        };
        Names {
            node: topic(node).trim_start_matches('/').to_owned(),
            map: self.frame_map.clone(),
            odom: own(&self.frame_odom),
            base: own(&self.frame_base),
            footprint: own(&self.frame_footprint),
            publish_map_to_odom: self.publish_map_tf,
            publish_odom_to_base: self.publish_tf,
            joint_left: self.joint_left.clone(),
            joint_right: self.joint_right.clone(),
            joint_drive: self.joint_drive.clone(),
            joint_steer: self.joint_steer.clone(),
            topics: Topics {
                odom: topic(&self.topic_odom),
                tf: topic(&self.topic_tf),
                tf_static: topic(&self.topic_tf_static),
                joints: topic(&self.topic_joints),
                battery: topic(&self.topic_battery),
                diagnostics: topic(&self.topic_diagnostics),
            },
        }
    }

    /// Of odom.
    pub fn odom_qos(&self) -> Qos {
        qos(self.odom_reliable, self.odom_depth)
    }

    /// Of tf.
    pub fn tf_qos(&self) -> Qos {
        qos(self.tf_reliable, self.tf_depth)
    }

    /// Of battery_state, diagnostics and joint_states.
    pub fn state_qos(&self) -> Qos {
        qos(self.state_reliable, self.state_depth)
    }

    /// Of the services.
    pub fn service_mapping(&self) -> ServiceMapping {
        if self.mapping == "cyclone" {
            ServiceMapping::Cyclone
        } else {
            ServiceMapping::Enhanced
        }
    }

    /// Of all that comes in.
    pub fn command_qos(&self) -> Qos {
        qos(self.command_reliable, self.command_depth)
    }
}

fn qos(reliable: bool, depth: i32) -> Qos {
    Qos { reliable, depth }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_are_a_file_that_says_the_same() {
        let defaults = Params::default();
        let mut read = Params::default();
        read.read(&defaults.file(), "/robot1/base").unwrap();
        assert_eq!(read, defaults);
    }

    #[test]
    fn a_second_file_replaces_what_it_names() {
        let mut params = Params::default();
        let first =
            "/**: {ros__parameters: {cmd_vel: {timeout: 0.5, stamped: true}, rates.odom: 20}}";
        let second = "/r1/base: {ros__parameters: {cmd_vel.timeout: 0.3, frames: {odom: r1/odom, base: r1/base_link}}}";
        for file in [first, second] {
            params.read(file, "/r1/base").unwrap();
        }
        assert_eq!(
            (params.cmd_vel_timeout, params.cmd_vel_stamped),
            (0.3, true)
        );
        assert_eq!(params.rate_odom, 20.0);
        assert_eq!(params.frame_odom, "r1/odom");
        params.assign("cmd_vel.timeout:=0.75").unwrap();
        assert_eq!(params.cmd_vel_timeout, 0.75);
    }

    #[test]
    fn the_defaults_are_the_names_of_rep_105() {
        assert_eq!(Params::default().names("", "base"), Names::default());
        let names = Params::default().names("/r1", "base");
        assert_eq!(
            (names.node.as_str(), names.topics.odom.as_str()),
            ("r1/base", "/r1/odom")
        );
    }

    #[test]
    fn mistakes_are_told() {
        let mut params = Params::default();
        for (wrong, why) in [
            ("cmd_vel.timeot:=1", "no parameter `cmd_vel.timeot`"),
            ("cmd_vel.timeout:=60", "cmd_vel.timeout cannot be 60"),
            ("cmd_vel.timeout:=.nan", "cmd_vel.timeout is"),
            ("cmd_vel.timeout:=fast", "cmd_vel.timeout is"),
            ("cmd_vel.stamped:=1", "cmd_vel.stamped is"),
            ("topics.odom:=a b", "topics.odom cannot be a b"),
            ("topics.odom:=a//b", "topics.odom cannot be a//b"),
            ("frames.odom:=map", "are three"),
            ("qos.odom.depth:=0", "qos.odom.depth cannot be 0"),
            ("use_sim_time:=true", "real time"),
            ("cmd_vel.timeout", "is not name:=value"),
        ] {
            let mut params = params.clone();
            let error = format!("{:#}", params.assign(wrong).unwrap_err());
            assert!(error.contains(why), "{wrong}: {error}");
        }
        params.assign("use_sim_time:=false").unwrap();
        params.assign("cmd_vel.timeout:=1").unwrap();
        // What comes in may be nobody's business here.
        params.assign("topics.goal_pose:=\"\"").unwrap();
        assert!(params.assign("topics.odom:=\"\"").is_err());
    }
}
