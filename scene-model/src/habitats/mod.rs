//! Habitats: labels of cells by what they look like over all their sights.
//!
//! The topics of the model follow the words that happened to come first: one habitat has several, depending on when it was seen. A habitat
//! depends on neither order nor seed. Each frame is measured by itself ([`measure`]); a cell has the mean over its moments; measures are
//! compared in units of the differences between neighbouring cells, smoothed where neighbours look alike, and clustered without random
//! numbers. Clusters are split only where the sea floor calls for it, so a uniform floor has few.
//!
//! ```
//! use scene_model::habitats::{Habitats, measure};
//! use scene_model::project::{DownCamera, Pose};
//!
//! let mut habitats = Habitats::new(16);
//! for second in 0..3 {
//!     let image = scenecast_worlds::patches(1, 320, 240, 120, 3).image;
//!     let camera = DownCamera { metres_per_pixel: 0.01, altitude_m: 3.0 };
//!     let pose = Pose { x: 0.0, y: 3.2 * f64::from(second), z: -10.0, yaw_rad: 0.0 };
//!     // A cell of 0.1 m is 10 pixels wide.
//!     let points = measure(&image, 10.0);
//!     let places = camera.project(320, 240, &pose, &Habitats::as_words(&points));
//!     habitats.add(f64::from(second), &points, &places, 0.1);
//! }
//! habitats.learn();
//! assert!((2..=16).contains(&habitats.labels()));
//! ```

mod cells;
mod clusters;
mod measures;
mod sights;
mod smooth;
mod space;
mod tree;

pub use measures::{MEASURES, MeasuredPoint, MeasuredValues, measure};
pub use tree::LabelTree;

use crate::project::Observation;
use crate::words::Word;
use cells::CellMap;
use clusters::Clusters;
use serde::{Deserialize, Serialize};
use sights::Sights;
use smooth::{Coordinates, smoothed, squared_distance};
use std::collections::BTreeMap;

/// A cell keeps its label unless another centre is nearer by this, squared units of the noise between neighbours.
const HYSTERESIS: f32 = 2.0;

/// The habitats of one mission.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Habitats {
    most: u32,
    sights: Sights,
    /// The label of each cell after the last [`Habitats::learn`], by (y, x): as clustered, and as shown.
    clustered: BTreeMap<(i32, i32), u32>,
    shown: BTreeMap<(i32, i32), u32>,
    next: u32,
    tree: LabelTree,
}

impl Habitats {
    /// No habitats yet, and at most `most` at one time, at least one.
    #[must_use]
    pub fn new(most: u32) -> Self {
        Self {
            most: most.max(1),
            sights: Sights::default(),
            clustered: BTreeMap::new(),
            shown: BTreeMap::new(),
            next: 0,
            tree: LabelTree::default(),
        }
    }

    /// The points as words that a camera can project: the id is the place in the list.
    #[must_use]
    pub fn as_words(points: &[MeasuredPoint]) -> Vec<Word> {
        (0..).zip(points).map(|(id, point)| Word { id, u: point.u, v: point.v }).collect()
    }

    /// Adds the points of a frame of `t_s` seconds. `places` are their projected [`Habitats::as_words`], metres, in cells with an edge of
    /// `cell_m` metres. Places that are not finite or out of range are left out.
    pub fn add(&mut self, t_s: f64, points: &[MeasuredPoint], places: &[Observation], cell_m: f64) {
        let cell = |metres: f64| (metres / cell_m).floor();
        let is_in_range = |index: f64| index.abs() < f64::from(i32::MAX / 2);
        for place in places {
            let (x, y) = (cell(place.x), cell(place.y));
            let Some(point) = points.get(place.word as usize).filter(|_| is_in_range(x) && is_in_range(y)) else {
                continue;
            };
            self.sights.add((x as i32, y as i32), t_s, &point.values);
        }
    }

    /// Clusters all cells again. Labels keep their number where their cells overlap those of an earlier one, and a number is never given
    /// to another habitat.
    pub fn learn(&mut self) {
        let (places, values): (Vec<_>, Vec<_>) = self.sights.means().unzip();
        if places.is_empty() {
            return;
        }
        let map = CellMap::new(&places);
        let cells = smoothed(&map, &space::whitened(&map, &values));
        let found = Clusters::grow(&cells, self.most as usize);
        let labels = self.numbered(&places, &found);
        self.show(&places, &cells, &found, &labels);
        let mut counts = vec![0.0; labels.len()];
        found.of_cells.iter().for_each(|&cluster| counts[cluster] += 1.0);
        let centres = labels.iter().zip(counts).zip(&found.centres);
        self.tree = LabelTree::of(centres.map(|((&label, count), centre)| (label, count, centre.clone())).collect());
        self.clustered =
            places.iter().zip(&found.of_cells).map(|(&place, &cluster)| (place, labels[cluster])).collect();
    }

