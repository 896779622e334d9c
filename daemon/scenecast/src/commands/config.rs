//! `scenecast config`

use clap::{Args, ValueEnum};
use scenecast_core::{UserError, out};

#[derive(Debug, Clone, Copy, ValueEnum)]
enum ReaderRole {
    /// Keys of the vehicle's process
    Auv,
    /// Keys of the surface's process
    Asv,
    /// Keys of rehearsals: sim and demo
    Scenario,
}

/// Print a configuration file with every key explained.
///
/// The file has the default of each key, with its meaning and its allowed values as comments.
#[derive(Debug, Args)]
#[command(after_help = "Example: scenecast config --role auv > auv.toml")]
pub(super) struct ConfigCommand {
    /// Process that reads the file
    #[arg(long, value_enum, default_value = "scenario")]
    role: ReaderRole,
    /// Print the reference of all keys, as Markdown
    #[arg(long, conflicts_with_all = ["role", "schema"])]
    reference: bool,
    /// Print the JSON Schema of configuration files, draft 2020-12
    #[arg(long, conflicts_with = "role")]
    schema: bool,
}

impl ConfigCommand {
    pub(super) fn run(self) -> Result<(), UserError> {
        if self.reference {
            out!("{}", scenecast_config::reference());
        } else if self.schema {
            out!("{}", scenecast_config::schema());
        } else {
            out!("{}", scenecast_config::print(self.role.into()));
        }
        Ok(())
    }
}

impl From<ReaderRole> for scenecast_config::Role {
    fn from(role: ReaderRole) -> Self {
        match role {
            ReaderRole::Auv => Self::Auv,
            ReaderRole::Asv => Self::Asv,
            ReaderRole::Scenario => Self::Scenario,
        }
    }
}
