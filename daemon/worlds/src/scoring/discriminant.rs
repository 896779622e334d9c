//! Linear discriminant analysis of the measures behind visual words (Fisher 1936; Rao 1948), from annotated images.

use image::RgbImage;
use nalgebra::{Cholesky, DMatrix, DVector, SymmetricEigen};
use scene_model::words::{
    Discriminant, DiscriminantError, FEATURES, MAX_DIRECTIONS, MEASURES, MeasuredPlace, WordConfig, WordExtractor,
};
use std::collections::BTreeMap;

use super::annotations::Annotations;
use super::baselines::cluster_centres;

/// The minimum number of annotated cells of a class that directions are learnt from.
pub const MIN_CLASS_CELLS: u64 = 20;
/// The share of the mean variance of a feature that is added to the variance of each within a class, so that features
/// that hardly vary have no large weights.
const RIDGE: f64 = 0.05;
/// The number of prototypes, each of which is a word.
const PROTOTYPES: usize = 256;
/// Of this many places of an image, one is kept for the prototypes; a prime, so that all columns are met.
const SAMPLE_STEP: usize = 13;
/// The maximum number of places that prototypes are learnt from.
const MAX_SAMPLE: usize = 20_000;
/// The number of products of two features, squares included.
const PRODUCTS: usize = FEATURES * (FEATURES + 1) / 2;

/// The first and second moments of the features of each class, over one or more annotated images, and a sample of their
/// places.
///
/// Each image is compared with its own tones, means and deviations, as a mission is with its first frames. A class has
/// the same number in all images. At most 256 classes take 45 kB each, and a 13th of the places 52 bytes each.
#[derive(Clone, Debug, Default)]
pub struct ClassStatistics {
    classes: BTreeMap<u8, ClassMoments>,
    sample: Vec<[f32; MEASURES]>,
}

#[derive(Clone, Debug)]
struct ClassMoments {
    cells: u64,
    places: f64,
    sums: Vec<f64>,
    /// The lower triangle of the sum of outer products, row by row.
    products: Vec<f64>,
}

/// Directions cannot be learnt from the annotations.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DiscriminantTrainingError {
    /// Fewer than two classes have enough cells.
    #[error("{found}; at least two classes with {MIN_CLASS_CELLS} annotated cells each are needed")]
    FewClasses {
        /// The classes with their numbers of cells, as text.
        found: String,
    },
    /// The classes do not differ in any measure, or the measures are not finite.
    #[error("the classes do not differ in any measure")]
    Alike,
    /// The scene model refuses the directions that were found.
    #[error(transparent)]
    Directions(#[from] DiscriminantError),
}

impl ClassStatistics {
    /// Measures an image with the class of each of its cells; `cell_px` is the edge of a cell, pixels.
    #[must_use]
    pub fn of(image: &RgbImage, cell_px: f32, annotations: &Annotations) -> Self {
        let mut statistics = Self::default();
        for class in annotations.of_cells.iter().copied().flatten() {
            statistics.class(class).cells += 1;
        }
        let places = WordExtractor::new(&WordConfig::default()).measure(image, cell_px);
        statistics.sample.extend(places.iter().step_by(SAMPLE_STEP).map(|place| place.scores));
        for place in places {
            let column = ((place.u / cell_px) as usize).min(annotations.columns - 1);
            let row = ((place.v / cell_px) as usize).min(annotations.rows - 1);
            if let Some(class) = annotations.of_cells[row * annotations.columns + column] {
                statistics.class(class).add_place(&place);
            }
        }
        statistics
    }

    /// Adds the statistics of other images.
    pub fn add(&mut self, other: &Self) {
        for (&class, moments) in &other.classes {
            self.class(class).add(moments);
        }
        self.sample.extend_from_slice(&other.sample);
    }

    /// Returns the classes with fewer than [`MIN_CLASS_CELLS`] cells, which are left out, with their numbers of cells.
    pub fn rare_classes(&self) -> impl Iterator<Item = (u8, u64)> {
        self.classes.iter().map(|(&class, of)| (class, of.cells)).filter(|of| of.1 < MIN_CLASS_CELLS)
    }

    /// Returns the number of classes that directions are learnt from.
    #[must_use]
    pub fn usable_classes(&self) -> usize {
        self.usable().count()
    }

