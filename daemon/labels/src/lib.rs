//! Labels and rasters that other programs make: segmented images, whole grids, bands, and the names of classes.
//!
//! Internal to scenecast. No IO: [`Item::read`] takes a header and the bytes of a picture, [`Stream`] takes the bytes of a
//! connection in pieces of any size, and [`ros`] takes messages of ROS 2. Every item that is not taken has a [`Refusal`],
//! which names the cause for people.

mod header;
mod item;
mod raster;
mod refusal;
pub mod ros;
mod stream;

pub use item::{Band, BandScale, Content, Ground, ImagePose, Item, ItemTime, QuantityBand};
pub use raster::Raster;
pub use refusal::{LayerFault, MAX_HEADER_BYTES, MAX_PICTURE_BYTES, MAX_PIXELS, MessageFault, Refusal};
pub use stream::Stream;
