//! The scene model over files: where words come from, how it learns, what is written and how good that is.

mod annotations;
mod bounds;
mod frames;
mod learn;
mod lines;
mod mosaic;
mod outcome;
mod process;
mod quality;
mod tum;
mod words_file;

pub(crate) use annotations::Annotated;
pub(crate) use frames::Frames;
pub(crate) use learn::{Schedule, learn};
pub(crate) use mosaic::Mosaic;
pub(crate) use outcome::{Outcome, write};
pub(crate) use quality::{Quality, quality};
pub(crate) use scenecast_files::read_vocabulary;
pub(crate) use tum::{Intrinsics, Tum};
pub(crate) use words_file::WordsFile;

use scene_model::project::Observation;
use scenecast_core::UserError;

/// What was seen at one time.
pub(crate) struct Sighting {
    pub(crate) t_s: f64,
    pub(crate) observations: Vec<Observation>,
    /// Share of the source that was read by now.
    pub(crate) done: f64,
}

pub(crate) trait Source {
    /// The next sighting, in order of time; none at the end.
    fn next(&mut self) -> Result<Option<Sighting>, UserError>;

    /// What was passed over so far, for people; nothing if nothing was.
    fn skipped(&self) -> Option<String> {
        None
    }
}

/// Edge of a cell in pixels where no size is given.
pub(crate) const CELL_PX: f64 = 25.0;
/// Height of the cells of a world that is flat: it has one layer.
pub(crate) const FLAT_M: f64 = 1e4;
