//! Habitats: labels of cells by what they look like over all their samples.
//!
//! The topics of the model follow the words that happened to come first: one habitat has several, depending on when it was seen. A habitat
//! depends on neither order nor seed. Each frame is measured by itself ([`measure`]); a cell has the mean over its samples; measures are
//! compared in units of the differences between neighbouring cells, smoothed where neighbours look alike, and clustered without random
//! numbers. Clusters are split only where the sea floor calls for it, so a uniform floor has few. While the map grows, labels follow their
//! cells; once it rests, it is corrected as if all had been seen at once, and then depends on no order at all.
//!
//! ```
//! use image::{Rgb, RgbImage};
//! use scene_model::habitats::{Habitats, measure};
//! use scene_model::project::{DownCamera, Pose};
//! use scene_model::random::mix;
//!
//! let mut habitats = Habitats::new(16);
//! for second in 0..3 {
//!     // Sand in the west, weed in the east.
//!     let image = RgbImage::from_fn(320, 240, |x, y| {
//!         let grain = (mix(u64::from(x) << 32 | u64::from(y)) % 20) as u8;
//!         Rgb(if x < 160 { [160, 150, 120] } else { [60, 90, 50] }.map(|value| value + grain))
//!     });
//!     let camera = DownCamera { metres_per_pixel: 0.01, altitude_m: 3.0 };
//!     let pose = Pose { x: 0.0, y: 3.2 * f64::from(second), z: -10.0, yaw_rad: 0.0 };
//!     // A cell of 0.1 m is 10 pixels wide.
//!     let points = measure(&image, 10.0);
//!     let places = camera.project(320, 240, &pose, &Habitats::as_words(&points));
//!     habitats.add((320, 240), &points, &places, 0.1);
//! }
//! habitats.learn();
//! assert!((2..=16).contains(&habitats.labels()));
//! ```

mod cell_samples;
mod cells;
mod clusters;
mod measures;

pub use clusters::LabelTree;
pub use measures::{MEASURES, MeasuredPoint, MeasuredValues, measure};

use crate::project::Observation;
use crate::publish::in_step;
use crate::topics::{FlatCell, TopicId};
use crate::words::Word;
use cell_samples::{CellSample, CellSamples, Rest};
use cells::{CellMap, Coordinates, Space, smoothed, squared_distance};
use clusters::{Clusters, Rule};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A cell keeps its label unless another centre is nearer by this times the contrast, squared units of the noise between neighbours.
const HYSTERESIS: f32 = 1.5;
/// The variance of a whole floor in its main direction, in units of the noise between neighbours, from which on its habitats stand out; and
/// the contrast below which a floor is uniform.
const STANDS_OUT: f64 = 5.0;
const NOT_UNIFORM: f64 = 0.45;
/// Frames after which a map is learnt again, and cells of a map that is learnt at each frame.
const FRAMES_BETWEEN: u32 = 10;
const SMALL_MAP: usize = 2000;
/// Fewest points of a cell in a frame.
const MIN_POINTS: f64 = 4.0;
/// Least deviation over the cells of a measure that varies.
const CONSTANT: f64 = 1e-3;
/// A floor that calls for at most so many labels is uniform: more would be noise.
const UNIFORM: usize = 3;

/// The label of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct HabitatCell {
    /// The number of the habitat.
    pub label: u32,
    /// The probability of this label among all, where each spreads around its centre as neighbours differ, 0 to 1.
    pub confidence: f32,
}

/// The habitats of one mission.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Habitats {
    most: u32,
    samples: CellSamples,
    /// The label of each cell after the last [`Habitats::learn`], by (y, x): as clustered, and as shown.
    clustered: BTreeMap<(i32, i32), u32>,
    shown: BTreeMap<(i32, i32), HabitatCell>,
    /// Cells without a label that have been seen since, and the frames since.
    fresh: Vec<(i32, i32)>,
    frames: u32,
    rest: Rest,
    learnt: Option<Learnt>,
    next: u32,
    tree: LabelTree,
}

/// The space and the centres of the last [`Habitats::learn`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Learnt {
    space: Space,
    centres: Vec<(u32, Vec<f32>)>,
}

