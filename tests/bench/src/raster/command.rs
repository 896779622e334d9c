//! `scenecast-bench raster`

use super::{AnnotatedFigures, Pattern, RasterFigures, RasterSetting, annotated, changes, whole};
use clap::Args;
use scenecast_core::{Takes, UserError};
use scenecast_protocol::mac::Access;
use scenecast_tools::Progress;
use serde_json::json;
use std::path::PathBuf;
use std::time::Duration;

/// A grid of 8-bit values of which a part changes every second, over a radio that loses frames: how much of the operator's
/// copy is equal, how old changes are when they arrive, and how late status and orders come. In the same run the grid is
/// sent as a whole PNG, again and again.
///
/// The changed cells lie anywhere, or in discs. Ages are measured to a tenth of a second.
#[derive(Debug, Args)]
#[command(after_help = "Example: scenecast-bench raster --bit-rate 50000 --side 200")]
pub(crate) struct RasterBench {
    /// Print JSON instead of a table
    #[arg(long)]
    json: bool,
    /// Seed of all random numbers
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Cells on each side of the grid
    #[arg(long, default_value_t = 500, value_parser = clap::value_parser!(u32).range(8..=2000))]
    side: u32,
    /// Share of the cells that change every second
    #[arg(long, default_value_t = 0.02, value_parser = share)]
    change: f64,
    /// Bit rate of the radio, bit/s
    #[arg(long, default_value_t = 200_000, value_parser = clap::value_parser!(u32).range(1000..=10_000_000))]
    bit_rate: u32,
    /// Share of the frames that are lost in each direction
    #[arg(long, default_value_t = 0.2, value_parser = share)]
    loss: f64,
    /// Maximum length of a frame, bytes
    #[arg(long, default_value_t = 1000, value_parser = clap::value_parser!(u32).range(32..=1024))]
    frame_bytes: u32,
    /// Seconds of virtual time that are measured
    #[arg(long, default_value_t = 60, value_parser = clap::value_parser!(u32).range(5..=3600))]
    seconds: u32,
    /// Measure the changes too where the ends take turns, as over an acoustic channel
    #[arg(long)]
    turns: bool,
    /// Send annotated maps instead, each once: grey or indexed PNG, whose pixels are classes and 255 unknown
    #[arg(long, value_name = "FILE", num_args = 1.., conflicts_with_all = ["side", "change", "seconds", "turns"])]
    map: Vec<PathBuf>,
    /// A class of annotated maps that stands for unknown, too
    #[arg(long, value_name = "CLASS", requires = "map")]
    unknown: Option<u8>,
}

fn share(text: &str) -> Result<f64, Takes> {
    text.parse().ok().filter(|share| (0.0..=0.9).contains(share)).ok_or(Takes("the range is 0 to 0.9"))
}

impl RasterBench {
    /// Sends annotated maps over the same radio, and prints the measurements.
    fn run_maps(&self) -> Result<(), UserError> {
        let setting = RasterSetting {
            side: 0,
            change: 0.0,
            pattern: Pattern::Patches,
            bit_rate_bps: f64::from(self.bit_rate),
            loss: self.loss,
            frame_bytes: self.frame_bytes as usize,
            access: Access::FullDuplex,
            duration: Duration::ZERO,
        };
        let (mut rows, mut all) = (serde_json::Map::new(), true);
        if !self.json {
            let loss = 100.0 * self.loss;
            println!("{} bit/s, {loss:.0} % of the frames lost", self.bit_rate);
            println!(
                "{:<40} {:>9} {:>7} {:>6} {:>9} {:>12}",
                "map", "cells", "classes", "equal", "seconds", "bytes on air"
            );
        }
        for path in &self.map {
            let figures = annotated(&setting, path, self.unknown, self.seed)?;
            all &= figures.is_equal;
            let name = path.display().to_string();
            if !self.json {
                let equal = if figures.is_equal { "yes" } else { "NO" };
                let AnnotatedFigures { cells, classes, seconds, bytes, .. } = figures;
                println!("{name:<40} {cells:>9} {classes:>7} {equal:>6} {seconds:>9.0} {bytes:>12}");
            }
            rows.insert(name, json!(figures));
        }
        if self.json {
            println!("{}", serde_json::to_string_pretty(&rows).map_err(UserError::failed)?);
        }
        if all { Ok(()) } else { Err(UserError::Failed("a map did not arrive within an hour".to_owned())) }
    }

    pub(crate) fn run(self) -> Result<(), UserError> {
        if !self.map.is_empty() {
            return self.run_maps();
        }
        let setting = |pattern, access| RasterSetting {
            side: self.side,
            change: self.change,
            pattern,
            bit_rate_bps: f64::from(self.bit_rate),
            loss: self.loss,
            frame_bytes: self.frame_bytes as usize,
            access,
            duration: Duration::from_secs(u64::from(self.seconds)),
        };
        let mut rows: Vec<(String, RasterFigures)> = Vec::new();
        for (name, pattern) in [("scattered", Pattern::Scattered), ("patches", Pattern::Patches)] {
            let free = setting(pattern, Access::FullDuplex);
            let mut row = |of: &str, figures| rows.push((format!("{name}: {of}"), figures));
            let mut progress = Progress::new("seconds");
            row("changes", changes(&free, self.seed, &mut |share| progress.show(share))?);
            if self.turns {
                let shared = setting(pattern, Access::Shared);
                row("changes, in turns", changes(&shared, self.seed, &mut |share| progress.show(share))?);
            }
            row("whole grid", whole(&free, self.seed, &mut |share| progress.show(share))?);
        }
        if self.json {
            let all: serde_json::Map<String, _> = rows.iter().map(|(name, f)| (name.clone(), json!(f))).collect();
            println!("{}", serde_json::to_string_pretty(&all).map_err(UserError::failed)?);
        } else {
            self.print(&rows);
        }
        Ok(())
    }

    fn print(&self, rows: &[(String, RasterFigures)]) {
        let Self { side, change, bit_rate, loss, .. } = self;
        println!(
            "{side} x {side} cells, {:.1} % change every second, {bit_rate} bit/s, {:.0} % of the frames lost",
            100.0 * change,
            100.0 * loss
        );
        println!(
            "row                           first s   equal %   least %  age median s   p95 s  status s  order s  up bit/s  down bit/s  CPU vehicle  surface"
        );
        for (name, f) in rows {
            println!(
                "{name:<28} {:>8.1} {:>9.2} {:>9.2} {:>13.2} {:>7.2} {:>9.2} {:>8.2} {:>9.0} {:>11.0} {:>12.3} {:>8.3}",
                f.first_s,
                100.0 * f.equal,
                100.0 * f.least_equal,
                f.age_median_s,
                f.age_p95_s,
                f.status_s,
                f.order_s,
                f.up_bps,
                f.down_bps,
                f.vehicle_cpu,
                f.surface_cpu
            );
        }
    }
}
