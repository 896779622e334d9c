//! All measurements of the link in virtual time, as a golden table with one row for each setting.

use super::bench::{BIT_RATE_BPS, LinkBench, LinkSetting};
use super::budgets::{BudgetRow, measure_budgets};
use super::figures::{budget_use, round};
use super::fleet::{FleetRow, measure_fleet};
use super::ranging::{RangingRow, measure_ranging};
use super::trial::{Flow, LinkEffort};
use scenecast_protocol::link::IssueError;
use serde::Serialize;
use sim_channel::{LossModel, RandomStream, presets};
use std::time::Duration;

const HOUR: Duration = Duration::from_secs(3600);

/// The golden table and the measurements beside it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LinkTable {
    /// Seed of all random numbers.
    pub seed: u64,
    /// One row for each range, frame size and loss.
    pub rows: Vec<LinkRow>,
    /// The same link with a budget below the channel's capacity.
    pub budgets: Vec<BudgetRow>,
    /// Many vehicles that share one medium.
    pub fleet: FleetRow,
    pub ranging: Vec<RangingRow>,
}

/// Measures all tables; `progress` is called with the share that is done, 0..=1.
pub fn link_table(seed: u64, progress: &mut dyn FnMut(f64)) -> Result<LinkTable, IssueError> {
    let link_cases = link_cases();
    let steps = link_cases.len() as f64 + 3.0;
    let mut rows = Vec::new();
    for place in &link_cases {
        rows.push(place.measure(&LinkEffort::TABLE, seed)?);
        progress(rows.len() as f64 / steps);
    }
    let budgets = measure_budgets(HOUR * 2, seed)?;
    progress((steps - 2.0) / steps);
    let ranging = measure_ranging(HOUR * 2, seed)?;
    progress((steps - 1.0) / steps);
    let fleet = measure_fleet(HOUR, seed);
    progress(1.0);
    Ok(LinkTable { seed, rows, budgets, fleet, ranging })
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Pattern {
    Independent,
    /// Losses in bursts, as in a shallow harbour.
    Harbour,
}

impl Pattern {
    pub fn name(self) -> &'static str {
        match self {
            Self::Independent => "independent",
            Self::Harbour => "harbour",
        }
    }
}

/// One row of the golden table.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LinkRow {
    pub range_km: f64,
    /// Maximum length of a frame, bytes.
    pub frame_bytes: usize,
    /// Share of frames lost in each direction; for a harbour the measured share.
    pub loss: f64,
    pub pattern: Pattern,
    /// Ratio of useful payload to the channel's capacity for it.
    pub efficiency: f64,
    pub directive_median_s: f64,
    /// Time from issue to application of a directive: 95th percentile, seconds.
    pub directive_p95_s: f64,
    /// Time from issue until the surface knows of the application: 95th percentile, seconds.
    pub directive_known_p95_s: f64,
    /// Time from the last change to equal maps: 95th percentile, seconds.
    pub converge_p95_s: f64,
    /// Share of stops after which the maps were equal within the bound.
    pub converge_within: f64,
    /// Ratio of the fullest window of any transmitter to the budget plus one transmission.
    pub budget_use: f64,
    /// Number of resynchronisations of the link.
    pub resyncs: u64,
    /// Number of frames that began before the end of the turn-around.
    pub early_frames: u64,
}

/// Channel and frame size of a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkCase {
    range_km: f64,
    frame_bytes: usize,
    /// Share of independent losses; `None` for a harbour.
    loss: Option<f64>,
}

/// The cases of the table, in order.
pub fn link_cases() -> Vec<LinkCase> {
    let mut link_cases = Vec::new();
    for range_km in [0.1, 1.0, 3.0] {
        for frame_bytes in [64, 256, 1000] {
            for loss in [Some(0.0), Some(0.1), Some(0.3), Some(0.5), None] {
                link_cases.push(LinkCase { range_km, frame_bytes, loss });
            }
        }
    }
    link_cases
}

impl LinkCase {
    fn setting(&self) -> LinkSetting {
        let loss = match self.loss {
            Some(probability) => LossModel::Independent { probability },
            None => presets::shallow_harbour().loss,
        };
        LinkSetting::new(self.range_km * 1000.0, self.frame_bytes, loss)
    }

    /// Measures the row; all random numbers are drawn from `seed`.
    pub fn measure(&self, effort: &LinkEffort, seed: u64) -> Result<LinkRow, IssueError> {
        let setting = self.setting();
        let mut rng = RandomStream::new(seed, &[self.range_km.to_bits(), self.frame_bytes as u64]);
        let mut seed = || (rng.uniform() * 2f64.powi(53)) as u64;
        let mut flowing = LinkBench::under_load(&setting, seed());
        let Flow { useful_bps, loss } = flowing.measure_flow(effort.saturated, None)?;
        let loss = self.loss.unwrap_or(loss);
        let mut directed = LinkBench::under_load(&setting, seed());
        let directives = directed.measure_directives(effort.directives, &mut RandomStream::new(seed(), &[]))?;
        let mut stopped = LinkBench::under_load(&setting, seed());
        let convergence = stopped.measure_convergence(effort.stops, loss, &mut RandomStream::new(seed(), &[]));
        let benches = [flowing, directed, stopped];
        Ok(LinkRow {
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
            budget_use: round(benches.iter().map(budget_use).fold(0.0, f64::max)),
            resyncs: benches.iter().map(resyncs).sum(),
            early_frames: benches.iter().map(|w| w.tally.early_frames).sum(),
        })
    }
}

fn resyncs(bench: &LinkBench) -> u64 {
    let at_surface = bench.view().map_or(0, |v| v.stats().resyncs);
    at_surface + bench.vehicles.iter().map(|v| v.host.end().stats().resyncs).sum::<u64>()
}
