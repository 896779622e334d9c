//! `scenecast scene`

mod pairs;
mod run;
mod sample;
mod score;

use crate::problem::Problem;
use clap::Subcommand;

/// Run the scene model over files.
#[derive(Debug, Subcommand)]
pub(crate) enum Scene {
    /// Label words, a mosaic or a sequence of images, and print what it took as JSON.
    Run(run::Run),
    /// Draw random worlds of the model's prior.
    Sample(sample::Sample),
    /// Score the scene model and two baselines on annotated images.
    Score(score::Score),
}

impl Scene {
    pub(crate) fn run(self) -> Result<(), Problem> {
        match self {
            Self::Run(run) => run.run(),
            Self::Sample(sample) => sample.run(),
            Self::Score(score) => score.run(),
        }
    }
}
