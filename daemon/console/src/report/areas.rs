//! The areas of classes with their intervals, from the model's confidence in each cell.

use crate::recording::ShownMap;
use scenecast_protocol::map::{Cell, LayerReplica, MAX_LABEL};
use std::collections::BTreeMap;

/// Edge of a square of cells that are taken to be right or wrong together, cells.
const BLOCK: i32 = 4;
/// Standard deviations on each side of 95 %.
const SIGMAS: f64 = 1.96;

/// The area of a class.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ClassArea {
    /// The label that stands for the class.
    pub(super) label: u8,
    pub(super) cells: u64,
    pub(super) area_m2: f64,
    /// The ends of the 95 % interval, square metres; `None` if no confidence was received.
    pub(super) interval_m2: Option<(f64, f64)>,
}

impl ClassArea {
    /// Whether its area may be the larger one, by the intervals of both.
    pub(super) fn may_exceed(&self, larger: &Self) -> bool {
        self.interval_m2.zip(larger.interval_m2).is_some_and(|((_, high), (low, _))| high > low)
    }
}

/// A cell with the class of its label, and the bounds of the probability that the label is right.
struct DoubtedCell {
    cell: Cell,
    label: u8,
    class: u8,
    right: (f64, f64),
}

/// The area of each class of a map, the largest first; `class` gives the label that another one is shown as.
pub(super) fn areas(map: &ShownMap, class: impl Fn(u8) -> u8) -> Vec<ClassArea> {
    let mut cells: BTreeMap<u8, u64> = BTreeMap::new();
    let mut of_label = [0_u64; MAX_LABEL as usize + 2];
    for (_, label) in map.labels.shown().iter() {
        *cells.entry(class(label)).or_default() += 1;
        of_label[usize::from(label)] += 1;
    }
    let doubted = map.layers.get("confidence").map(|confidence| doubted(map, confidence, &class));
    let square = map.cell_m * map.cell_m;
    let area = |(label, cells): (u8, u64)| ClassArea {
        label,
        cells,
        area_m2: cells as f64 * square,
        interval_m2: doubted.as_ref().map(|doubted| {
            let (low, high) = interval(doubted, label, cells, &of_label);
            // What is on the map may be more, or less, than the doubt lets expect: it is in the interval all the same.
            let cells = cells as f64;
            (low.min(cells) * square, high.max(cells) * square)
        }),
    };
    let mut areas: Vec<ClassArea> = cells.into_iter().map(area).collect();
    areas.sort_by_key(|area| (std::cmp::Reverse(area.cells), area.label));
    areas
}

fn doubted(map: &ShownMap, confidence: &LayerReplica, class: impl Fn(u8) -> u8) -> Vec<DoubtedCell> {
    let levels = confidence.levels().shown();
    // Where none was received, all is possible.
    let bounds = |cell| confidence.descriptor().bounds(levels.get(cell)).unwrap_or((0.0, 1.0));
    let cells = map.labels.shown().iter();
    cells.map(|(cell, label)| DoubtedCell { cell, label, class: class(label), right: bounds(cell) }).collect()
}

/// The 95 % interval of the number of cells of a class that has `size` cells. The doubt of a cell is shared among the other labels by
/// their cells, so that a part of it may stay in the class.
fn interval(cells: &[DoubtedCell], class: u8, size: u64, of_label: &[u64]) -> (f64, f64) {
    let (mut least_sum, mut most_sum) = (0.0, 0.0);
    let mut blocks: BTreeMap<(i32, i32), f64> = BTreeMap::new();
    for DoubtedCell { cell, label, class: own, right } in cells {
        let alike = of_label.get(usize::from(*label)).copied().unwrap_or(0);
        let others = (cells.len() as u64 - alike).max(1) as f64;
        let chance = |right: f64| match *own == class {
            true => right + (1.0 - right) * (size - alike) as f64 / others,
            false => (1.0 - right) * size as f64 / others,
        };
        let ends = [chance(right.0), chance(right.1)];
        let (least, most) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
        (least_sum, most_sum) = (least_sum + least, most_sum + most);
        let middle = least.midpoint(most);
        let block = (cell.x.div_euclid(BLOCK), cell.y.div_euclid(BLOCK));
        *blocks.entry(block).or_default() += (middle * (1.0 - middle)).max(0.0).sqrt();
    }
    let margin = SIGMAS * blocks.values().map(|deviation| deviation * deviation).sum::<f64>().sqrt();
    ((least_sum - margin).max(0.0), (most_sum + margin).min(cells.len() as f64))
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenecast_protocol::map::{LayerId, LayerSet};
    use scenecast_protocol::time::Instant;

    /// 8 x 8 cells: the southern half of label 1, the northern one of 2 and, in its last row, 3, which is shown as 2.
    fn map(level: Option<u8>) -> ShownMap {
        let mut map = ShownMap { cell_m: 0.5, ..ShownMap::default() };
        let mut layer = LayerReplica::new(LayerSet::default().get(LayerId::CONFIDENCE).unwrap().clone());
        for (x, y) in (0..8).flat_map(|y| (0..8).map(move |x| (x, y))) {
            let label = if y < 4 { 1 } else { 2 + u8::from(y == 7) };
            map.labels.restore(Cell::new(x, y), label, Instant::ZERO);
            level.into_iter().for_each(|level| layer.restore(Cell::new(x, y), level, Instant::ZERO));
        }
        if level.is_some() {
            map.layers.insert("confidence".to_owned(), layer);
        }
        map
    }

    fn class(label: u8) -> u8 {
        label.min(2)
    }

    #[test]
    fn classes_have_the_cells_of_their_labels() {
        let found = areas(&map(None), class);
        let plain = |label| ClassArea { label, cells: 32, area_m2: 8.0, interval_m2: None };
        assert_eq!(found, [plain(1), plain(2)]);
    }

    #[test]
    fn the_interval_holds_the_area_and_grows_with_the_doubt() {
        let width = |level: u8| {
            let found = areas(&map(Some(level)), class);
            let (low, high) = found[1].interval_m2.unwrap();
            assert!(low <= 8.0 && (8.0..=16.0).contains(&high), "{found:?}");
            high - low
        };
        // Quarters: 4 is 0.75 to 1.
        assert!(width(4) < width(3) && width(3) > 2.0, "{} {}", width(4), width(3));
    }
}
