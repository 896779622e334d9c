//! The package `rcl_interfaces`.

use crate::builtin_interfaces::Time;
use crate::message::messages;

messages! {
    package "rcl_interfaces";

    /// One line of a log.
    message Log {
        stamp: Time,
        level: u8,
        name: String,
        msg: String,
        file: String,
        function: String,
        line: u32,
    }
    constants {
        uint8 DEBUG: u8 = 10;
        uint8 INFO: u8 = 20;
        uint8 WARN: u8 = 30;
        uint8 ERROR: u8 = 40;
        uint8 FATAL: u8 = 50;
    }
}
