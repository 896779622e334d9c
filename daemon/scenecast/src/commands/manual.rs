//! `scenecast completions` and `scenecast man`

use super::Arguments;
use clap::{Args, CommandFactory};
use clap_complete::Shell;
use scenecast_core::UserError;
use std::io::Write;
use std::path::PathBuf;

/// Prints the completions of commands and options for a shell.
#[derive(Debug, Args)]
#[command(after_help = "Example: scenecast completions bash > ~/.local/share/bash-completion/completions/scenecast")]
pub(super) struct Completions {
    #[arg(value_enum)]
    shell: Shell,
}

impl Completions {
    pub(super) fn run(self) -> Result<(), UserError> {
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut Arguments::command(), "scenecast", &mut script);
        std::io::stdout().write_all(&script).map_err(|e| UserError::Failed(format!("standard output: {e}")))
    }
}

/// Writes the manual pages, one for each command.
#[derive(Debug, Args)]
#[command(after_help = "Example: scenecast man --out ~/.local/share/man/man1, then man scenecast")]
pub(super) struct Man {
    /// Folder for the pages; it is made if it does not exist
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

impl Man {
    pub(super) fn run(self) -> Result<(), UserError> {
        std::fs::create_dir_all(&self.out).map_err(|e| UserError::file(&self.out, e))?;
        clap_mangen::generate_to(Arguments::command(), &self.out).map_err(|e| UserError::file(&self.out, e))
    }
}
