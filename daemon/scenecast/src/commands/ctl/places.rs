//! `scenecast ctl go`, `areas`

use clap::{Args, Subcommand};
use scenecast_console::client::{self, AreasFile, Session};
use scenecast_core::UserError;
use std::path::PathBuf;

const FILE: &str = "\
Example: scenecast ctl areas set areas.geojson --wait 120

Each feature is a Polygon with the property `weight`, from -1 to 1; a file has at most four. Coordinates are longitude and
latitude, WGS 84, at most 100 km from the mission's origin; a mission without an origin needs --metres.";

#[derive(Debug, Subcommand)]
pub(super) enum AreasCommand {
    /// Replace the weighted areas by those of a GeoJSON file.
    #[command(after_help = FILE)]
    Set {
        /// GeoJSON file with polygons and their weights
        file: PathBuf,
        /// Read the coordinates as metres east and north of the origin
        #[arg(long)]
        metres: bool,
    },
    /// Remove all weighted areas.
    #[command(after_help = "Example: scenecast ctl areas clear --wait 120")]
    Clear,
}

#[derive(Debug, Args)]
pub(super) struct Go {
    /// Metres east of the origin
    #[arg(allow_negative_numbers = true, required_unless_present = "cancel", requires = "north_m")]
    east_m: Option<f64>,
    /// Metres north of the origin
    #[arg(allow_negative_numbers = true)]
    north_m: Option<f64>,
    /// Withdraw the order: the vehicle resumes its survey
    #[arg(long, conflicts_with = "east_m")]
    cancel: bool,
}

pub(super) async fn areas(session: &Session, change: Option<AreasCommand>) -> Result<(), UserError> {
    match change {
        None => client::show_areas(session).await,
        Some(AreasCommand::Set { file, metres }) => {
            client::set_areas(session, Some(AreasFile { path: &file, in_metres: metres })).await
        }
        Some(AreasCommand::Clear) => client::set_areas(session, None).await,
    }
}

pub(super) async fn go(session: &Session, Go { east_m, north_m, .. }: Go) -> Result<(), UserError> {
    client::go(session, east_m.zip(north_m).map(|(east, north)| [east, north])).await
}
