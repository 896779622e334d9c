//! The scene model over files: sources of words, learning, scoring and output.

mod annotations;
mod bounds;
mod frames;
mod learn;
mod lines;
mod mosaic;
mod process;
mod quality;
mod run_report;
mod tum;
mod words_file;

pub(crate) use annotations::Annotated;
pub(crate) use frames::Frames;
pub(crate) use learn::{Schedule, learn};
pub(crate) use mosaic::Mosaic;
pub(crate) use quality::{Quality, quality};
pub(crate) use run_report::{RunReport, write};
pub(crate) use scenecast_files::read_vocabulary;
pub(crate) use tum::{Intrinsics, Tum};
pub(crate) use words_file::WordsFile;

use scene_model::project::Observation;
use scenecast_core::UserError;

/// The observations of one moment.
pub(crate) struct Sighting {
    pub(crate) t_s: f64,
    pub(crate) observations: Vec<Observation>,
    /// Share of the source that was read by now, 0..=1.
    pub(crate) done: f64,
}

pub(crate) trait WordSource {
    /// The next sighting in order of time; `None` at the end.
    fn next(&mut self) -> Result<Option<Sighting>, UserError>;

    /// A message about the input that was skipped so far; `None` if all was used.
    fn skipped(&self) -> Option<String> {
        None
    }
}

/// Edge of a cell in pixels if no size is given.
pub(crate) const CELL_PX: f64 = 25.0;
/// Height of the cells in a flat world, metres: large enough that all words share one height.
pub(crate) const FLAT_M: f64 = 1e4;
