//! Messages of every type, with fields of every kind: what is awkward is frequent.
#![allow(dead_code, reason = "each test uses a part of it")]

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use ros_messages::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus, KeyValue};
use ros_messages::geometry_msgs::{
    Covariance, Point, Pose, PoseStamped, PoseWithCovariance, PoseWithCovarianceStamped,
    Quaternion, Transform, TransformStamped, Twist, TwistStamped, TwistWithCovariance, Vector3,
};
use ros_messages::nav_msgs::Odometry;
use ros_messages::sensor_msgs::{BatteryState, JointState};
use ros_messages::services::{
    SetBoolRequest, SetBoolResponse, SetPoseRequest, SetPoseResponse, TriggerRequest,
    TriggerResponse,
};
use ros_messages::std_msgs::{Header, Time};
use ros_messages::tf2_msgs::TFMessage;

/// Something that can be made up.
pub trait Sample {
    /// One more.
    fn sample(rng: &mut ChaCha8Rng) -> Self;
}

impl Sample for f64 {
    fn sample(rng: &mut ChaCha8Rng) -> Self {
        match rng.random_range(0..12) {
            0 => Self::NAN,
            1 => Self::INFINITY,
            2 => Self::NEG_INFINITY,
            3 => -0.0,
            4 => Self::MIN_POSITIVE / 8.0,
            5 => Self::MAX,
            _ => rng.random_range(-1e3..1e3),
        }
    }
}

impl Sample for f32 {
    fn sample(rng: &mut ChaCha8Rng) -> Self {
        f64::sample(rng) as Self
    }
}

impl Sample for bool {
    fn sample(rng: &mut ChaCha8Rng) -> Self {
        rng.random()
    }
}

impl Sample for u8 {
    fn sample(rng: &mut ChaCha8Rng) -> Self {
        rng.random()
    }
}

impl Sample for String {
    fn sample(rng: &mut ChaCha8Rng) -> Self {
        match rng.random_range(0..6) {
            0 => Self::new(),
            1 => "Größe 漢字 🤖 \t\"'\\".into(),
            2 => "x".repeat(rng.random_range(1000..5000)),
            _ => (0..rng.random_range(1..20))
                .map(|_| char::from(rng.random_range(b' '..=b'~')))
                .collect(),
        }
    }
}

impl<T: Sample> Sample for Vec<T> {
    fn sample(rng: &mut ChaCha8Rng) -> Self {
        let length = match rng.random_range(0..8) {
            0 => 0,
            1 => rng.random_range(50..100),
            _ => rng.random_range(1..5),
        };
        (0..length).map(|_| T::sample(rng)).collect()
    }
}

impl Sample for Covariance {
    fn sample(rng: &mut ChaCha8Rng) -> Self {
        Self(std::array::from_fn(|_| f64::sample(rng)))
    }
}

impl Sample for Time {
    fn sample(rng: &mut ChaCha8Rng) -> Self {
        Self {
            sec: rng.random(),
            nanosec: rng.random_range(0..1_000_000_000),
        }
    }
}

/// Makes up each field.
macro_rules! sample {
    ($($name:ident { $($field:ident),* })*) => {
        $(impl Sample for $name {
            fn sample(rng: &mut ChaCha8Rng) -> Self {
                Self { $($field: Sample::sample(rng)),* }
            }
        })*
    };
}

sample! {
    Header { stamp, frame_id }
    Point { x, y, z }
    Vector3 { x, y, z }
    Quaternion { x, y, z, w }
    Pose { position, orientation }
    PoseStamped { header, pose }
    PoseWithCovariance { pose, covariance }
    PoseWithCovarianceStamped { header, pose }
    Twist { linear, angular }
    TwistStamped { header, twist }
    TwistWithCovariance { twist, covariance }
    Transform { translation, rotation }
    TransformStamped { header, child_frame_id, transform }
    Odometry { header, child_frame_id, pose, twist }
    TFMessage { transforms }
    BatteryState {
        header, voltage, temperature, current, charge, capacity, design_capacity, percentage, power_supply_status, power_supply_health,
        power_supply_technology, present, cell_voltage, cell_temperature, location, serial_number
    }
    JointState { header, name, position, velocity, effort }
    KeyValue { key, value }
    DiagnosticStatus { level, name, message, hardware_id, values }
    DiagnosticArray { header, status }
    TriggerResponse { success, message }
    SetBoolRequest { data }
    SetBoolResponse { success, message }
    SetPoseRequest { pose }
}

/// Those without a field: their byte is always zero.
macro_rules! empty {
    ($($name:ident),*) => {
        $(impl Sample for $name {
            fn sample(_: &mut ChaCha8Rng) -> Self {
                Self::default()
            }
        })*
    };
}

empty!(TriggerRequest, SetPoseResponse);

/// Does something with each type of message.
#[macro_export]
macro_rules! for_each_message {
    ($do:ident) => {
        $do!(
            ros_messages::std_msgs::Time,
            ros_messages::std_msgs::Header,
            ros_messages::geometry_msgs::Point,
            ros_messages::geometry_msgs::Vector3,
            ros_messages::geometry_msgs::Quaternion,
            ros_messages::geometry_msgs::Pose,
            ros_messages::geometry_msgs::PoseStamped,
            ros_messages::geometry_msgs::PoseWithCovariance,
            ros_messages::geometry_msgs::PoseWithCovarianceStamped,
            ros_messages::geometry_msgs::Twist,
            ros_messages::geometry_msgs::TwistStamped,
            ros_messages::geometry_msgs::TwistWithCovariance,
            ros_messages::geometry_msgs::Transform,
            ros_messages::geometry_msgs::TransformStamped,
            ros_messages::nav_msgs::Odometry,
            ros_messages::tf2_msgs::TFMessage,
            ros_messages::sensor_msgs::BatteryState,
            ros_messages::sensor_msgs::JointState,
            ros_messages::diagnostic_msgs::KeyValue,
            ros_messages::diagnostic_msgs::DiagnosticStatus,
            ros_messages::diagnostic_msgs::DiagnosticArray,
            ros_messages::services::TriggerRequest,
            ros_messages::services::TriggerResponse,
            ros_messages::services::SetBoolRequest,
            ros_messages::services::SetBoolResponse,
            ros_messages::services::SetPoseRequest,
            ros_messages::services::SetPoseResponse
        )
    };
}
