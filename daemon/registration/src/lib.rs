//! Places camera frames on the map by their overlap with earlier frames. No IO.
//!
//! [`Registrar::handle_frame`] takes a frame with its pose by dead reckoning, compass and altitude, and returns its pose
//! on the map. It matches the frame with the one before and with up to three older ones. [`GeometryCheck`] tells whether the camera is as
//! configured.

mod altitude;
mod camera_image;
mod compass;
mod consensus;
mod correlate;
mod evidence;
mod geometry;
mod graph;
mod kept_frames;
mod odometry;
mod pair;
mod plane;
mod refine;
mod registrar;
mod saved_state;
mod similarity;
mod tiles;

pub use crate::similarity::FramePose;
pub use camera_image::CameraImage;
pub use evidence::{Evidence, Tally};
pub use geometry::{CameraFinding, CameraGeometry, GeometryCheck};
pub use graph::FrameGraph;
pub use registrar::{FrameInput, Placed, Registrar};
pub use saved_state::RestoreError;

#[cfg(test)]
mod graph_tests;
#[cfg(test)]
mod registrar_tests;
#[cfg(test)]
mod skerki_tests;
