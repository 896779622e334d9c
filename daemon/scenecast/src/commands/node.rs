//! `scenecast auv`, `scenecast asv`

use clap::Args;
use scenecast_core::UserError;
use std::path::PathBuf;

/// Run one end of the link as a process.
#[derive(Debug, Args)]
#[command(
    after_help = "Example: scenecast asv --config config/asv.toml, and in another terminal: scenecast auv --config config/auv.toml"
)]
pub(super) struct Node {
    /// Configuration file of this process
    #[arg(long, value_name = "FILE")]
    config: PathBuf,
    /// Set a key of the configuration, as in link.budget_bps=2000
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
}

impl Node {
    pub(super) fn run_vehicle(self) -> Result<(), UserError> {
        scenecast_runtime::run_vehicle(self.load(), simulator())
    }

    #[cfg(feature = "surface")]
    pub(super) fn run_surface(self) -> Result<(), UserError> {
        scenecast_runtime::run_surface(self.load(), simulator())
    }

    fn load(self) -> scenecast_runtime::Load {
        Box::new(move || scenecast_config::load(Some(&self.config), &self.sets))
    }
}

/// The simulated vehicle of `autopilot.kind = "rehearsal"`, in builds that have it.
fn simulator() -> Option<scenecast_runtime::SimulatedAutopilot> {
    #[cfg(feature = "rehearsal")]
    return Some(scenecast_rehearsal::simulated_autopilot);
    #[cfg(not(feature = "rehearsal"))]
    None
}
