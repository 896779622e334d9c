//! `scenecast record`

use clap::{Args, Subcommand};
use scenecast_core::{UserError, outln};
use scenecast_files::{RecoveredPart, recover};
use std::path::PathBuf;

#[derive(Debug, Subcommand)]
pub(super) enum Record {
    Recover(Recover),
}

/// Make the files of a record whole that a power cut has left without their end. What was written until two seconds before it is kept.
#[derive(Debug, Args)]
#[command(after_help = "Example: scenecast record recover state/records/auv_1-20261129T101500Z")]
pub(super) struct Recover {
    /// Folder of a record, or one of its files
    #[arg(value_name = "PATH")]
    path: PathBuf,
}

impl Record {
    pub(super) fn run(self) -> Result<(), UserError> {
        let Self::Recover(Recover { path }) = self;
        for RecoveredPart { path, messages, damage } in recover(&path)? {
            let damage = damage.filter(|_| messages.is_some()).map_or(String::new(), |why| format!("; {why}"));
            match messages {
                None => outln!("{}: whole, as it was", path.display()),
                Some(messages) => outln!("{}: {messages} messages{damage}", path.display()),
            }
        }
        Ok(())
    }
}
