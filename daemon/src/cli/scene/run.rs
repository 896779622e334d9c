//! `scenecast scene run`

use crate::problem::Problem;
use clap::Args;
use std::path::PathBuf;

/// Label words, a mosaic or a sequence of images.
#[derive(Debug, Args)]
#[command(after_help = "Example: scenecast scene run --words words.csv --out run1")]
pub(crate) struct Run {
    /// Folder for labels.png and labels.csv
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

impl Run {
    pub(super) fn run(self) -> Result<(), Problem> {
        Err(Problem::Failed(format!("{}: not there yet", self.out.display())))
    }
}
