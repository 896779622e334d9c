//! The view of a frame that is to be taken.

/// A frame to be taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// The place below the camera, metres east and north.
    pub x_m: f64,
    pub y_m: f64,
    /// Direction of the frame's top, clockwise from north.
    pub heading_rad: f64,
    /// Height above the sea floor: the water in between takes and adds light.
    pub altitude_m: f64,
    /// Columns and rows of the frame.
    pub width_px: u32,
    pub height_px: u32,
    /// Number of the moment. Snow and noise differ from moment to moment.
    pub moment: u64,
}
