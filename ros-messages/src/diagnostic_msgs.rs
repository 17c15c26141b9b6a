//! Package `diagnostic_msgs`: how parts are.

use crate::std_msgs::Header;

message! {
    /// A number with a name.
    #[derive(Eq)]
    KeyValue = "diagnostic_msgs/msg/KeyValue" {
        /// The name.
        key: String = "string",
        /// The number, or a word.
        value: String = "string",
    }
}

message! {
    /// How a part is.
    #[derive(Eq)]
    DiagnosticStatus = "diagnostic_msgs/msg/DiagnosticStatus" with "byte OK=0\nbyte WARN=1\nbyte ERROR=2\nbyte STALE=3\n" {
        /// 0: well, 1: worth a look, 2: not well, 3: not heard of.
        level: u8 = "byte",
        /// Which part.
        name: String = "string",
        /// In words.
        message: String = "string",
        /// Which piece of hardware.
        hardware_id: String = "string",
        /// In numbers.
        values: Vec<KeyValue> = "diagnostic_msgs/KeyValue[]",
    }
}

message! {
    /// How several are.
    #[derive(Eq)]
    DiagnosticArray = "diagnostic_msgs/msg/DiagnosticArray" {
        /// When.
        header: Header = "std_msgs/Header",
        /// Each.
        status: Vec<DiagnosticStatus> = "diagnostic_msgs/DiagnosticStatus[]",
    }
}
