//! `scenecast ctl fence`, `return-point`, `limits`, `areas`, `go`, `hold`, `resume`, `abort`

use clap::{Args, Subcommand};
use scenecast_console::client::{self, AreasFile, FenceFile, LIMITS, Session};
use scenecast_core::UserError;
use scenecast_surface::{ConstraintsAction, ConstraintsOrder, LimitsOrder};
use std::path::PathBuf;

const FENCE_FILE: &str = "\
Example: scenecast ctl fence set fence.geojson --wait 120

The property `role` of a feature is one of: fence (a Polygon; the default), keep_out (Polygons), return_point
(a Point). Coordinates are longitude and latitude, WGS 84, at most 100 km from the mission's origin; a mission without
an origin needs --metres.";

#[derive(Debug, Subcommand)]
pub(super) enum FenceCommand {
    /// Replace the fence, the keep-outs and the return point that a GeoJSON file has. Keep-outs or a return point that it
    /// does not have stay.
    #[command(after_help = FENCE_FILE)]
    Set {
        /// GeoJSON file with the outlines and the return point
        file: PathBuf,
        /// Read the coordinates as metres east and north of the origin
        #[arg(long)]
        metres: bool,
        /// Accept a file without a fence; it removes the present fence
        #[arg(long)]
        without_fence: bool,
        /// Remove the keep-outs that the file does not have
        #[arg(long)]
        without_keep_outs: bool,
    },
    /// Remove fence, keep-outs and return point.
    #[command(after_help = "Example: scenecast ctl fence clear --wait 120")]
    Clear,
}

#[derive(Debug, Subcommand)]
pub(super) enum ReturnPointCommand {
    /// Move the return point. Fence and keep-outs stay as last sent.
    #[command(after_help = "Example: scenecast ctl return-point set 12.5 -40 --wait 120")]
    Set {
        /// Metres east of the origin
        #[arg(allow_negative_numbers = true)]
        east_m: f64,
        /// Metres north of the origin
        #[arg(allow_negative_numbers = true)]
        north_m: f64,
    },
    /// Remove the return point: the vehicle returns to its start.
    #[command(after_help = "Example: scenecast ctl return-point clear")]
    Clear,
}

#[derive(Debug, Subcommand)]
pub(super) enum LimitsCommand {
    /// Set limits and reactions. Those that are not given stay.
    #[command(
        after_help = "Example: scenecast ctl limits set --depth 5..30 --silence 300 --on-silence return --wait 120"
    )]
    Set(Limits),
    /// Remove limits; a reaction is then as configured on the vehicle.
    #[command(after_help = "Example: scenecast ctl limits clear depth time --wait 120")]
    Clear {
        /// The limits and reactions to remove
        #[arg(required = true, value_parser = LIMITS.map(|(name, _)| name))]
        names: Vec<String>,
    },
}

#[derive(Debug, Args)]
pub(super) struct Limits {
    /// Minimum and maximum depth, metres
    #[arg(long, value_name = "LOW..HIGH", value_parser = band, allow_hyphen_values = true)]
    depth: Option<[f64; 2]>,
    /// Minimum and maximum altitude, metres
    #[arg(long, value_name = "LOW..HIGH", value_parser = band, allow_hyphen_values = true)]
    altitude: Option<[f64; 2]>,
    /// Maximum distance over ground, including the return path
    #[arg(long, value_name = "METRES", allow_negative_numbers = true)]
    distance: Option<f64>,
    /// Maximum duration of the survey, including the return path
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    time: Option<f64>,
    /// Maximum silence of the surface, seconds
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    silence: Option<f64>,
    /// Reaction to that silence: hold, return or surface
    #[arg(long, value_name = "REACTION")]
    on_silence: Option<String>,
    /// Reaction outside of the fence, in a keep-out or out of a band
    #[arg(long, value_name = "REACTION")]
    on_breach: Option<String>,
    /// Reaction to an abort: hold, return or surface
    #[arg(long, value_name = "REACTION")]
    on_abort: Option<String>,
}

fn band(text: &str) -> Result<[f64; 2], String> {
    let ends = text.split_once("..").and_then(|(low, high)| Some([low.parse().ok()?, high.parse().ok()?]));
    ends.ok_or_else(|| "expected LOW..HIGH in metres, as in 5..30".to_owned())
}

pub(super) async fn fence(session: &Session, change: Option<FenceCommand>) -> Result<(), UserError> {
    match change {
        None => client::show_fence(session).await,
        Some(FenceCommand::Set { file, metres, without_fence, without_keep_outs }) => {
            let file = FenceFile { path: &file, in_metres: metres, without_fence, without_keep_outs };
            client::set_fence(session, file).await
        }
        Some(FenceCommand::Clear) => client::clear_fence(session).await,
    }
}

pub(super) async fn return_point(session: &Session, change: ReturnPointCommand) -> Result<(), UserError> {
    match change {
        ReturnPointCommand::Set { east_m, north_m } => client::set_return_point(session, Some([east_m, north_m])).await,
        ReturnPointCommand::Clear => client::set_return_point(session, None).await,
    }
}

pub(super) async fn limits(session: &Session, change: Option<LimitsCommand>) -> Result<(), UserError> {
    let l = match change {
        None => return client::show_limits(session).await,
        Some(LimitsCommand::Clear { names }) => return client::clear_limits(session, &names).await,
        Some(LimitsCommand::Set(l)) => l,
    };
    let order = LimitsOrder {
        depth_m: l.depth,
        altitude_m: l.altitude,
        distance_m: l.distance,
        time_s: l.time,
        silence_s: l.silence,
        on_silence: l.on_silence,
        on_breach: l.on_breach,
        on_abort: l.on_abort,
    };
    client::set_limits(session, &order).await
}

/// Orders the vehicle to hold or to resume.
pub(super) async fn hold(session: &Session, hold: bool) -> Result<(), UserError> {
    let action = if hold { ConstraintsAction::Hold } else { ConstraintsAction::Resume };
    client::send_constraints(session, ConstraintsOrder { action }).await
}

pub(super) async fn abort(session: &Session, yes: bool) -> Result<(), UserError> {
    if !yes {
        return Err(UserError::Input("an abort ends the survey of the vehicle: --yes confirms it".to_owned()));
    }
    client::send_constraints(session, ConstraintsOrder { action: ConstraintsAction::Abort }).await
}

const AREAS_FILE: &str = "\
Example: scenecast ctl areas set areas.geojson --wait 120

Each feature is a Polygon with the property `weight`, from -1 to 1; a file has at most four. Coordinates are longitude and
latitude, WGS 84, at most 100 km from the mission's origin; a mission without an origin needs --metres.";

#[derive(Debug, Subcommand)]
pub(super) enum AreasCommand {
    /// Replace the weighted areas by those of a GeoJSON file.
    #[command(after_help = AREAS_FILE)]
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
