//! Discriminant words: places described along directions in which annotated classes differ, quantised to the nearest of
//! learnt prototypes.
//!
//! Directions and prototypes are learnt before the mission ([`Discriminant`]); without them there are no such words. They
//! act on the z-scores of the measures behind the other words, and on the products of these.

use serde::{Deserialize, Serialize};

use super::config::Word;

/// The number of measures of a place: L, a, b; mean L, a, b and contrast of its context; deviations of L, a and b;
/// Gabor energy at three scales.
pub const MEASURES: usize = 13;
/// The number of features of a place: its measures, and the product of each pair of them, squares included.
pub const FEATURES: usize = MEASURES + MEASURES * (MEASURES + 1) / 2;
/// The maximum number of directions of a [`Discriminant`].
pub const MAX_DIRECTIONS: usize = 8;
/// The maximum number of prototypes of a [`Discriminant`].
pub const MAX_PROTOTYPES: usize = 1024;

/// Scores beyond this many deviations count as this many in products, so that outliers do not decide a word.
const REACH: f32 = 3.0;
/// The maximum magnitude of a weight and of a coordinate of a prototype.
const MAX_NUMBER: f32 = 1e6;
/// Prototypes that are compared at once.
const LANES: usize = 8;

/// A position in a frame with the z-scores of its [`MEASURES`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeasuredPlace {
    /// Distance from the left edge of the frame, pixels.
    pub u: f32,
    /// Distance from the top edge of the frame, pixels.
    pub v: f32,
    /// The z-scores of the measures, in the order of [`MEASURES`].
    pub scores: [f32; MEASURES],
}

impl MeasuredPlace {
    /// Returns the features that directions weigh: the scores, then the products of the scores i and j with i <= j,
    /// in the order of i, then j.
    #[must_use]
    pub fn features(&self) -> [f32; FEATURES] {
        let mut features = [0.0; FEATURES];
        features[..MEASURES].copy_from_slice(&self.scores);
        let bounded = self.scores.map(|score| score.clamp(-REACH, REACH));
        let mut next = MEASURES;
        for (i, &one) in bounded.iter().enumerate() {
            for &other in &bounded[i..] {
                features[next] = one * other;
                next += 1;
            }
        }
        features
    }
}

/// Directions along which annotated classes differ, and prototypes along them: one word for each prototype.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Stored", into = "Stored")]
pub struct Discriminant {
    directions: usize,
    /// The weights of the directions in each feature; beyond `directions` 0.
    weights: Vec<[f32; MAX_DIRECTIONS]>,
    prototypes: usize,
    blocks: Vec<Block>,
}

/// Prototypes side by side, and minus half of the square of the length of each; unused lanes are infinitely far.
#[derive(Clone, Debug, PartialEq)]
struct Block {
    coordinates: [[f32; LANES]; MAX_DIRECTIONS],
    negative_half_square: [f32; LANES],
}

/// The numbers of a discriminant, row by row: a row for each direction with its weights, one for each prototype with its
/// coordinates.
#[derive(Serialize, Deserialize)]
struct Stored {
    directions: u8,
    weights: Vec<f32>,
    prototypes: Vec<f32>,
}

/// The directions or the prototypes are too few, too many, or not usable numbers; the text names the cause.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct DiscriminantError(&'static str);

impl Discriminant {
    /// Returns the discriminant with these directions and with prototypes of one coordinate for each direction.
    ///
    /// There are 1 to [`MAX_DIRECTIONS`] directions and 1 to [`MAX_PROTOTYPES`] prototypes; all numbers are finite, and
    /// at most 1e6 in magnitude.
    pub fn new(directions: &[[f32; FEATURES]], prototypes: &[Vec<f32>]) -> Result<Self, DiscriminantError> {
        if prototypes.iter().any(|prototype| prototype.len() != directions.len()) {
            return Err(DiscriminantError("a prototype has not one coordinate for each direction"));
        }
        let count = u8::try_from(directions.len()).unwrap_or(u8::MAX);
        let weights = directions.as_flattened().to_vec();
        Self::try_from(Stored { directions: count, weights, prototypes: prototypes.concat() })
    }

    /// Returns the number of directions.
    #[must_use]
    pub fn directions(&self) -> usize {
        self.directions
    }

