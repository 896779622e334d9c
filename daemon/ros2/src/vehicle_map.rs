//! The map that a vehicle hands over to be published.

use scenecast_protocol::map::{LabelGrid, LayerDescriptor};

/// The map of a vehicle: labels, and levels of its layers.
#[derive(Debug, Clone)]
pub struct VehicleMap {
    pub version: u64,
    pub cell_m: f64,
    pub labels: LabelGrid,
    pub layers: Vec<(LayerDescriptor, LabelGrid)>,
}
