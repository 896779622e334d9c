//! The package `diagnostic_msgs`.

use crate::Byte;
use crate::message::messages;
use crate::std_msgs::Header;

messages! {
    package "diagnostic_msgs";

    /// A named value.
    message KeyValue {
        key: String,
        value: String,
    }

    /// The state of one part of a robot.
    message DiagnosticStatus {
        level: Byte,
        name: String,
        message: String,
        hardware_id: String,
        values: Vec<KeyValue>,
    }
    constants {
        byte OK: u8 = 0;
        byte WARN: u8 = 1;
        byte ERROR: u8 = 2;
        byte STALE: u8 = 3;
    }

    /// The states of all parts.
    message DiagnosticArray {
        header: Header,
        status: Vec<DiagnosticStatus>,
    }
}