    /// Returns the number of different words, one for each prototype.
    #[must_use]
    pub fn vocabulary_size(&self) -> u32 {
        self.prototypes as u32
    }

    /// Returns the coordinates of a place along the directions; beyond their number they are 0.
    #[must_use]
    pub fn coordinates(&self, place: &MeasuredPlace) -> [f32; MAX_DIRECTIONS] {
        // One sum for each direction, in the order of the features, so that it is the same on every machine.
        let mut sums = [0.0f32; MAX_DIRECTIONS];
        for (feature, weights) in place.features().iter().zip(&self.weights) {
            sums.iter_mut().zip(weights).for_each(|(sum, weight)| *sum += feature * weight);
        }
        sums
    }

    /// Appends a word for each place.
    pub(super) fn extract(&self, places: impl Iterator<Item = MeasuredPlace>, first_id: u32, words: &mut Vec<Word>) {
        words.extend(places.map(|place| {
            let id = first_id + self.nearest(&self.coordinates(&place));
            Word { id, u: place.u, v: place.v }
        }));
    }

    /// The nearest prototype; of equally near ones the first.
    fn nearest(&self, coordinates: &[f32; MAX_DIRECTIONS]) -> u32 {
        // The best block of each lane, and its nearness: half of the square of the place's length minus half of the
        // squared distance.
        let (mut blocks, mut nearness) = ([0u32; LANES], [f32::NEG_INFINITY; LANES]);
        for (index, block) in (0..).zip(&self.blocks) {
            let mut lanes = block.negative_half_square;
            for (coordinate, row) in coordinates.iter().zip(&block.coordinates) {
                lanes.iter_mut().zip(row).for_each(|(lane, other)| *lane += coordinate * other);
            }
            for lane in 0..LANES {
                let is_nearer = lanes[lane] > nearness[lane];
                nearness[lane] = if is_nearer { lanes[lane] } else { nearness[lane] };
                blocks[lane] = if is_nearer { index } else { blocks[lane] };
            }
        }
        let (mut best, mut highest) = (0, f32::NEG_INFINITY);
        for (lane, (block, near)) in (0..).zip(blocks.into_iter().zip(nearness)) {
            let prototype = block * LANES as u32 + lane;
            if near > highest || (near == highest && prototype < best) {
                (best, highest) = (prototype, near);
            }
        }
        // Coordinates that are not finite have no nearest prototype.
        if highest > f32::NEG_INFINITY { best } else { 0 }
    }

    fn stored(&self) -> Stored {
        let lane = |prototype: usize, direction: usize| {
            self.blocks[prototype / LANES].coordinates[direction][prototype % LANES]
        };
        let rows = |count: usize, of: &dyn Fn(usize) -> Vec<f32>| (0..count).flat_map(of).collect();
        Stored {
            directions: self.directions as u8,
            weights: rows(self.directions, &|i| self.weights.iter().map(|weights| weights[i]).collect()),
            prototypes: rows(self.prototypes, &|k| (0..self.directions).map(|i| lane(k, i)).collect()),
        }
    }
}

impl From<Discriminant> for Stored {
    fn from(of: Discriminant) -> Self {
        of.stored()
    }
}

impl TryFrom<Stored> for Discriminant {
    type Error = DiscriminantError;

    fn try_from(Stored { directions, weights, prototypes }: Stored) -> Result<Self, DiscriminantError> {
        let directions = usize::from(directions);
        if !(1..=MAX_DIRECTIONS).contains(&directions) || weights.len() != directions * FEATURES {
            return Err(DiscriminantError("a discriminant has 1 to 8 directions with 104 weights each"));
        }
        let count = prototypes.len() / directions;
        if !(1..=MAX_PROTOTYPES).contains(&count) || prototypes.len() != count * directions {
            return Err(DiscriminantError("a discriminant has 1 to 1024 prototypes"));
        }
        if !weights.iter().chain(&prototypes).all(|number| number.abs() <= MAX_NUMBER) {
            return Err(DiscriminantError("a number of the discriminant is not finite or above 1e6"));
        }
        let row = |feature: usize| {
            let weight = |i: usize| weights.get(i * FEATURES + feature).copied().unwrap_or(0.0);
            std::array::from_fn(weight)
        };
        let blocks = prototypes.chunks(LANES * directions).map(|some| Block::new(some, directions)).collect();
        Ok(Self { directions, weights: (0..FEATURES).map(row).collect(), prototypes: count, blocks })
    }
}

