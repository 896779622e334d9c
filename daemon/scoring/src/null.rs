//! The score of a map, and its spatial null model.
//!
//! On a small scene, mutual information alone is misleading: any map made of patches has some mutual information with
//! any annotation made of patches. The null model is the mean over the same map flipped in 3 ways and shifted on a
//! torus by 12 large distances. The excess over it is due to the scene.

use crate::annotations::Annotations;
use crate::label_grid::LabelGrid;
use crate::mutual_information::MutualInformation;

/// The agreement of a label map with annotations.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct SceneScore {
    /// Mutual information of map labels and annotated classes, cell by cell.
    pub mutual_information: MutualInformation,
    /// The mean mutual information of the flipped and shifted maps, nats.
    pub null_nats: f64,
    /// Mutual information minus `null_nats`, nats.
    pub excess_nats: f64,
    /// The number of different labels in the map.
    pub labels: usize,
}

/// Scores a map against annotations on the same cells. Cells without a label or without an annotation are ignored.
#[must_use]
pub fn score(map: &LabelGrid, annotations: &Annotations) -> SceneScore {
    let dense = Dense::new(map, annotations);
    let mutual_information = dense.score(|x, y| (x, y));
    let (columns, rows) = (annotations.columns, annotations.rows);
    let flips = [(true, false), (false, true), (true, true)];
    let flip = |on: bool, i: usize, length: usize| if on { length - 1 - i } else { i };
    let of_flips =
        flips.map(|(h, v)| dense.score(|x, y| (flip(h, x, columns), flip(v, y, rows))).nats).into_iter().sum::<f64>();
    let mut of_shifts = 0.0;
    for (right, down) in (0..4).flat_map(|i| (0..3).map(move |j| (3 + 2 * i, 3 + 3 * j))) {
        let shift = |i: usize, twelfths: usize, length: usize| (i + twelfths * length / 12) % length;
        of_shifts += dense.score(|x, y| (shift(x, right, columns), shift(y, down, rows))).nats;
    }
    let null_nats = (of_flips + of_shifts) / 15.0;
    let excess_nats = mutual_information.nats - null_nats;
    SceneScore { mutual_information, null_nats, excess_nats, labels: dense.labels }
}

/// A map whose labels are numbered from 0, and the annotations.
struct Dense<'a> {
    annotations: &'a Annotations,
    map: Vec<Option<usize>>,
    labels: usize,
}

impl<'a> Dense<'a> {
    fn new(map: &LabelGrid, annotations: &'a Annotations) -> Self {
        let mut names: Vec<u32> = map.labels.iter().copied().flatten().collect();
        names.sort_unstable();
        names.dedup();
        let (columns, rows) = (annotations.columns, annotations.rows);
        let label = |cell: usize| {
            let (x, y) = (cell % columns, cell / columns);
            let label = (x < map.columns && y < map.rows).then(|| map.labels[y * map.columns + x])??;
            names.binary_search(&label).ok()
        };
        Self { annotations, map: (0..columns * rows).map(label).collect(), labels: names.len() }
    }

    /// The mutual information of the annotations at (x, y) with the map at `from(x, y)`.
    fn score(&self, from: impl Fn(usize, usize) -> (usize, usize)) -> MutualInformation {
        let (columns, classes) = (self.annotations.columns, self.annotations.classes);
        let mut joint = vec![0u64; self.labels * classes];
        for cell in 0..self.map.len() {
            let (x, y) = from(cell % columns, cell / columns);
            if let (Some(label), Some(class)) = (self.map[y * columns + x], self.annotations.of_cells[cell]) {
                joint[label * classes + usize::from(class)] += 1;
            }
        }
        MutualInformation::of_table(&joint, classes)
    }
}
