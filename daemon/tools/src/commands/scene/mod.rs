//! `scenecast scene`

mod choices;
mod run;
mod sample;
mod scenes;
mod score;

use clap::Subcommand;
use scenecast_core::UserError;

/// Run the scene model over files.
#[derive(Debug, Subcommand)]
pub enum Scene {
    Run(Box<run::Run>),
    Sample(sample::Sample),
    /// Score the scene model and two baselines on annotated images.
    Score(score::Score),
}

impl Scene {
    pub fn run(self) -> Result<(), UserError> {
        match self {
            Self::Run(run) => run.run(),
            Self::Sample(sample) => sample.run(),
            Self::Score(score) => score.run(),
        }
    }
}
