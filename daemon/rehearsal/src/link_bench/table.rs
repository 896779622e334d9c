//! The golden table: one row a setting.

use super::trial::{Effort, Flow};
use super::water::{BIT_RATE_BPS, Setting, WINDOW, Water};
use scenecast_protocol::link::IssueError;
use scenecast_protocol::schedule::Audit;
use serde::Serialize;
use sim_channel::{LossModel, RandomStream, presets};

/// How frames are lost.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Pattern {
    /// Each by itself.
    Independent,
    /// In bursts, as in a shallow harbour.
    Harbour,
}

impl Pattern {
    /// As it is printed.
    pub fn name(self) -> &'static str {
        match self {
            Self::Independent => "independent",
            Self::Harbour => "harbour",
        }
    }
}

/// One line of the table.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// Slant range.
    pub range_km: f64,
    /// Bytes of a full frame.
    pub frame_bytes: usize,
    /// Share of frames lost each way; for a harbour the share that was.
    pub loss: f64,
    /// How they were lost.
    pub pattern: Pattern,
    /// Useful payload over what the channel could carry of it.
    pub efficiency: f64,
    /// Issue to applied: median.
    pub directive_median_s: f64,
    /// Issue to applied: 95th percentile.
    pub directive_p95_s: f64,
    /// Issue to known at the surface: 95th percentile.
    pub directive_known_p95_s: f64,
    /// Last change to equality: 95th percentile.
    pub converge_p95_s: f64,
    /// Share of stops that kept the bound of convergence.
    pub converge_within: f64,
    /// Worst window of any transmitter over what the budget allows with one transmission more.
    pub budget_use: f64,
    /// Times that the two ends were found to differ.
    pub resyncs: u64,
    /// Frames that began sooner than the modem turns around.
    pub early_frames: u64,
}

/// Where and how a row is measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    range_km: f64,
    frame_bytes: usize,
    /// `None`: a harbour.
    loss: Option<f64>,
}

/// Every place of the table.
pub fn places() -> Vec<Place> {
    let mut places = Vec::new();
    for range_km in [0.1, 1.0, 3.0] {
        for frame_bytes in [64, 256, 1000] {
            for loss in [Some(0.0), Some(0.1), Some(0.3), Some(0.5), None] {
                places.push(Place { range_km, frame_bytes, loss });
            }
        }
    }
    places
}

impl Place {
    fn setting(&self) -> Setting {
        let loss = match self.loss {
            Some(probability) => LossModel::Independent { probability },
            None => presets::shallow_harbour().loss,
        };
        Setting::new(self.range_km * 1000.0, self.frame_bytes, loss)
    }

    /// Measures the row; all chance is drawn from `seed`.
    pub fn measure(&self, effort: &Effort, seed: u64) -> Result<Row, IssueError> {
        let setting = self.setting();
        let mut dice = RandomStream::new(seed, &[self.range_km.to_bits(), self.frame_bytes as u64]);
        let mut seed = || (dice.uniform() * 2f64.powi(53)) as u64;
        let mut flowing = Water::under_load(&setting, seed());
        let Flow { useful_bps, loss } = flowing.measure_flow(effort.saturated, None)?;
        let loss = self.loss.unwrap_or(loss);
        let mut directed = Water::under_load(&setting, seed());
        let directives = directed.measure_directives(effort.directives, &mut RandomStream::new(seed(), &[]))?;
        let mut stopped = Water::under_load(&setting, seed());
        let convergence = stopped.measure_convergence(effort.stops, loss, &mut RandomStream::new(seed(), &[]));
        let waters = [flowing, directed, stopped];
        Ok(Row {
            range_km: self.range_km,
            frame_bytes: self.frame_bytes,
            loss: round(loss),
            pattern: if self.loss.is_some() { Pattern::Independent } else { Pattern::Harbour },
            efficiency: round(useful_bps / (f64::from(BIT_RATE_BPS) * (1.0 - loss))),
            directive_median_s: round(directives.applied.median()),
            directive_p95_s: round(directives.applied.p95()),
            directive_known_p95_s: round(directives.known.p95()),
            converge_p95_s: round(convergence.time.p95()),
            converge_within: round(convergence.within),
            budget_use: round(waters.iter().map(budget_use).fold(0.0, f64::max)),
            resyncs: waters.iter().map(resyncs).sum(),
            early_frames: waters.iter().map(|w| w.tally.early_frames).sum(),
        })
    }
}

/// Worst window of any transmitter, over the budget of a window and one transmission.
pub fn budget_use(water: &Water) -> f64 {
    let budget = f64::from(water.setting().budget_bps) * WINDOW.as_secs_f64();
    let of = |audit: &Audit| audit.worst_window_bits() as f64 / (budget + audit.largest_bits() as f64);
    water.vehicles.iter().map(|v| of(v.host.audit())).fold(of(water.surface.audit()), f64::max)
}

fn resyncs(water: &Water) -> u64 {
    let at_surface = water.view().map_or(0, |v| v.stats().resyncs);
    at_surface + water.vehicles.iter().map(|v| v.host.end().stats().resyncs).sum::<u64>()
}

/// To a thousandth, so that a table says no more than it knows.
pub fn round(value: f64) -> f64 {
    (value * 1000.0).round() / 1000.0
}
