//! The commands of offline work, and arguments that measurements share.

mod map;
mod scene;
mod tune;
mod vocabulary;
mod wire;

pub use map::Map;
pub use scene::Scene;
pub use tune::Tune;
pub use vocabulary::Vocabulary;
pub use wire::Wire;

use clap::Args;

/// The seeds of a measurement that is repeated.
#[derive(Debug, Clone, Copy, Args)]
pub struct SeedArguments {
    /// First seed
    #[arg(long = "seed", value_name = "SEED", default_value_t = 1)]
    pub first: u64,
    /// Number of seeds, from --seed on; each draws all that is random
    #[arg(long = "seeds", value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u64).range(1..=1000))]
    pub count: u64,
}
