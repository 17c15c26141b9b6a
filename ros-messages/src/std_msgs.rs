//! Packages `builtin_interfaces` and `std_msgs`: when, and in which frame.

message! {
    /// An instant.
    #[derive(Copy, Eq)]
    Time = "builtin_interfaces/msg/Time" {
        /// Whole seconds since 1970, or since the simulation's beginning.
        sec: i32 = "int32",
        /// ns beside them.
        nanosec: u32 = "uint32",
    }
}

impl Time {
    /// From nanoseconds since 1970: what is before, or after the year 2038, becomes the nearest that there is.
    pub fn from_nanoseconds(nanoseconds: i64) -> Self {
        const SECOND: i64 = 1_000_000_000;
        match i32::try_from(nanoseconds.div_euclid(SECOND)) {
            Ok(sec) => Self {
                sec,
                nanosec: nanoseconds.rem_euclid(SECOND) as u32,
            },
            Err(_) if nanoseconds < 0 => Self {
                sec: i32::MIN,
                nanosec: 0,
            },
            Err(_) => Self {
                sec: i32::MAX,
                nanosec: 999_999_999,
            },
        }
    }

    /// Nanoseconds since 1970.
    pub fn nanoseconds(self) -> i64 {
        i64::from(self.sec) * 1_000_000_000 + i64::from(self.nanosec)
    }
}

message! {
    /// When something was measured, and in which frame.
    #[derive(Eq)]
    Header = "std_msgs/msg/Header" {
        /// When.
        stamp: Time = "builtin_interfaces/Time",
        /// The frame's name.
        frame_id: String = "string",
    }
}

#[cfg(test)]
mod tests {
    use super::Time;

    #[test]
    fn times_before_1970_and_far_ones_stay_times() {
        for (nanoseconds, sec, nanosec) in [
            (0, 0, 0),
            (1_500_000_000, 1, 500_000_000),
            (-1, -1, 999_999_999),
            (i64::MAX, i32::MAX, 999_999_999),
            (i64::MIN, i32::MIN, 0),
        ] {
            let time = Time::from_nanoseconds(nanoseconds);
            assert_eq!((time.sec, time.nanosec), (sec, nanosec));
        }
        let now = 1_790_000_000_123_456_789;
        assert_eq!(Time::from_nanoseconds(now).nanoseconds(), now);
    }
}
