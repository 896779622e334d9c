//! `scenecast scene`

mod choices;
mod register;
mod run;
mod run_options;
mod sample;
mod scenes;
mod score;

use clap::Subcommand;
use scenecast_core::UserError;

/// Run the scene model over files.
#[derive(Debug, Subcommand)]
pub enum Scene {
    Run(Box<run::Run>),
    Register(register::Register),
    Sample(sample::Sample),
    /// Score the scene model and two baselines on annotated images.
    Score(score::Score),
}

impl Scene {
    pub fn run(self) -> Result<(), UserError> {
        match self {
            Self::Run(run) => run.run(),
            Self::Register(register) => register.run(),
            Self::Sample(sample) => sample.run(),
            Self::Score(score) => score.run(),
        }
    }
}
