//! From pixels to the world: where on the sea floor a visual word lies.

mod down;
mod pinhole;

pub use down::{DownCamera, Pose};
pub use pinhole::{CameraPose, DepthImage, PinholeCamera, Projected};

/// A visual word in the world: local ENU metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// Word id, below the vocabulary size.
    pub word: u32,
    /// East, metres.
    pub x: f64,
    /// North, metres.
    pub y: f64,
    /// Up, metres.
    pub z: f64,
}
