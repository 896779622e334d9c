//! From pixels to the world: the position of a visual word on the sea floor.

mod down;
mod pinhole;
mod view;

pub use down::{DownCamera, Pose};
pub use pinhole::{CameraPose, DepthImage, PinholeCamera, Projected};
pub use view::{Floor, View};

/// A visual word at a position in the world: metres in a local east-north-up frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// The word's number, below the vocabulary size.
    pub word: u32,
    /// Metres to the east of the origin.
    pub x: f64,
    /// Metres to the north of the origin.
    pub y: f64,
    /// Metres above the origin; negative below it.
    pub z: f64,
}