impl Learnt {
    fn nearest(&self, values: &MeasuredValues) -> Option<HabitatCell> {
        let place = self.space.place(values);
        let distances: Vec<f32> = self.centres.iter().map(|(_, centre)| squared_distance(&place, centre)).collect();
        let (nearest, _) = distances.iter().enumerate().min_by(|a, b| a.1.total_cmp(b.1))?;
        Some(HabitatCell { label: self.centres[nearest].0, confidence: confidence(&distances, nearest) })
    }
}

/// The probability of a cluster, where each spreads with unit variance: `distances` are squared.
fn confidence(distances: &[f32], cluster: usize) -> f32 {
    1.0 / distances.iter().map(|distance| ((distances[cluster] - distance) / 2.0).exp()).sum::<f32>()
}

/// All cells of a map as they are compared.
struct Compared {
    places: Vec<(i32, i32)>,
    space: Space,
    /// Smoothed, in the order of the places.
    cells: Coordinates,
    /// The number of measures that vary over the cells.
    varying: usize,
    /// 1 where habitats stand out from the differences of neighbours, and less, down to .45, where habitats differ as little as
    /// neighbours: the finer the mosaic of a floor, the nearer its habitats.
    contrast: f64,
}

impl Habitats {
    /// No habitats yet, and at most `most` at one time, at least one.
    #[must_use]
    pub fn new(most: u32) -> Self {
        Self {
            most: most.max(1),
            samples: CellSamples::default(),
            clustered: BTreeMap::new(),
            shown: BTreeMap::new(),
            fresh: Vec::new(),
            frames: 0,
            rest: Rest::default(),
            learnt: None,
            next: 0,
            tree: LabelTree::default(),
        }
    }

    /// What each cell looks like over all its samples, by (y, x).
    #[must_use]
    pub fn appearance(&self) -> Vec<((i32, i32), MeasuredValues)> {
        self.samples.means()
    }

    /// Allows at most `most` labels at one time, at least one, from the next [`Habitats::learn`] on.
    pub fn limit(&mut self, most: u32) {
        self.most = most.max(1);
    }

    /// The points as words that a camera can project: the id is the place in the list.
    #[must_use]
    pub fn as_words(points: &[MeasuredPoint]) -> Vec<Word> {
        (0..).zip(points).map(|(id, point)| Word { id, u: point.u, v: point.v }).collect()
    }

    /// Adds the points of a frame of `size` pixels. `places` are their projected [`Habitats::as_words`], metres, in cells with an edge of
    /// `cell_m` metres. Places that are not finite or out of range are left out, and cells with fewer than four points.
    pub fn add(&mut self, size: (u32, u32), points: &[MeasuredPoint], places: &[Observation], cell_m: f64) {
        let cell = |metres: f64| Some((metres / cell_m).floor()).filter(|index| index.abs() < f64::from(i32::MAX / 2));
        let along = |pixel: f32, length: u32| 2.0 * f64::from(pixel) / f64::from(length.max(1)) - 1.0;
        let mut samples: BTreeMap<(i32, i32), CellSample> = BTreeMap::new();
        for place in places {
            let (Some(x), Some(y)) = (cell(place.x), cell(place.y)) else { continue };
            let Some(point) = points.get(place.word as usize) else { continue };
            let in_frame = [along(point.u, size.0), along(point.v, size.1)];
            samples.entry((y as i32, x as i32)).or_default().add(in_frame, &point.values);
        }
        for (place, sample) in samples.into_iter().filter(|(_, sample)| sample.points() >= MIN_POINTS) {
            self.samples.add(place, &sample);
            if !self.shown.contains_key(&place) {
                self.fresh.push(place);
            }
        }
        self.frames += 1;
    }

    /// Labels the cells of the frames that were added: a small map is learnt again, since it changes fast and costs little, and a large
    /// one every ten frames; until then new cells have the label whose centre is nearest. A map that rests is corrected once; then this is
    /// true.
    pub fn update(&mut self) -> bool {
        let is_due = self.rest.is_due(self.cells());
        if is_due {
            self.correct();
        } else if self.frames >= FRAMES_BETWEEN || self.cells() < SMALL_MAP {
            self.learn();
        } else {
            self.label_new();
        }
        is_due
    }

