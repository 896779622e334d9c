//! The parameters of the model and their ranges.

use serde::{Deserialize, Serialize};

/// The weight of a new label: three readings of `gamma`.
///
/// V is the size of the vocabulary.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Birth {
    /// `gamma` itself, as in the text of the paper.
    #[default]
    Literal,
    /// `gamma / V`, the exact collapsed likelihood of a word under a new label.
    Collapsed,
    /// `alpha * gamma / V`, as in the published ROST code.
    Rost,
}

/// The parameters of a [`SceneModel`](super::SceneModel).
///
/// ```
/// use scene_model::topics::SceneConfig;
///
/// let config = SceneConfig { cell_m: [0.5, 0.5, 1e4], max_labels: 32, seed: 7, ..SceneConfig::for_images() };
/// config.check()?;
///
/// let error = SceneConfig { beta: 0.0, ..config }.check().unwrap_err();
/// assert_eq!(error.to_string(), "beta = 0: allowed is 1e-12 to 1e9");
/// # Ok::<(), scene_model::topics::ConfigError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SceneConfig {
    /// Edges of a cell in x, y and z, metres: 1e-12 to 1e9. The default height of 10 km makes the world flat.
    pub cell_m: [f64; 3],
    /// Prior count of each label in each cell: 1e-12 to 1e9.
    pub alpha: f64,
    /// Prior count of each word under each label: 1e-12 to 1e9.
    pub beta: f64,
    /// Weight of a new label in the reading of `birth`: 0 to 1e9. With 0 the first label stays the only one.
    pub gamma: f64,
    /// How `gamma` becomes the weight of a new label.
    pub birth: Birth,
    /// The maximum number of labels at one time (K): 1 to 1024. The table of V x K counts may hold at most 2^28.
    pub max_labels: u32,
    /// The number of different words (V): 1 to 2^20.
    pub vocabulary: u32,
    /// Levels of the colour lattice behind the first words, for the appearance affinity: 0 to 64, its cube at most
    /// `vocabulary`.
    ///
    /// Word ids below the cube of this number are colours, (L x levels + a) x levels + b, and neighbours of a similar
    /// colour weigh more. It is 8 for the words of a [`WordExtractor`](crate::words::WordExtractor). With 0 all
    /// neighbours weigh the same, as in the paper.
    pub colour_levels: u32,
    /// The maximum number of words in one cell, 1 to 65535; [`insert`](super::SceneModel::insert) skips later ones.
    pub max_words_per_cell: u32,
    /// The seed of every random draw.
    pub seed: u64,
}

impl Default for SceneConfig {
    fn default() -> Self {
        Self {
            cell_m: [0.25, 0.25, 1e4],
            alpha: 0.01,
            beta: 0.1,
            gamma: 1e-4,
            birth: Birth::Literal,
            max_labels: 16,
            vocabulary: crate::words::WordConfig::default().vocabulary_size(),
            colour_levels: 0,
            max_words_per_cell: 256,
            seed: 1,
        }
    }
}

/// A parameter is out of its range.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[error("{key} = {value}: allowed is {allowed}")]
pub struct ConfigError {
    /// The name of the field of [`SceneConfig`].
    pub key: &'static str,
    /// The refused value, as text.
    pub value: String,
    /// The allowed range, as text.
    pub allowed: &'static str,
}

pub(crate) const MAX_LABELS: u32 = 1024;
pub(crate) const MAX_VOCABULARY: u32 = 1 << 20;
const MAX_TABLE: u64 = 1 << 28;

impl SceneConfig {
    /// The defaults for the words of a [`WordExtractor`](crate::words::WordExtractor): with appearance affinity.
    #[must_use]
    pub fn for_images() -> Self {
        Self { colour_levels: crate::words::COLOUR_LEVELS, ..Self::default() }
    }

    /// Checks all ranges; the error names the first parameter that is out of its range.
    pub fn check(&self) -> Result<(), ConfigError> {
        for edge in self.cell_m {
            positive("cell_m", edge)?;
        }
        positive("alpha", self.alpha)?;
        positive("beta", self.beta)?;
        if !(self.gamma.is_finite() && (0.0..=1e9).contains(&self.gamma)) {
            return Err(refuse("gamma", self.gamma, "0 to 1e9"));
        }
        within("max_labels", self.max_labels, MAX_LABELS, "1 to 1024")?;
        within("vocabulary", self.vocabulary, MAX_VOCABULARY, "1 to 1048576")?;
        if u64::from(self.vocabulary) * u64::from(self.max_labels) > MAX_TABLE {
            return Err(refuse("max_labels", self.max_labels, "at most 2^28 / vocabulary (a table of 1 GB)"));
        }
        let levels = u64::from(self.colour_levels);
        if levels > 64 || levels.pow(3) > u64::from(self.vocabulary) {
            return Err(refuse("colour_levels", levels, "0 to 64, and its cube at most vocabulary"));
        }
        within("max_words_per_cell", self.max_words_per_cell, 65_535, "1 to 65535")
    }

    /// The weight of a new label in the configured reading.
    pub(crate) fn birth_weight(&self) -> f64 {
        match self.birth {
            Birth::Literal => self.gamma,
            Birth::Collapsed => self.gamma / f64::from(self.vocabulary),
            Birth::Rost => self.alpha * self.gamma / f64::from(self.vocabulary),
        }
    }
}

fn positive(key: &'static str, value: f64) -> Result<(), ConfigError> {
    if (1e-12..=1e9).contains(&value) { Ok(()) } else { Err(refuse(key, value, "1e-12 to 1e9")) }
}

fn within(key: &'static str, value: u32, max: u32, allowed: &'static str) -> Result<(), ConfigError> {
    if (1..=max).contains(&value) { Ok(()) } else { Err(refuse(key, value, allowed)) }
}

fn refuse(key: &'static str, value: impl ToString, allowed: &'static str) -> ConfigError {
    ConfigError { key, value: value.to_string(), allowed }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn error_names_the_parameter_and_its_range() {
        let config = SceneConfig { beta: f64::NAN, ..SceneConfig::default() };
        assert_eq!(config.check().unwrap_err().to_string(), "beta = NaN: allowed is 1e-12 to 1e9");
        let config = SceneConfig { max_labels: 0, ..SceneConfig::default() };
        assert_eq!(config.check().unwrap_err().key, "max_labels");
    }

    #[test]
    fn defaults_are_in_range() {
        SceneConfig::default().check().unwrap();
    }
}
