//! `scenecast report`

use clap::Args;
use scenecast_console::report::Dive;
use scenecast_core::{UserError, errln, outln};
use scenecast_files::write_whole;
use std::path::PathBuf;

/// Write the report of a dive from the record of the surface: one HTML file with summary, map, classes, images, orders and link.
#[derive(Debug, Args)]
#[command(after_help = "Example: scenecast report state/records/bridge-20261129T101500Z --out dive.html
         scenecast report state/records/bridge-20261129T101500Z --zip dive.zip")]
pub(super) struct Report {
    /// Record of a surface, and those of vehicles, which show how far the operator's map agreed with theirs: folders or files
    #[arg(value_name = "RECORD", required = true)]
    records: Vec<PathBuf>,
    /// File to write [default: report.html in the present folder]
    #[arg(long, value_name = "FILE", default_value = "report.html", hide_default_value = true)]
    out: PathBuf,
    /// ZIP archive to write instead: the report, and for each vehicle its map in all formats, images, track and orders
    #[arg(long, value_name = "FILE", conflicts_with = "out")]
    zip: Option<PathBuf>,
    /// Print the figures as JSON, and write no file
    #[arg(long, conflicts_with_all = ["out", "zip"])]
    json: bool,
}

impl Report {
    pub(super) fn run(self) -> Result<(), UserError> {
        scenecast_runtime::keep_private();
        let dive = Dive::read_ended(&self.records)?;
        if let Some(damage) = &dive.damage {
            errln!("scenecast: a part of the record could not be read: {damage}");
        }
        if self.json {
            let text = serde_json::to_string_pretty(&dive.json()).map_err(UserError::failed)?;
            outln!("{text}");
            return Ok(());
        }
        let (out, bytes) = match self.zip {
            Some(zip) => (zip, dive.zip()?),
            None => (self.out, dive.html().into_bytes()),
        };
        write_whole(&out, &bytes)?;
        outln!("{}", out.display());
        Ok(())
    }
}
