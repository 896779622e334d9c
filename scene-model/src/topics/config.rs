//! The parameters of the model and their ranges.

use serde::{Deserialize, Serialize};

/// Which reading of the weight of a new label is used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Birth {
    /// gamma, as the words of the paper say.
    #[default]
    Literal,
    /// gamma / V, the exact collapsed likelihood of a word under a new label.
    Collapsed,
    /// alpha * gamma / V, as the published ROST code has it.
    Rost,
}

/// Parameters of a [`SceneModel`](super::SceneModel).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SceneConfig {
    /// Edges of a cell in x, y, z: metres, above 0. The default height makes the world flat.
    pub cell_m: [f64; 3],
    /// Prior count of each label in each cell: above 0.
    pub alpha: f64,
    /// Prior count of each word under each label: above 0.
    pub beta: f64,
    /// Weight of a new label, read as `birth` says: 0 (no births after the first) or above.
    pub gamma: f64,
    /// Reading of `gamma`.
    pub birth: Birth,
    /// Most labels at one time: 1 to 1024.
    pub max_labels: u32,
    /// Number of different words: 1 to 2^20.
    pub vocabulary: u32,
    /// Words below the cube of this are points of a lattice of colours, and neighbours that look alike count more, as
    /// [`crate::words::COLOUR_LEVELS`] says of the words of images; 0: all neighbours count alike, as in the paper.
    pub colour_levels: u32,
    /// Words kept in one cell, later ones are skipped: 1 to 65535.
    pub max_words_per_cell: u32,
    /// Seed of every random choice.
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

/// A parameter out of its range.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{key} = {value}: allowed is {allowed}")]
pub struct ConfigError {
    /// Name of the parameter.
    pub key: &'static str,
    /// What it was set to.
    pub value: String,
    /// What it may be.
    pub allowed: &'static str,
}

pub(crate) const MAX_LABELS: u32 = 1024;
pub(crate) const MAX_VOCABULARY: u32 = 1 << 20;
const MAX_TABLE: u64 = 1 << 28;

impl SceneConfig {
    /// The defaults for words of images, in which neighbours that look alike count more.
    pub fn for_images() -> Self {
        Self { colour_levels: crate::words::COLOUR_LEVELS, ..Self::default() }
    }

    /// Says which parameter is out of range, if any.
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

    /// Weight of a new label for any word.
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

fn within(key: &'static str, value: u32, most: u32, allowed: &'static str) -> Result<(), ConfigError> {
    if (1..=most).contains(&value) { Ok(()) } else { Err(refuse(key, value, allowed)) }
}

fn refuse(key: &'static str, value: impl ToString, allowed: &'static str) -> ConfigError {
    ConfigError { key, value: value.to_string(), allowed }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_out_of_range_is_named_with_its_range() {
        let config = SceneConfig { beta: f64::NAN, ..SceneConfig::default() };
        assert_eq!(config.check().unwrap_err().to_string(), "beta = NaN: allowed is 1e-12 to 1e9");
        let config = SceneConfig { max_labels: 0, ..SceneConfig::default() };
        assert_eq!(config.check().unwrap_err().key, "max_labels");
    }

    #[test]
    fn the_default_is_in_range() {
        SceneConfig::default().check().unwrap();
    }
}
