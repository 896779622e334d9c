//! `scenecast scene`

mod run;
mod sample;

use crate::problem::Problem;
use clap::Subcommand;

/// Run the scene model over files.
#[derive(Debug, Subcommand)]
pub(crate) enum Scene {
    Run(Box<run::Run>),
    Sample(sample::Sample),
}

impl Scene {
    pub(crate) fn run(self) -> Result<(), Problem> {
        match self {
            Self::Run(run) => run.run(),
            Self::Sample(sample) => sample.run(),
        }
    }
}
