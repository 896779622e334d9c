//! The levels that cells have in the layers of the map, which a checkpoint keeps: a level stands against small changes, so
//! that the quantity alone does not tell it.

use scenecast_protocol::map::{BUILT_IN_LAYERS, Cell, LayerDescriptor, LayerId};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The quantities of each layer, in the unit of its descriptor.
pub(super) type Quantities = BTreeMap<LayerId, Vec<(Cell, f64)>>;

/// The level of each cell in every built-in layer, by the cell's x and y and the index of the layer; 0 without one.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct HeldLevels(BTreeMap<(i32, i32), [u8; BUILT_IN_LAYERS.len()]>);

impl HeldLevels {
    /// Takes quantities, and moves each into the level that its cell has now. Those that it has taken last stay as they are.
    pub(super) fn hold(&mut self, descriptors: &BTreeMap<LayerId, LayerDescriptor>, quantities: &mut Quantities) {
        for (id, cells) in quantities {
            let Some(descriptor) = descriptors.get(id) else { continue };
            for (cell, quantity) in cells {
                let Some(held) = self.0.entry((cell.x, cell.y)).or_default().get_mut(id.index()) else { continue };
                (*held, *quantity) = settle(descriptor, *quantity, *held);
            }
        }
    }
}

/// The level of a cell that was of level `held`, and the nearest quantity that is of this level for who holds none.
fn settle(descriptor: &LayerDescriptor, quantity: f64, held: u8) -> (u8, f64) {
    /// Distance from the bounds of the level, as a share of its width: beyond the errors of rounding.
    const INSET: f64 = 0.01;
    let level = descriptor.level(quantity, held);
    match descriptor.bounds(level).filter(|_| level != descriptor.level(quantity, 0)) {
        None => (level, quantity),
        Some((low, high)) => {
            let inset = (high - low) * INSET;
            (level, quantity.clamp(low + inset, high - inset))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_level_that_is_held_stands_for_who_does_not_hold_it() {
        let descriptor = BUILT_IN_LAYERS[LayerId::CONFIDENCE.index()].descriptor.clone();
        let descriptors = BTreeMap::from([(LayerId::CONFIDENCE, descriptor.clone())]);
        let cell = Cell::new(2, -3);
        let mut levels = HeldLevels::default();
        let mut level = |quantity: f64| {
            let mut quantities = BTreeMap::from([(LayerId::CONFIDENCE, vec![(cell, quantity)])]);
            levels.hold(&descriptors, &mut quantities);
            let mut again = BTreeMap::from([(LayerId::CONFIDENCE, vec![(cell, quantity)])]);
            levels.clone().hold(&descriptors, &mut again);
            assert_eq!(again, quantities);
            descriptor.level(quantities[&LayerId::CONFIDENCE][0].1, 0)
        };
        assert_eq!([0.30, 0.52, 0.56, 0.48, 0.44].map(&mut level), [2, 2, 3, 3, 2]);
    }
}
