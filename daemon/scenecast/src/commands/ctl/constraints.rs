//! `scenecast ctl fence`, `return-point`, `limits`, `hold`, `resume`, `abort`

use clap::{Args, Subcommand};
use scenecast_console::client::Ctl;
use scenecast_console::orders::ConstraintsOrder;
use scenecast_core::UserError;
use scenecast_surface::LimitsOrder;
use std::path::PathBuf;

const FILE: &str = "\
Example: scenecast ctl fence set fence.geojson --wait 120

A feature's property `role` says what it is: fence (a Polygon; the one without a role), keep_out (Polygons), return_point
(a Point). Coordinates are longitude and latitude, WGS 84, where the mission has an origin, else metres east and north
of it.";

#[derive(Debug, Subcommand)]
pub(super) enum FenceCommand {
    /// Send fence, keep-outs and return point from a GeoJSON file, in place of the last.
    #[command(after_help = FILE)]
    Set {
        /// GeoJSON file
        file: PathBuf,
        /// The coordinates are metres east and north of the origin
        #[arg(long)]
        metres: bool,
    },
    /// Send that there is neither fence nor keep-out nor return point.
    #[command(after_help = "Example: scenecast ctl fence clear --wait 120")]
    Clear,
}

#[derive(Debug, Subcommand)]
pub(super) enum ReturnPointCommand {
    /// Move it; fence and keep-outs stay as sent last.
    #[command(after_help = "Example: scenecast ctl return-point set 12.5 -40 --wait 120")]
    Set {
        /// Metres east of the origin
        #[arg(allow_negative_numbers = true)]
        east_m: f64,
        /// Metres north of the origin
        #[arg(allow_negative_numbers = true)]
        north_m: f64,
    },
    /// Return to where the vehicle's run began.
    #[command(after_help = "Example: scenecast ctl return-point clear")]
    Clear,
}

#[derive(Debug, Subcommand)]
pub(super) enum LimitsCommand {
    /// Send limits in place of the last; what is not named is not limited, reactions then are as configured on the vehicle.
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
    /// Way over ground, the way back included
    #[arg(long, value_name = "METRES")]
    distance: Option<f64>,
    /// Length of the survey, the way back included
    #[arg(long, value_name = "SECONDS")]
    time: Option<f64>,
    /// Longest silence of the surface
    #[arg(long, value_name = "SECONDS")]
    silence: Option<f64>,
    /// What it does then: hold, return or surface
    #[arg(long, value_name = "REACTION")]
    on_silence: Option<String>,
    /// What it does outside of the fence, in a keep-out or out of a band
    #[arg(long, value_name = "REACTION")]
    on_breach: Option<String>,
    /// What it does on an abort
    #[arg(long, value_name = "REACTION")]
    on_abort: Option<String>,
    /// Keep what is not named as it was sent last
    #[arg(long)]
    keep: bool,
}

fn band(text: &str) -> Result<[f64; 2], String> {
    let ends = text.split_once("..").and_then(|(low, high)| Some([low.parse().ok()?, high.parse().ok()?]));
    ends.ok_or_else(|| "it takes LOW..HIGH in metres, as in 5..30".to_owned())
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

/// Hold, or go on.
pub(super) async fn hold(ctl: &Ctl, hold: bool) -> Result<(), UserError> {
    ctl.constrain(ConstraintsOrder { hold, abort: false }).await
}

pub(super) async fn abort(ctl: &Ctl, yes: bool) -> Result<(), UserError> {
    if !yes {
        return Err(UserError::Input("an abort ends the survey of the vehicle: --yes confirms it".to_owned()));
    }
    ctl.constrain(ConstraintsOrder { hold: false, abort: true }).await
}
