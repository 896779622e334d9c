//! `scenecast config`

use clap::{Args, Subcommand, ValueEnum};
use scenecast_core::UserError;
use std::path::PathBuf;

#[derive(Debug, Clone, Copy, ValueEnum)]
enum ReaderRole {
    /// Keys of the vehicle's process
    Auv,
    /// Keys of the surface's process
    Asv,
    /// Keys of rehearsals: sim and demo
    Scenario,
}

/// Print a configuration file with every key explained, or rewrite an old one.
///
/// The file has the default of each key, with its meaning and its allowed values as comments.
#[derive(Debug, Args)]
#[command(args_conflicts_with_subcommands = true, after_help = "Example: scenecast config --role auv > auv.toml")]
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
    #[command(subcommand)]
    action: Option<Action>,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Rewrite a configuration file that has old names of keys.
    ///
    /// Comments, order and values stay. Lists by position, such as shares, become tables. Each change is printed. The
    /// file is replaced whole or not at all, and a file without old names is not touched.
    #[command(after_help = "Example: scenecast config migrate auv.toml")]
    Migrate {
        /// Configuration file to rewrite in place
        #[arg(value_name = "FILE")]
        file: PathBuf,
    },
}

impl ConfigCommand {
    pub(super) fn run(self) -> Result<(), UserError> {
        match self.action {
            Some(Action::Migrate { file }) => return migrate(&file),
            None if self.reference => print!("{}", scenecast_config::reference()),
            None if self.schema => print!("{}", scenecast_config::schema()),
            None => print!("{}", scenecast_config::print(self.role.into())),
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

fn migrate(file: &std::path::Path) -> Result<(), UserError> {
    let text = scenecast_config::read_regular_text(file)?;
    let migration = scenecast_config::migrate(file, &text)?;
    if migration.changes.is_empty() {
        println!("{}: all names are up to date", file.display());
        return Ok(());
    }
    scenecast_files::write_whole(file, migration.text.as_bytes())?;
    migration.changes.iter().for_each(|change| println!("{}: {change}", file.display()));
    Ok(())
}
