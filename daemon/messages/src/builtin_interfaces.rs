//! The package `builtin_interfaces`.

use crate::message::messages;

const NANOS: i64 = 1_000_000_000;

messages! {
    package "builtin_interfaces";

    /// A time of day, or a time since the start of a simulation.
    message Time {
        sec: i32,
        nanosec: u32,
    }

    /// A span of time.
    message Duration {
        sec: i32,
        nanosec: u32,
    }
}

impl Time {
    /// The time this many nanoseconds after 1970; the nearest that the type can hold.
    pub fn from_nanos(nanos: i64) -> Self {
        let sec = nanos.div_euclid(NANOS);
        match i32::try_from(sec) {
            Ok(sec) => Self { sec, nanosec: nanos.rem_euclid(NANOS) as u32 },
            Err(_) if sec < 0 => Self { sec: i32::MIN, nanosec: 0 },
            Err(_) => Self { sec: i32::MAX, nanosec: NANOS as u32 - 1 },
        }
    }

    /// The time in nanoseconds: since 1970, or since the start of a simulation.
    pub fn nanos(&self) -> i64 {
        // 2^31 s and 2^32 ns together are below 2^63 ns.
        i64::from(self.sec) * NANOS + i64::from(self.nanosec)
    }
}