    /// The label of each cluster: of the earlier labels that share cells with it, the one that shares most and is not taken.
    fn numbered(&mut self, places: &[(i32, i32)], found: &Clusters) -> Vec<u32> {
        let mut shared: BTreeMap<(usize, u32), u32> = BTreeMap::new();
        for (place, &cluster) in places.iter().zip(&found.of_cells) {
            if let Some(&label) = self.clustered.get(place) {
                *shared.entry((cluster, label)).or_default() += 1;
            }
        }
        let mut pairs: Vec<_> = shared.into_iter().collect();
        pairs.sort_by_key(|&((cluster, label), cells)| (std::cmp::Reverse(cells), label, cluster));
        let (mut labels, mut taken) = (vec![None; found.centres.len()], Vec::new());
        for ((cluster, label), _) in pairs {
            if labels[cluster].is_none() && !taken.contains(&label) {
                labels[cluster] = Some(label);
                taken.push(label);
            }
        }
        labels
            .into_iter()
            .map(|label| {
                label.unwrap_or_else(|| {
                    self.next += 1;
                    self.next - 1
                })
            })
            .collect()
    }

    /// Shows the nearest label of each cell, or still the earlier one where it is nearly as near.
    fn show(&mut self, places: &[(i32, i32)], cells: &Coordinates, found: &Clusters, labels: &[u32]) {
        for (cell, &place) in places.iter().enumerate() {
            let distance = |cluster: usize| squared_distance(cells.of(cell), &found.centres[cluster]);
            let nearest = found.of_cells[cell];
            let shown = self.shown.entry(place).or_insert(labels[nearest]);
            let earlier = labels.iter().position(|label| label == shown);
            if earlier.is_none_or(|earlier| distance(earlier) - distance(nearest) >= HYSTERESIS) {
                *shown = labels[nearest];
            }
        }
    }

    /// The label of the cell at (x, y); `None` until it has been learnt.
    #[must_use]
    pub fn label_at(&self, x: i32, y: i32) -> Option<u32> {
        self.shown.get(&(y, x)).copied()
    }

    /// The number of labels that cells show.
    #[must_use]
    pub fn labels(&self) -> usize {
        let mut labels: Vec<u32> = self.shown.values().copied().collect();
        labels.sort_unstable();
        labels.dedup();
        labels.len()
    }

    /// The number of cells with sights.
    #[must_use]
    pub fn cells(&self) -> usize {
        self.sights.len()
    }

    /// Which labels become one at coarser levels.
    #[must_use]
    pub fn tree(&self) -> &LabelTree {
        &self.tree
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::project::{DownCamera, Pose};
    use image::{Rgb, RgbImage};

    /// A frame of fine noise around a colour, or of two colours beside each other.
    fn frame(colours: [[u8; 3]; 2], key: u64) -> RgbImage {
        RgbImage::from_fn(200, 160, |x, y| {
            let bits = crate::random::mix(key << 32 | u64::from(x) << 12 | u64::from(y));
            Rgb(colours[usize::from(x >= 100)].map(|value| value.saturating_add((bits % 20) as u8)))
        })
    }

    fn fly(colours: [[u8; 3]; 2], order: &[u32]) -> Habitats {
        let camera = DownCamera { metres_per_pixel: 0.025, altitude_m: 4.0 };
        let mut habitats = Habitats::new(16);
        for &k in order {
            let points = measure(&frame(colours, u64::from(k)), 10.0);
            let pose = Pose { x: 0.0, y: 2.0 * f64::from(k), z: 0.0, yaw_rad: 0.0 };
            let places = camera.project(200, 160, &pose, &Habitats::as_words(&points));
            habitats.add(20.0 * f64::from(k), &points, &places, 0.25);
        }
        habitats.learn();
        habitats
    }

    #[test]
    fn each_floor_has_one_label_in_any_order() {
        let colours = [[160, 150, 120], [60, 90, 50]];
        let [forward, reversed] = [[0, 1, 2, 3, 4, 5], [5, 4, 3, 2, 1, 0]].map(|order| fly(colours, &order));
        for map in [&forward, &reversed] {
            // Cells whose windows reach over the border look like neither floor.
            let labels = |columns: std::ops::Range<i32>| -> Vec<u32> {
                let cells = (-2..42).flat_map(|y| columns.clone().map(move |x| (x, y)));
                let mut labels: Vec<u32> = cells.map(|(x, y)| map.label_at(x, y).unwrap()).collect();
                labels.sort_unstable();
                labels.dedup();
                labels
            };
            let (west, east) = (labels(-10..-4), labels(4..10));
            assert!(west.len() == 1 && east.len() == 1 && west != east, "{west:?} {east:?}");
        }
        let same = |x| forward.label_at(x, 20) == forward.label_at(x - 1, 20);
        assert!((-9..10).all(|x| same(x) == (reversed.label_at(x, 20) == reversed.label_at(x - 1, 20))));
    }

    #[test]
    fn a_uniform_floor_has_one_label() {
        assert_eq!(fly([[150, 140, 110]; 2], &[0, 1, 2, 3]).labels(), 1);
    }

    #[test]
    fn numbers_stay_when_more_is_seen() {
        let mut habitats = fly([[160, 150, 120], [60, 90, 50]], &[0, 1, 2]);
        let before: Vec<_> = (-9..9).map(|x| habitats.label_at(x, 3)).collect();
        let later = fly([[160, 150, 120], [60, 90, 50]], &[7, 8, 9]);
        let places: Vec<_> = later.sights.means().collect();
        places.iter().for_each(|((y, x), values)| habitats.sights.add((*x, *y), 500.0, values));
        habitats.learn();
        assert_eq!((-9..9).map(|x| habitats.label_at(x, 3)).collect::<Vec<_>>(), before);
    }
}