    fn label_new(&mut self) {
        let Some(learnt) = &self.learnt else { return };
        let fresh = std::mem::take(&mut self.fresh);
        for (place, values) in self.samples.means_of(&fresh) {
            if let Some(cell) = learnt.nearest(&values) {
                self.shown.insert(place, cell);
            }
        }
    }

    /// Clusters a map that has grown: labels follow their cells, are merged where two mean the same, and are born where the floor calls for
    /// them. A number is never given to another habitat.
    pub fn learn(&mut self) {
        let Some(map) = self.compared() else { return };
        let rule = self.natural(&map);
        let centres = self.centres_of_earlier(&map);
        let found = match centres.is_empty() {
            true => Clusters::grow(&map.cells, &rule),
            false => Clusters::continued(&map.cells, centres, &rule),
        };
        self.take(map, found);
    }

    /// Clusters the whole map as if nothing were known of it. It depends on the samples alone; labels keep their number where their cells
    /// overlap.
    pub fn correct(&mut self) {
        self.learn_as_new(|natural, _| natural);
    }

    /// As [`Habitats::correct`], into as many labels as are allowed, or as few as a uniform floor calls for.
    pub fn learn_whole(&mut self) {
        let most = self.most as usize;
        self.learn_as_new(|natural, cells| match natural.centres.len() {
            ..=UNIFORM => natural,
            _ => Clusters::grow(cells, &Rule { most, variance: 0.5, cells: 24, share: 0.0, gap: 0.0 }),
        });
    }

    /// Takes clusters that are made from those that the floor calls for, without regard to what was shown.
    fn learn_as_new(&mut self, clusters: impl FnOnce(Clusters, &Coordinates) -> Clusters) {
        let Some(map) = self.compared() else { return };
        let found = clusters(Clusters::grow(&map.cells, &self.natural(&map)), &map.cells);
        (self.shown, self.tree) = Default::default();
        self.take(map, found);
    }

    /// The rule by which a floor has as many labels as it calls for.
    fn natural(&self, map: &Compared) -> Rule {
        let gap = 5.0 * (map.contrast * map.varying as f64 / MEASURES as f64) as f32;
        Rule { most: self.most as usize, variance: map.contrast, cells: 24, share: 0.005, gap }
    }

    /// The cells as points whose distances are compared; `None` without cells.
    fn compared(&self) -> Option<Compared> {
        let (places, values): (Vec<_>, Vec<_>) = self.samples.means().into_iter().unzip();
        if places.is_empty() {
            return None;
        }
        let map = CellMap::new(&places);
        let varies = |k: &usize| {
            let count = values.len() as f64;
            let mean = values.iter().map(|v| v[*k]).sum::<f64>() / count;
            values.iter().map(|v| (v[*k] - mean).powi(2)).sum::<f64>() / count > CONSTANT * CONSTANT
        };
        let varying = (0..MEASURES).filter(varies).count().max(1);
        let space = Space::learn(&map, &values)?;
        let cells = smoothed(&map, &space.places(&values), varying);
        let contrast = (clusters::main_variance(&cells) / STANDS_OUT).sqrt().clamp(NOT_UNIFORM, 1.0);
        Some(Compared { places, space, cells, varying, contrast })
    }

    /// The centres of the cells of each label that was clustered last.
    fn centres_of_earlier(&self, map: &Compared) -> Vec<Vec<f32>> {
        let mut members: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
        for (cell, place) in map.places.iter().enumerate() {
            if let Some(&label) = self.clustered.get(place) {
                members.entry(label).or_default().push(cell);
            }
        }
        members.into_values().map(|members| clusters::mean(&map.cells, &members)).collect()
    }

    fn take(&mut self, map: Compared, found: Clusters) {
        let labels = self.numbered(&map.places, &found);
        self.show(&map, &found, &labels);
        let mut counts = vec![0.0; labels.len()];
        found.of_cells.iter().for_each(|&cluster| counts[cluster] += 1.0);
        let nodes = labels.iter().zip(counts).zip(&found.centres);
        let nodes = nodes.map(|((&label, count), centre)| (label, count, centre.clone())).collect();
        self.tree = LabelTree::of(nodes, &self.tree);
        self.clustered = map.places.iter().zip(&found.of_cells).map(|(&place, &of)| (place, labels[of])).collect();
        self.learnt = Some(Learnt { space: map.space, centres: labels.into_iter().zip(found.centres).collect() });
        self.fresh.clear();
        self.frames = 0;
    }

