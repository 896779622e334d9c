//! The true classes of a simulated sea floor, for comparison with the map.

use crate::state::TruthInfo;
use bytes::Bytes;

/// The true classes of a part of a simulated sea floor.
#[derive(Debug, Clone, PartialEq)]
pub struct Truth {
    /// The outline of the picture, and its classes.
    pub info: TruthInfo,
    /// An indexed PNG, one pixel a cell, north up.
    pub picture: Bytes,
}
