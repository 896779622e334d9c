//! The label that the operator of the bench weighs.

use super::flight::Flight;
use scenecast_protocol::map::{Cell, LabelGrid};
use std::collections::BTreeMap;

/// The share of the vehicle's map that the chosen label is nearest to.
const SHARE: f64 = 0.1;

/// A label with its true area.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Favourite {
    pub(super) label: u8,
    /// The label's share of the vehicle's map.
    pub(super) share: f64,
    /// The true class of most of its area.
    pub(super) class: u8,
    /// Its true area inside and outside of the seen cells, square metres.
    pub(super) seen_m2: f64,
    pub(super) unseen_m2: f64,
}

impl Favourite {
    /// The label whose share of the map is nearest to a tenth, of those of which more lies outside of the seen cells than
    /// inside. `truth` is the true label of each cell of the world.
    pub(super) fn choose(flight: &Flight, truth: &LabelGrid) -> Option<Self> {
        let (right, up) = flight.map_offset();
        let map = flight.mission.vehicle().map();
        let seen: LabelGrid = map.iter().map(|(c, label)| (Cell::new(c.x + right, c.y + up), label)).collect();
        nearest(&seen, truth, |cell| flight.class_at(cell), flight.mission.cell_m())
    }
}

fn nearest(
    seen: &LabelGrid,
    truth: &LabelGrid,
    class_at: impl Fn(Cell) -> Option<u8>,
    cell_m: f64,
) -> Option<Favourite> {
    let mut areas: BTreeMap<u8, [f64; 2]> = BTreeMap::new();
    let mut classes: BTreeMap<u8, BTreeMap<u8, u32>> = BTreeMap::new();
    for (cell, label) in truth.iter() {
        areas.entry(label).or_default()[usize::from(seen.get(cell) == 0)] += cell_m * cell_m;
        if let Some(class) = class_at(cell) {
            *classes.entry(label).or_default().entry(class).or_default() += 1;
        }
    }
    let mut counts: BTreeMap<u8, u32> = BTreeMap::new();
    seen.iter().for_each(|(_, label)| *counts.entry(label).or_default() += 1);
    let all: u32 = counts.values().sum();
    let favourites = counts.iter().filter_map(|(&label, &cells)| {
        let [seen_m2, unseen_m2] = *areas.get(&label)?;
        let (&class, _) = classes.get(&label)?.iter().max_by_key(|(_, cells)| **cells)?;
        let share = f64::from(cells) / f64::from(all);
        (unseen_m2 > seen_m2).then_some(Favourite { label, share, class, seen_m2, unseen_m2 })
    });
    favourites.min_by(|a, b| (a.share - SHARE).abs().total_cmp(&(b.share - SHARE).abs()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_label_near_a_tenth_with_more_area_elsewhere_is_chosen() {
        // Twenty seen cells: label 1 on 15, label 2 on 3, label 3 on 2. Ten unseen cells: label 3 on one, label 2 on nine.
        let seen_label = |x: i32| {
            if x < 15 {
                1
            } else if x < 18 {
                2
            } else {
                3
            }
        };
        let seen: LabelGrid = (0..20).map(|x| (Cell::new(x, 0), seen_label(x))).collect();
        let unseen = (20..30).map(|x| (Cell::new(x, 0), if x < 21 { 3 } else { 2 }));
        let truth: LabelGrid = seen.iter().chain(unseen).collect();
        let chosen = nearest(&seen, &truth, |cell| Some(u8::from(cell.x < 16)), 0.5).unwrap();
        assert_eq!((chosen.label, chosen.class), (2, 0), "label 3 has a tenth, but most of it was seen");
        assert_eq!((chosen.share, chosen.seen_m2, chosen.unseen_m2), (0.15, 0.75, 2.25));
        assert_eq!(nearest(&seen, &LabelGrid::default(), |_| None, 0.5), None);
    }
}
