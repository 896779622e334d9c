//! `scenecast auv`, `scenecast asv`, `scenecast config`

use crate::config;
use crate::problem::Problem;
use crate::runtime;
use clap::{Args, ValueEnum};
use std::path::PathBuf;

/// Run one end as a process.
#[derive(Debug, Args)]
#[command(
    after_help = "Example: scenecast asv --config config/asv.toml, and in another terminal: scenecast auv --config config/auv.toml"
)]
pub(super) struct Node {
    /// Configuration file
    #[arg(long, value_name = "FILE")]
    config: PathBuf,
    /// Set a key of the configuration, as in link.budget_bps=2000
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
}

impl Node {
    pub(super) fn run_vehicle(self) -> Result<(), Problem> {
        runtime::run_vehicle(Box::new(move || config::load(Some(&self.config), &self.sets)))
    }

    pub(super) fn run_surface(self) -> Result<(), Problem> {
        runtime::run_surface(config::load(Some(&self.config), &self.sets)?)
    }
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Role {
    Auv,
    Asv,
    Scenario,
}

/// Print a configuration file with every key explained.
#[derive(Debug, Args)]
#[command(after_help = "Example: scenecast config --role auv > auv.toml")]
pub(super) struct PrintConfig {
    /// Whose file
    #[arg(long, value_enum, default_value = "scenario")]
    role: Role,
}

impl PrintConfig {
    pub(super) fn run(self) -> Result<(), Problem> {
        let role = match self.role {
            Role::Auv => 'a',
            Role::Asv => 's',
            Role::Scenario => 'r',
        };
        print!("{}", config::print(role));
        Ok(())
    }
}