impl Block {
    fn new(prototypes: &[f32], directions: usize) -> Self {
        let mut block =
            Self { coordinates: [[0.0; LANES]; MAX_DIRECTIONS], negative_half_square: [f32::NEG_INFINITY; LANES] };
        for (lane, prototype) in prototypes.chunks_exact(directions).enumerate() {
            block.negative_half_square[lane] = -0.5 * prototype.iter().map(|x| x * x).sum::<f32>();
            prototype.iter().zip(&mut block.coordinates).for_each(|(&x, row)| row[lane] = x);
        }
        block
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn direction(feature: usize) -> [f32; FEATURES] {
        std::array::from_fn(|i| if i == feature { 1.0 } else { 0.0 })
    }

    fn place(scores: &[(usize, f32)]) -> MeasuredPlace {
        let mut place = MeasuredPlace { u: 3.0, v: 4.0, scores: [0.0; MEASURES] };
        scores.iter().for_each(|&(measure, score)| place.scores[measure] = score);
        place
    }

    #[test]
    fn features_are_scores_and_their_products() {
        let place = place(&[(0, 2.0), (1, -0.5), (12, 9.0)]);
        let features = place.features();
        assert_eq!(features[..MEASURES], place.scores);
        // The square of the first score, its product with the second, and the square of the last, which is bounded.
        assert_eq!((features[MEASURES], features[MEASURES + 1], features[FEATURES - 1]), (4.0, -1.0, 9.0));
    }

    #[test]
    fn a_place_has_the_word_of_the_nearest_prototype() {
        let grid: Vec<Vec<f32>> = (0..100).map(|i| vec![(i % 10) as f32, (i / 10) as f32]).collect();
        let discriminant = Discriminant::new(&[direction(5), direction(11)], &grid).unwrap();
        assert_eq!((discriminant.directions(), discriminant.vocabulary_size()), (2, 100));
        let mut words = Vec::new();
        let places = [place(&[(5, 2.1), (11, 6.8)]), place(&[(5, -50.0), (11, 9.4)]), place(&[(4, 7.0)])];
        discriminant.extract(places.into_iter(), 1000, &mut words);
        assert_eq!(words.iter().map(|word| word.id).collect::<Vec<_>>(), [1072, 1090, 1000]);
        assert_eq!((words[0].u, words[0].v), (3.0, 4.0));
    }

    #[test]
    fn a_stored_discriminant_is_the_same() {
        let prototypes: Vec<Vec<f32>> = (0..13).map(|i| vec![i as f32 * 0.1, 1.0, -2.0]).collect();
        let discriminant = Discriminant::new(&[direction(0), direction(50), direction(103)], &prototypes).unwrap();
        let bytes = postcard::to_allocvec(&discriminant).unwrap();
        assert_eq!(postcard::from_bytes::<Discriminant>(&bytes).unwrap(), discriminant);
    }

    #[test]
    fn unusable_directions_and_prototypes_are_refused() {
        let one = [vec![0.0]];
        assert!(Discriminant::new(&[], &[]).is_err());
        assert!(Discriminant::new(&[direction(0)], &[]).is_err());
        assert!(Discriminant::new(&[direction(0)], &vec![vec![0.0]; MAX_PROTOTYPES + 1]).is_err());
        assert!(Discriminant::new(&[direction(0); MAX_DIRECTIONS + 1], &[vec![0.0; MAX_DIRECTIONS + 1]]).is_err());
        assert!(Discriminant::new(&[direction(0); 2], &one).is_err());
        for wrong in [f32::NAN, f32::INFINITY, 2e6] {
            let mut weights = direction(0);
            weights[50] = wrong;
            assert!(
                Discriminant::new(&[weights], &one).is_err()
                    && Discriminant::new(&[direction(1)], &[vec![wrong]]).is_err()
            );
        }
        let short = Stored { directions: 1, weights: vec![0.0; 5], prototypes: vec![0.0] };
        assert!(postcard::from_bytes::<Discriminant>(&postcard::to_allocvec(&short).unwrap()).is_err());
    }
}
