//! The training of the table that the context coder starts from, as a command.

use clap::Args;
use scenecast_core::UserError;
use scenecast_files::write_whole;
use scenecast_tools::Progress;
use scenecast_training::{PRIOR_SCENES, train_prior};
use std::path::PathBuf;

/// Train the table that the context coder starts from, on procedural maps. This takes minutes.
///
/// Seed 1 and the default number of scenes give the built-in table, byte for byte. Both ends of a link must have the
/// same table, so another one makes another wire format.
#[derive(Debug, Args)]
#[command(after_help = "Example: scenecast-bench train-prior --seed 1 --out prior.bin")]
pub(crate) struct TrainPrior {
    /// Seed of the procedural maps
    #[arg(long)]
    seed: u64,
    /// Procedural maps to train on
    #[arg(long, value_name = "N", default_value_t = PRIOR_SCENES, value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    scenes: u64,
    /// File to write the table to
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

impl TrainPrior {
    pub(crate) fn run(self) -> Result<(), UserError> {
        let mut progress = Progress::new("training");
        let table = train_prior(self.seed, self.scenes, &mut |done| progress.show(done as f64 / 1000.0));
        drop(progress);
        write_whole(&self.out, &table)
    }
}
