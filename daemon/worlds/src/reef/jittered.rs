//! Jittered lattices: places at nearly regular distances, each with its habitat and its own random numbers.

use super::fields::place_number;
use super::layout::{Habitat, Layout};
use scene_model::random::{CounterRng, mix};

/// A rectangle of the world, metres.
#[derive(Clone, Copy, Debug)]
pub(super) struct Region {
    pub west: f32,
    pub south: f32,
    pub east: f32,
    pub north: f32,
}

/// A lattice with one place at random in each of its squares.
pub(super) struct JitteredLattice {
    /// Edge of a square, metres.
    pub spacing_m: f32,
    /// Squares along the edge of a block; the places of a block share their habitat.
    pub block: i32,
    /// The key of the places' random numbers.
    pub stream: u64,
}

/// A place of a lattice.
pub(super) struct Place {
    /// Metres east, and `y` metres north.
    pub x: f32,
    pub y: f32,
    pub habitat: Habitat,
    pub rng: CounterRng,
}

impl JitteredLattice {
    /// Visits the places of the habitats that `wanted` accepts, up to `reach_m` outside of the region.
    pub(super) fn visit(
        &self,
        layout: &Layout,
        (region, reach_m): (&Region, f32),
        wanted: impl Fn(&Habitat) -> bool,
        mut found: impl FnMut(Place),
    ) {
        let first = |low: f32| ((low - reach_m) / self.spacing_m).floor() as i32;
        let last = |high: f32| ((high + reach_m) / self.spacing_m).ceil() as i32;
        let middle = |block: i32| (block as f32 + 0.5) * self.block as f32 * self.spacing_m;
        for row in first(region.south)..last(region.north) {
            let mut shared = None;
            for column in first(region.west)..last(region.east) {
                let block = column.div_euclid(self.block);
                let habitat = match shared {
                    Some((at, habitat)) if at == block => habitat,
                    _ => layout.at(middle(block), middle(row.div_euclid(self.block))),
                };
                shared = Some((block, habitat));
                if wanted(&habitat) {
                    let mut rng = CounterRng::new(self.stream ^ mix(place_number(column, row)));
                    let x = (column as f32 + rng.unit() as f32) * self.spacing_m;
                    let y = (row as f32 + rng.unit() as f32) * self.spacing_m;
                    found(Place { x, y, habitat, rng });
                }
            }
        }
    }
}