    /// Returns the directions in which the classes differ most, relative to their spread, with 256 prototypes of the
    /// sampled places along them.
    ///
    /// There is one direction fewer than there are usable classes, and at most [`MAX_DIRECTIONS`]. The same images in
    /// the same order give the same discriminant.
    pub fn discriminant(&self) -> Result<Discriminant, DiscriminantTrainingError> {
        let classes: Vec<&ClassMoments> = self.usable().collect();
        if classes.len() < 2 {
            let of = |(class, of): (&u8, &ClassMoments)| format!("class {class} has {} annotated cells", of.cells);
            let found: Vec<String> = self.classes.iter().map(of).collect();
            let found = if found.is_empty() { "no cell is annotated".to_owned() } else { found.join(", ") };
            return Err(DiscriminantTrainingError::FewClasses { found });
        }
        let (mut within, between) = scatter(&classes);
        let ridge = RIDGE * within.trace() / FEATURES as f64;
        (0..FEATURES).for_each(|i| within[(i, i)] += ridge);
        let directions = leading(within, &between, (classes.len() - 1).min(MAX_DIRECTIONS));
        let directions = directions.ok_or(DiscriminantTrainingError::Alike)?;
        Ok(Discriminant::new(&directions, &self.prototypes(&directions)?)?)
    }

    fn prototypes(&self, directions: &[[f32; FEATURES]]) -> Result<Vec<Vec<f32>>, DiscriminantError> {
        let width = directions.len();
        let along = Discriminant::new(directions, &[vec![0.0; width]])?;
        let mut points = Vec::new();
        for &scores in self.sample.iter().step_by(self.sample.len().div_ceil(MAX_SAMPLE).max(1)) {
            let coordinates = along.coordinates(&MeasuredPlace { u: 0.0, v: 0.0, scores });
            points.extend_from_slice(&coordinates[..width]);
        }
        Ok(cluster_centres(&points, width, PROTOTYPES, 1).chunks_exact(width).map(<[f32]>::to_vec).collect())
    }

    fn usable(&self) -> impl Iterator<Item = &ClassMoments> {
        self.classes.values().filter(|class| class.cells >= MIN_CLASS_CELLS && class.places > 0.0)
    }

    fn class(&mut self, class: u8) -> &mut ClassMoments {
        self.classes.entry(class).or_insert_with(|| ClassMoments {
            cells: 0,
            places: 0.0,
            sums: vec![0.0; FEATURES],
            products: vec![0.0; PRODUCTS],
        })
    }
}

impl ClassMoments {
    fn add_place(&mut self, place: &MeasuredPlace) {
        let features = place.features().map(f64::from);
        self.places += 1.0;
        self.sums.iter_mut().zip(&features).for_each(|(sum, feature)| *sum += feature);
        let mut rest = self.products.as_mut_slice();
        for (i, one) in features.iter().enumerate() {
            let (row, below) = rest.split_at_mut(i + 1);
            row.iter_mut().zip(&features).for_each(|(sum, other)| *sum += one * other);
            rest = below;
        }
    }

    fn add(&mut self, other: &Self) {
        self.cells += other.cells;
        self.places += other.places;
        self.sums.iter_mut().zip(&other.sums).for_each(|(sum, more)| *sum += more);
        self.products.iter_mut().zip(&other.products).for_each(|(sum, more)| *sum += more);
    }

    fn mean(&self) -> DVector<f64> {
        DVector::from_iterator(FEATURES, self.sums.iter().map(|sum| sum / self.places))
    }
}

/// The covariances within the classes and between their means, each class as heavy as its places are many.
fn scatter(classes: &[&ClassMoments]) -> (DMatrix<f64>, DMatrix<f64>) {
    let places: f64 = classes.iter().map(|class| class.places).sum();
    let mut centre = DVector::zeros(FEATURES);
    classes.iter().for_each(|class| centre += class.mean() * (class.places / places));
    let (mut within, mut between) = (DMatrix::zeros(FEATURES, FEATURES), DMatrix::zeros(FEATURES, FEATURES));
    for class in classes {
        let mean = class.mean();
        let mut next = class.products.iter();
        for (i, j) in (0..FEATURES).flat_map(|i| (0..=i).map(move |j| (i, j))) {
            let covariance = next.next().unwrap_or(&0.0) / places - mean[i] * mean[j] * (class.places / places);
            within[(i, j)] += covariance;
            within[(j, i)] = within[(i, j)];
        }
        let from_centre = &mean - &centre;
        between.ger(class.places / places, &from_centre, &from_centre, 1.0);
    }
    (within, between)
}

