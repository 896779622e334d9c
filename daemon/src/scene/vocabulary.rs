//! Vocabularies in files.

use crate::problem::Problem;
use scene_model::words::Measures;
use std::io::Read;
use std::path::Path;

/// Most bytes of a vocabulary; one takes some kilobytes.
const MOST_BYTES: u64 = 1 << 20;

/// Reads a vocabulary that `scenecast vocabulary train` wrote.
pub(crate) fn read_vocabulary(path: &Path) -> Result<Measures, Problem> {
    let file = std::fs::File::open(path).map_err(|e| Problem::file(path, e))?;
    let mut bytes = Vec::new();
    file.take(MOST_BYTES).read_to_end(&mut bytes).map_err(|e| Problem::file(path, e))?;
    let advice = "make one with scenecast vocabulary train";
    scene_model::vocabulary::load(&bytes).map_err(|e| Problem::file(path, format!("{e}; {advice}")))
}
