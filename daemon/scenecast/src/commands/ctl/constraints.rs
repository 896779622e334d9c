//! `scenecast ctl fence`, `return-point`, `limits`, `hold`, `resume`, `abort`

use clap::{Args, Subcommand};
use scenecast_console::client::Ctl;
use scenecast_console::orders::ConstraintsOrder;
use scenecast_core::UserError;
use scenecast_surface::LimitsOrder;
use std::path::PathBuf;

const FILE: &str = "\
Example: scenecast ctl fence set fence.geojson --wait 120

The property `role` of a feature is fence (one Polygon; the default), keep_out (Polygons) or return_point (one Point).
Coordinates are longitude and latitude in WGS 84 if the mission has an origin, and else metres east and north.";

#[derive(Debug, Subcommand)]
pub(super) enum FenceCommand {
    /// Send fence, keep-outs and return point from a GeoJSON file. They replace the last ones.
    #[command(after_help = FILE)]
    Set {
        /// GeoJSON file
        file: PathBuf,
        /// Read coordinates as metres east and north of the origin
        #[arg(long)]
        metres: bool,
    },
    /// Remove fence, keep-outs and return point.
    #[command(after_help = "Example: scenecast ctl fence clear --wait 120")]
    Clear,
}

#[derive(Debug, Subcommand)]
pub(super) enum ReturnPointCommand {
    /// Set the return point. Fence and keep-outs stay.
    #[command(after_help = "Example: scenecast ctl return-point set 12.5 -40 --wait 120")]
    Set {
        /// Metres east of the origin
        #[arg(allow_negative_numbers = true)]
        east_m: f64,
        /// Metres north of the origin
        #[arg(allow_negative_numbers = true)]
        north_m: f64,
    },
    /// Remove the return point: the vehicle returns to the start of its run.
    #[command(after_help = "Example: scenecast ctl return-point clear")]
    Clear,
}

#[derive(Debug, Subcommand)]
pub(super) enum LimitsCommand {
    /// Send limits. They replace the last ones: a limit that is not given is removed, and reactions are as configured on the
    /// vehicle.
    #[command(
        after_help = "Example: scenecast ctl limits set --depth 5..30 --silence 300 --on-silence return --wait 120"
    )]
    Set(Limits),
}

#[derive(Debug, Args)]
pub(super) struct Limits {
    /// Least and greatest depth, metres
    #[arg(long, value_name = "LOW..HIGH", value_parser = band)]
    depth: Option<[f64; 2]>,
    /// Least and greatest altitude, metres
    #[arg(long, value_name = "LOW..HIGH", value_parser = band)]
    altitude: Option<[f64; 2]>,
    /// Longest path over ground, return path included
    #[arg(long, value_name = "METRES")]
    distance: Option<f64>,
    /// Longest duration of the survey, return path included
    #[arg(long, value_name = "SECONDS")]
    time: Option<f64>,
    /// Longest silence of the surface
    #[arg(long, value_name = "SECONDS")]
    silence: Option<f64>,
    /// Reaction to that silence: hold, return or surface
    #[arg(long, value_name = "REACTION")]
    on_silence: Option<String>,
    /// Reaction outside the fence, in a keep-out or outside a band
    #[arg(long, value_name = "REACTION")]
    on_breach: Option<String>,
    /// Reaction to an abort
    #[arg(long, value_name = "REACTION")]
    on_abort: Option<String>,
    /// Keep the last limits that are not given
    #[arg(long)]
    keep: bool,
}

fn band(text: &str) -> Result<[f64; 2], String> {
    let ends = text.split_once("..").and_then(|(low, high)| Some([low.parse().ok()?, high.parse().ok()?]));
    ends.ok_or_else(|| "allowed: LOW..HIGH in metres, as in 5..30".to_owned())
}

pub(super) async fn fence(ctl: &Ctl, change: Option<FenceCommand>) -> Result<(), UserError> {
    match change {
        None => ctl.fence().await,
        Some(FenceCommand::Set { file, metres }) => ctl.set_fence(&file, metres).await,
        Some(FenceCommand::Clear) => ctl.clear_fence().await,
    }
}

pub(super) async fn return_point(ctl: &Ctl, change: ReturnPointCommand) -> Result<(), UserError> {
    match change {
        ReturnPointCommand::Set { east_m, north_m } => ctl.set_return_point(Some([east_m, north_m])).await,
        ReturnPointCommand::Clear => ctl.set_return_point(None).await,
    }
}

pub(super) async fn limits(ctl: &Ctl, change: Option<LimitsCommand>) -> Result<(), UserError> {
    let Some(LimitsCommand::Set(l)) = change else { return ctl.limits().await };
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
    ctl.set_limits(order, l.keep).await
}

pub(super) async fn hold(ctl: &Ctl, hold: bool) -> Result<(), UserError> {
    ctl.constrain(ConstraintsOrder { hold, abort: false }).await
}

pub(super) async fn abort(ctl: &Ctl, yes: bool) -> Result<(), UserError> {
    if !yes {
        return Err(UserError::Input("an abort ends the survey; confirm it with --yes".to_owned()));
    }
    ctl.constrain(ConstraintsOrder { hold: false, abort: true }).await
}