/// The first `count` solutions w of `between` w = lambda `within` w with w' `within` w = 1, by falling lambda; `None`
/// if no lambda is above 0. The largest weight of each is positive.
fn leading(within: DMatrix<f64>, between: &DMatrix<f64>, count: usize) -> Option<Vec<[f32; FEATURES]>> {
    let lower = Cholesky::new(within)?.l();
    let half = lower.solve_lower_triangular(between)?;
    let whitened = lower.solve_lower_triangular(&half.transpose())?;
    let eigen = SymmetricEigen::new((&whitened + whitened.transpose()) * 0.5);
    let mut order: Vec<usize> = (0..FEATURES).filter(|&i| eigen.eigenvalues[i] > 1e-9).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    let direction = |&i: &usize| {
        let weights = lower.tr_solve_lower_triangular(&eigen.eigenvectors.column(i).into_owned())?;
        let largest = weights.iter().copied().max_by(|a, b| a.abs().total_cmp(&b.abs()))?;
        Some(std::array::from_fn(|feature| (weights[feature] * largest.signum()) as f32))
    };
    let directions: Option<Vec<_>> = order.iter().take(count).map(direction).collect();
    directions.filter(|directions| !directions.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::patches;
    use image::GrayImage;

    /// The statistics of a drawn sea floor with its habitats as classes, those in `ignore` left out.
    fn statistics(seed: u64, ignore: &[u8]) -> ClassStatistics {
        let world = patches(seed, 320, 240, 60, 4);
        let classes = GrayImage::from_raw(world.width, world.height, world.truth).unwrap();
        let annotations = Annotations::new(&classes, (world.width, world.height), 16.0, ignore).unwrap();
        ClassStatistics::of(&world.image, 16.0, &annotations)
    }

    #[test]
    fn directions_are_one_fewer_than_the_classes() {
        let mut all = statistics(1, &[]);
        all.add(&statistics(2, &[]));
        assert!(all.usable_classes() > 2);
        let discriminant = all.discriminant().unwrap();
        assert_eq!((discriminant.directions(), discriminant.vocabulary_size()), (all.usable_classes() - 1, 256));
        assert_eq!(all.discriminant().unwrap(), discriminant);
    }

    #[test]
    fn annotations_without_two_large_classes_are_refused() {
        let all = statistics(1, &[]);
        let largest = all.classes.iter().max_by_key(|class| class.1.cells).map(|class| *class.0).unwrap();
        let others: Vec<u8> = (0..=u8::MAX).filter(|&class| class != largest).collect();
        let one = statistics(1, &others).discriminant().unwrap_err().to_string();
        assert!(one.starts_with(&format!("class {largest} has ")) && one.contains("at least two classes"), "{one}");
        let none = ClassStatistics::default().discriminant().unwrap_err().to_string();
        assert!(none.starts_with("no cell is annotated; at least two"), "{none}");
    }

    #[test]
    fn the_leading_direction_separates_two_shifted_clouds() {
        let mut within = DMatrix::identity(FEATURES, FEATURES);
        within[(4, 4)] = 0.01;
        let mut between = DMatrix::zeros(FEATURES, FEATURES);
        let shift = DVector::from_fn(FEATURES, |i, _| if i == 3 || i == 4 { 1.0 } else { 0.0 });
        between.ger(1.0, &shift, &shift, 0.0);
        let directions = leading(within, &between, 5).unwrap();
        assert_eq!(directions.len(), 1);
        // The weights are the shift over the variance.
        assert!((directions[0][4] / directions[0][3] - 100.0).abs() < 1e-3 && directions[0][4] > 0.0);
        assert!(leading(DMatrix::identity(FEATURES, FEATURES), &DMatrix::zeros(FEATURES, FEATURES), 5).is_none());
    }
}
