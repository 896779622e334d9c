//! How soon the vehicle turns to the label that was weighed.

use scenecast_protocol::map::{Cell, LabelGrid};
use std::f64::consts::{PI, TAU};

/// The vehicle heads for a cell if the way to it differs from its heading by at most this, radians.
const WITHIN_RAD: f64 = PI / 6.0;
/// Time within which the vehicle shall head for the label, seconds.
pub(super) const TURN_LIMIT_S: u32 = 20;

/// Watches the vehicle from the second in which it has the order.
#[derive(Debug, Default)]
pub(super) struct Turn {
    /// The places since then, in cells.
    places: Vec<(f64, f64)>,
    turned_s: Option<u32>,
}

impl Turn {
    /// Takes the place and the heading of the next second, in cells of the vehicle's map and radians from north. `map` has
    /// the label that was weighed; the camera sees up to `reach` cells around.
    pub(super) fn note(&mut self, (map, label): (&LabelGrid, u8), (x, y): (f64, f64), heading_rad: f64, reach: f64) {
        self.places.push((x, y));
        let way = |cell: Cell, from: (f64, f64)| (f64::from(cell.x) + 0.5 - from.0, f64::from(cell.y) + 0.5 - from.1);
        let distance = |cell: Cell, from: (f64, f64)| way(cell, from).0.hypot(way(cell, from).1);
        let is_looked = |cell: Cell| self.places.iter().any(|&from| distance(cell, from) <= reach);
        let others = map.iter().filter(|&(cell, of)| of == label && !is_looked(cell)).map(|(cell, _)| cell);
        let nearest = others.min_by(|a, b| distance(*a, (x, y)).total_cmp(&distance(*b, (x, y))));
        let Some((east, north)) = nearest.map(|cell| way(cell, (x, y))) else { return };
        let off = (east.atan2(north) - heading_rad).rem_euclid(TAU);
        if off.min(TAU - off) <= WITHIN_RAD {
            self.turned_s.get_or_insert(self.places.len() as u32 - 1);
        }
    }

    /// Whether the time within which it shall turn has passed.
    pub(super) fn is_over(&self) -> bool {
        self.places.len() as u32 > TURN_LIMIT_S
    }

    /// Seconds until the vehicle headed for its nearest cell of the label that it has not looked at since the order; `None` if it has
    /// not.
    pub(super) fn turned_s(&self) -> Option<u32> {
        self.turned_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_vehicle_turns_when_it_heads_for_the_nearest_cell() {
        let map: LabelGrid =
            [(Cell::new(20, 0), 2), (Cell::new(0, 40), 2), (Cell::new(-9, 0), 1)].into_iter().collect();
        let mut turn = Turn::default();
        turn.note((&map, 2), (0.5, 0.5), 0.0, 3.0);
        assert_eq!(turn.turned_s(), None, "the nearest cell of label 2 lies east");
        turn.note((&map, 2), (0.5, 0.5), 65_f64.to_radians(), 3.0);
        turn.note((&map, 2), (0.5, 0.5), 0.0, 3.0);
        assert_eq!(turn.turned_s(), Some(1));
    }

    #[test]
    fn cells_that_were_looked_at_no_longer_count() {
        let map: LabelGrid = [(Cell::new(4, 0), 2), (Cell::new(0, 40), 2)].into_iter().collect();
        let mut turn = Turn::default();
        turn.note((&map, 2), (0.5, 0.5), 0.0, 3.0);
        assert_eq!(turn.turned_s(), None, "the cell in the east is beyond the view");
        turn.note((&map, 2), (2.5, 0.5), 0.0, 3.0);
        assert_eq!(turn.turned_s(), Some(1), "it was seen, and the next one lies north");
    }
}
