//! ROS 2's `byte`, which has the bytes of `uint8` but a type of its own in definitions and hashes.

use serde::{Deserialize, Serialize};

/// One octet of the type `byte`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Byte(pub u8);
