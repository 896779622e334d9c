//! The program that the measurements of processes start.

use clap::Args;
use scenecast_core::UserError;
use std::path::PathBuf;

/// The program `scenecast` whose processes are measured.
#[derive(Debug, Args)]
pub(crate) struct ProgramArgument {
    /// Program scenecast to start [default: the one in the folder of this program]
    #[arg(long = "program", value_name = "FILE")]
    file: Option<PathBuf>,
}

impl ProgramArgument {
    /// The path of the program.
    ///
    /// # Errors
    ///
    /// No file is there.
    pub(crate) fn path(&self) -> Result<PathBuf, UserError> {
        let path = match &self.file {
            Some(file) => file.clone(),
            None => std::env::current_exe().map_err(UserError::failed)?.with_file_name("scenecast"),
        };
        let is_release = path.parent().is_some_and(|folder| folder.ends_with("release"));
        let build = if is_release { " --release" } else { "" };
        let missing =
            || UserError::Input(format!("{} is missing; cargo build{build} -p scenecast makes it", path.display()));
        path.is_file().then(|| path.clone()).ok_or_else(missing)
    }
}
