//! Package `sensor_msgs`: the battery and the joints.

use crate::std_msgs::Header;

message! {
    /// A battery. What is not measured is NaN.
    BatteryState = "sensor_msgs/msg/BatteryState" with "uint8 POWER_SUPPLY_STATUS_UNKNOWN = 0\nuint8 POWER_SUPPLY_STATUS_CHARGING = 1\nuint8 POWER_SUPPLY_STATUS_DISCHARGING = 2\nuint8 POWER_SUPPLY_STATUS_NOT_CHARGING = 3\nuint8 POWER_SUPPLY_STATUS_FULL = 4\nuint8 POWER_SUPPLY_HEALTH_UNKNOWN = 0\nuint8 POWER_SUPPLY_HEALTH_GOOD = 1\nuint8 POWER_SUPPLY_TECHNOLOGY_UNKNOWN = 0\n" {
        /// When.
        header: Header = "std_msgs/Header",
        /// V.
        voltage: f32 = "float32",
        /// °C.
        temperature: f32 = "float32",
        /// A, negative while it is discharged.
        current: f32 = "float32",
        /// Ah that are left.
        charge: f32 = "float32",
        /// Ah of a full one.
        capacity: f32 = "float32",
        /// Ah of a full one, by its maker.
        design_capacity: f32 = "float32",
        /// What is left, 0 to 1.
        percentage: f32 = "float32",
        /// 0: not known; 2: discharging.
        power_supply_status: u8 = "uint8",
        /// 0: not known.
        power_supply_health: u8 = "uint8",
        /// 0: not known.
        power_supply_technology: u8 = "uint8",
        /// There is one.
        present: bool = "bool",
        /// V of each cell.
        cell_voltage: Vec<f32> = "float32[]",
        /// °C of each cell.
        cell_temperature: Vec<f32> = "float32[]",
        /// Where it is.
        location: String = "string",
        /// Its number.
        serial_number: String = "string",
    }
}

message! {
    /// Joints: as many numbers as names, or none, of each kind.
    JointState = "sensor_msgs/msg/JointState" {
        /// When.
        header: Header = "std_msgs/Header",
        /// Of each.
        name: Vec<String> = "string[]",
        /// rad.
        position: Vec<f64> = "float64[]",
        /// rad/s.
        velocity: Vec<f64> = "float64[]",
        /// N·m.
        effort: Vec<f64> = "float64[]",
    }
}
