//! `scenecast demo`

use super::sim::WorldArguments;
use clap::Args;
use scenecast_core::UserError;
use scenecast_rehearsal::{Mission, MissionOptions};

/// Run a simulated mission in real time, with the operator's page.
#[derive(Debug, Args)]
#[command(after_help = "Example: scenecast demo --speed 4, then open http://127.0.0.1:8460")]
pub(super) struct Demo {
    /// Port of the operator's page on 127.0.0.1
    #[arg(long, default_value_t = 8460, allow_negative_numbers = true)]
    port: u16,
    /// Mission seconds per second of wall time
    #[arg(long, default_value_t = 1.0, allow_negative_numbers = true)]
    speed: f64,
    /// Do not serve the page
    #[arg(long)]
    no_console: bool,
    #[command(flatten)]
    world: WorldArguments,
}

impl Demo {
    pub(super) fn run(mut self) -> Result<(), UserError> {
        if !(0.01..=1000.0).contains(&self.speed) {
            return Err(UserError::Input(format!("--speed {} is not allowed; allowed: 0.01 to 1000", self.speed)));
        }
        // The operator is the person at the page.
        self.world.sets.insert(0, "operator.script=none".to_owned());
        let config = self.world.config()?;
        let world = self.world.world(&config)?;
        let mission = Mission::new(config, MissionOptions { world, seed: self.world.seed, record: None })?;
        crate::demo::run_demo(mission, self.speed, (!self.no_console).then_some(self.port))
    }
}
