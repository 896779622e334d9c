//! The meaning of a layer's levels as text for a record.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use scenecast_protocol::map::{LayerDescriptor, Quantity};
use serde::{Deserialize, Serialize};

/// The meaning of a layer's levels in a record, as JSON.
#[derive(Serialize, Deserialize)]
struct LayerText {
    name: String,
    unit: String,
    is_depth: bool,
    /// The bounds of levels in units: level n lies from `edges[n - 1]` to `edges[n]`.
    edges: Vec<f64>,
    /// Base64 of the descriptor's bytes on the wire.
    descriptor: String,
}

/// The meaning of a layer's levels as text for a record.
pub fn layer_text(descriptor: &LayerDescriptor) -> String {
    let bounds = |level| descriptor.bounds(level).unwrap_or_default();
    let text = LayerText {
        name: descriptor.name.clone().into_owned(),
        unit: descriptor.unit.clone().into_owned(),
        is_depth: descriptor.quantity == Quantity::Depth,
        edges: (1..=descriptor.levels).map(|n| bounds(n).0).chain([bounds(descriptor.levels).1]).collect(),
        descriptor: STANDARD.encode(descriptor.to_bytes()),
    };
    // Strings, numbers and lists of these, so this cannot fail.
    serde_json::to_string(&text).unwrap_or_default()
}

/// Reads [`layer_text`]; `None` if it is another text.
pub(crate) fn layer_of_text(text: &str) -> Option<LayerDescriptor> {
    let text: LayerText = serde_json::from_str(text).ok()?;
    LayerDescriptor::from_bytes(&STANDARD.decode(text.descriptor).ok()?)
}
