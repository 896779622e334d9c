//! The layers that every vehicle and surface know by name.

use super::{Decimal, LayerDescriptor, LayerId, Palette, Quantity, Spread, Steps, UpperEnd};
use std::borrow::Cow;

/// A layer that an operator can name before a vehicle has announced it.
#[derive(Debug)]
pub struct BuiltInLayer {
    /// Its index on every vehicle.
    pub id: LayerId,
    /// Its description; a vehicle may announce another one, for example with other depths.
    pub descriptor: LayerDescriptor,
    /// One sentence for people.
    pub summary: &'static str,
}

/// Depth of the sea floor; the vehicle chooses the scale by [`LayerDescriptor::depth_around`].
pub(super) const DEPTH: LayerDescriptor = LayerDescriptor {
    name: Cow::Borrowed("depth"),
    unit: Cow::Borrowed("m"),
    quantity: Quantity::Depth,
    scale: Decimal::new(5, -1),
    offset: Decimal::ZERO,
    steps: Steps::Equal,
    levels: 254,
    upper_end: UpperEnd::Exclusive,
    share: 0,
    palette: Palette::Cividis,
    spread: Spread::Present,
};

/// How sure the model is of the label, from 0 to 1.
pub(super) const CONFIDENCE: LayerDescriptor = LayerDescriptor {
    name: Cow::Borrowed("confidence"),
    unit: Cow::Borrowed(""),
    quantity: Quantity::Plain,
    scale: Decimal::new(25, -2),
    levels: 4,
    upper_end: UpperEnd::Inclusive,
    spread: Spread::Scale,
    ..DEPTH
};

/// How badly the model explains a cell: the binary logarithm of the perplexity.
pub(super) const CURIOSITY: LayerDescriptor = LayerDescriptor {
    name: Cow::Borrowed("curiosity"),
    unit: Cow::Borrowed("bit"),
    quantity: Quantity::Plain,
    scale: Decimal::new(1, 0),
    levels: 16,
    upper_end: UpperEnd::Unbounded,
    palette: Palette::Inferno,
    spread: Spread::Common,
    ..DEPTH
};

/// How long ago the vehicle last saw a cell.
pub(super) const LAST_SEEN: LayerDescriptor = LayerDescriptor {
    name: Cow::Borrowed("last_seen"),
    unit: Cow::Borrowed("min"),
    quantity: Quantity::Plain,
    scale: Decimal::new(2, 0),
    steps: Steps::Doubling,
    levels: 10,
    upper_end: UpperEnd::Unbounded,
    ..DEPTH
};

/// The built-in layers by their indexes. Of two that may be sent the one with the lower index goes first: depths change
/// seldom, so they go before confidences. An index is never given to another layer, because settings in a journal name it.
pub static BUILT_IN_LAYERS: [BuiltInLayer; 4] = [
    BuiltInLayer { id: LayerId::DEPTH, descriptor: DEPTH, summary: "Depth of the sea floor below the surface" },
    BuiltInLayer {
        id: LayerId::CONFIDENCE,
        descriptor: CONFIDENCE,
        summary: "How sure the scene model is of the label",
    },
    BuiltInLayer {
        id: LayerId::CURIOSITY,
        descriptor: CURIOSITY,
        summary: "How badly the scene model explains a cell: mean surprise of a word, the binary logarithm of the perplexity",
    },
    BuiltInLayer {
        id: LayerId::LAST_SEEN,
        descriptor: LAST_SEEN,
        summary: "How long before its last camera frame the vehicle last saw a cell",
    },
];

impl LayerId {
    /// Depth of the sea floor, metres.
    pub const DEPTH: Self = Self::of_built_in(0);
    /// Confidence of the model in the label, 0 to 1.
    pub const CONFIDENCE: Self = Self::of_built_in(1);
    /// Binary logarithm of the perplexity, bits a word.
    pub const CURIOSITY: Self = Self::of_built_in(2);
    /// Time from the last sight of the cell to the last camera frame, minutes.
    pub const LAST_SEEN: Self = Self::of_built_in(3);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_of_built_in_layers_is_sound() {
        for (index, layer) in BUILT_IN_LAYERS.iter().enumerate() {
            assert_eq!(layer.id.index(), index);
            assert!(layer.descriptor.is_sound(), "{layer:?}");
            assert_eq!(LayerDescriptor::from_bytes(&layer.descriptor.to_bytes()).as_ref(), Some(&layer.descriptor));
            let names = BUILT_IN_LAYERS.iter().filter(|other| other.descriptor.name == layer.descriptor.name);
            assert_eq!((names.count(), layer.summary.is_empty()), (1, false));
        }
    }
}
