//! Requests and responses of services.

use crate::geometry_msgs::PoseWithCovarianceStamped;

message! {
    /// `std_srvs/srv/Trigger`: do it. A message without fields has one on the network, so that it is something.
    #[derive(Copy, Eq)]
    TriggerRequest = "std_srvs/srv/Trigger_Request" {
        /// Zero.
        structure_needs_at_least_one_member: u8 = "uint8",
    }
}

message! {
    /// What became of it.
    #[derive(Eq)]
    TriggerResponse = "std_srvs/srv/Trigger_Response" {
        /// It was done.
        success: bool = "bool",
        /// In words.
        message: String = "string",
    }
}

message! {
    /// `std_srvs/srv/SetBool`: on, or off.
    #[derive(Copy, Eq)]
    SetBoolRequest = "std_srvs/srv/SetBool_Request" {
        /// On.
        data: bool = "bool",
    }
}

message! {
    /// What became of it.
    #[derive(Eq)]
    SetBoolResponse = "std_srvs/srv/SetBool_Response" {
        /// It was done.
        success: bool = "bool",
        /// In words.
        message: String = "string",
    }
}

message! {
    /// `robot_localization/srv/SetPose`: where the base is.
    SetPoseRequest = "robot_localization/srv/SetPose_Request" {
        /// Where.
        pose: PoseWithCovarianceStamped = "geometry_msgs/PoseWithCovarianceStamped",
    }
}

message! {
    /// It was heard.
    #[derive(Copy, Eq)]
    SetPoseResponse = "robot_localization/srv/SetPose_Response" {
        /// Zero.
        structure_needs_at_least_one_member: u8 = "uint8",
    }
}
