//! The package `rosgraph_msgs`.

use crate::builtin_interfaces::Time;
use crate::message::messages;

messages! {
    package "rosgraph_msgs";

    /// The time of a simulation or of a playback.
    message Clock {
        clock: Time,
    }
}