    /// The label of each cluster: of the earlier labels that share cells with it, the one that shares most and is not taken. A label means
    /// the same only if at least half of the cells of the one or of the other are shared.
    fn numbered(&mut self, places: &[(i32, i32)], found: &Clusters) -> Vec<u32> {
        let mut shared: BTreeMap<(usize, u32), u32> = BTreeMap::new();
        for (place, &cluster) in places.iter().zip(&found.of_cells) {
            if let Some(&label) = self.clustered.get(place) {
                *shared.entry((cluster, label)).or_default() += 1;
            }
        }
        let (mut of_cluster, mut of_label) = (vec![0; found.centres.len()], BTreeMap::<u32, u32>::new());
        for (&(cluster, label), cells) in &shared {
            of_cluster[cluster] += cells;
            *of_label.entry(label).or_default() += cells;
        }
        let is_half =
            |&((cluster, label), cells): &((usize, u32), u32)| 2 * cells >= of_cluster[cluster].min(of_label[&label]);
        let mut pairs: Vec<_> = shared.into_iter().filter(is_half).collect();
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
    fn show(&mut self, map: &Compared, found: &Clusters, labels: &[u32]) {
        let hysteresis = HYSTERESIS * map.contrast as f32;
        for (cell, &place) in map.places.iter().enumerate() {
            let distances: Vec<f32> =
                found.centres.iter().map(|centre| squared_distance(map.cells.of(cell), centre)).collect();
            let nearest = found.of_cells[cell];
            let earlier =
                self.shown.get(&place).and_then(|shown| labels.iter().position(|&label| label == shown.label));
            let kept = earlier.filter(|&earlier| distances[earlier] - distances[nearest] < hysteresis);
            let cluster = kept.unwrap_or(nearest);
            let shown = HabitatCell { label: labels[cluster], confidence: confidence(&distances, cluster) };
            self.shown.insert(place, shown);
        }
    }

    /// Gives the cells of a map, sorted by (y, x), their habitats. A cell that no frame has shown well enough is left out.
    #[must_use]
    pub fn labelled(&self, cells: &[FlatCell]) -> Vec<FlatCell> {
        let label = |(cell, shown): (&FlatCell, Option<&HabitatCell>)| {
            let &HabitatCell { label, confidence } = shown?;
            Some(FlatCell { topic: TopicId(label), confidence, ..*cell })
        };
        in_step(&self.shown, cells, |cell| (cell.y, cell.x)).filter_map(label).collect()
    }

    /// The map, sorted by (y, x): of each labelled cell the number of its habitat as its topic.
    #[must_use]
    pub fn map(&self) -> Vec<FlatCell> {
        let flat = |(&(y, x), cell): (&(i32, i32), &HabitatCell)| {
            let (topic, confidence) = (TopicId(cell.label), cell.confidence);
            FlatCell { x, y, z: 0, topic, words: 1, confidence, perplexity: 1.0 }
        };
        self.shown.iter().map(flat).collect()
    }

    /// The label of the cell at (x, y); `None` until it has been labelled.
    #[must_use]
    pub fn label_at(&self, x: i32, y: i32) -> Option<u32> {
        self.shown.get(&(y, x)).map(|cell| cell.label)
    }

    /// The number of labels that cells show.
    #[must_use]
    pub fn labels(&self) -> usize {
        let mut labels: Vec<u32> = self.shown.values().map(|cell| cell.label).collect();
        labels.sort_unstable();
        labels.dedup();
        labels.len()
    }

    /// The number of cells with samples.
    #[must_use]
    pub fn cells(&self) -> usize {
        self.samples.len()
    }

    /// Which labels become one at coarser cuts.
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

    /// Adds a frame whose middle lies `y_m` north.
    fn see(habitats: &mut Habitats, image: &RgbImage, y_m: f64) {
        let (columns, rows) = image.dimensions();
        let camera = DownCamera { metres_per_pixel: 0.025, altitude_m: 4.0 };
        let points = measure(image, 10.0);
        let pose = Pose { x: 0.0, y: y_m, z: 0.0, yaw_rad: 0.0 };
        let places = camera.project(columns, rows, &pose, &Habitats::as_words(&points));
        habitats.add((columns, rows), &points, &places, 0.25);
    }

    fn fly(colours: [[u8; 3]; 2], order: &[u32]) -> Habitats {
        let mut habitats = Habitats::new(16);
        for &k in order {
            see(&mut habitats, &frame(colours, u64::from(k)), 2.0 * f64::from(k));
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
    fn a_cluster_with_few_cells_of_a_label_does_not_take_it() {
        let mut habitats = Habitats::new(16);
        let places: Vec<(i32, i32)> = (0..100).map(|x| (0, x)).collect();
        habitats.clustered = places.iter().map(|&place| (place, u32::from(place.1 >= 40))).collect();
        habitats.next = 2;
        // The first holds nearly all of label 1, the second a third of label 0, and the third the rest of it.
        let of_cells = [vec![1; 13], vec![2; 32], vec![0; 55]].concat();
        let found = Clusters { centres: vec![Vec::new(); 3], of_cells };
        assert_eq!(habitats.numbered(&places, &found), [1, 2, 0]);
        // What holds cells of two labels keeps the number of which it holds more.
        let found = Clusters { centres: vec![Vec::new(); 1], of_cells: vec![0; 60] };
        assert_eq!(habitats.numbered(&places[20..80], &found), [1]);
    }

    #[test]
    fn a_uniform_floor_has_one_label() {
        assert_eq!(fly([[150, 140, 110]; 2], &[0, 1, 2, 3]).labels(), 1);
    }

    /// The most frequent label of the west and of the east of a floor of stones as large as cells, which are redder in the east by `tint`.
    fn stones(tint: i32) -> ([u32; 2], usize) {
        let mut habitats = Habitats::new(16);
        for k in 0..20u32 {
            let image = RgbImage::from_fn(320, 240, |x, y| {
                let grey =
                    (crate::random::mix(u64::from(x / 9) | u64::from((y + 80 * (99 - k)) / 9) << 32) % 80) as i32;
                let red = 100 + grey + if x < 160 { 0 } else { tint };
                image::Rgb([red as u8, (90 + grey) as u8, (80 + grey) as u8])
            });
            see(&mut habitats, &image, 2.0 * f64::from(k));
        }
        habitats.correct();
        let most = |columns: std::ops::Range<i32>| {
            let mut counts = BTreeMap::<u32, usize>::new();
            let cells = columns.flat_map(|x| (0..150).map(move |y| (x, y)));
            cells.filter_map(|(x, y)| habitats.label_at(x, y)).for_each(|label| *counts.entry(label).or_default() += 1);
            counts.into_iter().max_by_key(|&(_, count)| count).map_or(u32::MAX, |(label, _)| label)
        };
        ([most(-14..-2), most(2..14)], habitats.labels())
    }

    #[test]
    fn habitats_are_separated_although_their_neighbours_differ_too() {
        let ([west, east], _) = stones(7);
        assert_ne!(west, east);
        assert_eq!(stones(0).1, 1);
    }

    #[test]
    fn numbers_stay_when_more_is_seen() {
        let colours = [[160, 150, 120], [60, 90, 50]];
        let (mut few, many) = (fly(colours, &[0, 1, 2]), fly(colours, &[0, 1, 2, 7, 8, 9]));
        let shown = |habitats: &Habitats| (-9..9).map(|x| habitats.label_at(x, 3)).collect::<Vec<_>>();
        let before = shown(&few);
        few.samples = many.samples.clone();
        few.learn();
        assert_eq!(shown(&few), before);
        assert!(few.label_at(-8, 60).is_some() && few.label_at(-8, 60) == few.label_at(-8, 3));
    }

    #[test]
    fn a_new_cell_has_the_label_of_its_like_at_once() {
        let colours = [[160, 150, 120], [60, 90, 50]];
        let mut habitats = fly(colours, &[0, 1, 2]);
        see(&mut habitats, &frame(colours, 77), 90.0);
        assert_eq!(habitats.label_at(-8, 360), None);
        habitats.label_new();
        assert_eq!(habitats.label_at(-8, 360), habitats.label_at(-8, 3));
    }
}
