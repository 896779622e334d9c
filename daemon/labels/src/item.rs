//! One item: its time, the names of classes in it, and its content.

use crate::picture::Raster;
use scenecast_protocol::map::{ClassEntry, Decimal};

/// An item of labels or of a band.
#[derive(Debug, Clone, PartialEq)]
pub struct Item {
    /// Mission time of the picture, seconds; `None` if it is that of its arrival.
    pub t_s: Option<f64>,
    /// Names and colours of classes.
    pub classes: Vec<ClassEntry>,
    pub content: Content,
}

/// The content of an item.
#[derive(Debug, Clone, PartialEq)]
pub enum Content {
    /// Names of classes alone.
    Classes,
    /// A segmented image of a camera that looks down: pixel value = class, 255 = unknown.
    Image {
        /// `None`: the vehicle's own pose at the item's time.
        pose: Option<ImagePose>,
        /// Size of a pixel on the sea floor, metres; `None`: that of the camera.
        metres_per_pixel: Option<f64>,
        classes: Raster,
    },
    /// A grid that states the class of each of its cells; 255 makes a cell unknown.
    Grid { ground: Ground, classes: Raster },
    /// A grid of levels of a quantity.
    Band { band: Band, ground: Ground, levels: Raster },
}

/// The pose of the camera in the map frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImagePose {
    /// Metres to the east and to the north of the origin.
    pub x_m: f64,
    pub y_m: f64,
    /// Depth of the camera below the surface of the water, metres.
    pub depth_m: f64,
    /// Heading of the top of the image, radians clockwise from north.
    pub heading_rad: f64,
}

/// The place of a grid in the map frame. Its rows go from north to south, as those of an image do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ground {
    /// The south-west corner of the grid: metres to the east and to the north of the origin.
    pub west_m: f64,
    pub south_m: f64,
    /// Edge of a cell of the grid, metres.
    pub cell_m: f64,
}

/// The meaning of the values of a band: `offset + scale * value`.
#[derive(Debug, Clone, PartialEq)]
pub struct Band {
    pub name: String,
    pub unit: String,
    pub scale: Decimal,
    pub offset: Decimal,
    /// The value of cells without a quantity.
    pub no_data: u8,
}
