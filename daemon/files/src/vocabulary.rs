//! Vocabularies in files.

use scene_model::words::Measures;
use scenecast_core::UserError;
use std::path::Path;

/// Most bytes of a vocabulary; one takes some kilobytes.
const MAX_BYTES: u64 = 1 << 20;

/// Reads a vocabulary that `scenecast vocabulary train` wrote.
pub fn read_vocabulary(path: &Path) -> Result<Measures, UserError> {
    let bytes = scenecast_config::read_regular(path, MAX_BYTES)?;
    let advice = "make one with scenecast vocabulary train";
    scene_model::vocabulary::load(&bytes).map_err(|e| UserError::file(path, format!("{e}; {advice}")))
}

/// The vocabulary of `scene.vocabulary`; `None` for the one that ships.
///
/// # Errors
/// As [`read_vocabulary`].
pub fn configured_vocabulary(file: Option<&Path>) -> Result<Option<Measures>, UserError> {
    file.map(read_vocabulary).transpose()
}
