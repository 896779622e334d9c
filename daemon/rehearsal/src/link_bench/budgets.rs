//! The link's efficiency under a budget below the channel's capacity, and its use of that budget.

use super::bench::{LinkBench, LinkSetting};
use super::figures::{budget_use, round};
use scenecast_protocol::link::IssueError;
use serde::Serialize;
use sim_channel::LossModel;
use std::time::Duration;

/// One row: half duplex at 10 kbit/s on air, of which each end may use its budget.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BudgetRow {
    pub range_km: f64,
    /// Maximum length of a frame, bytes.
    pub frame_bytes: usize,
    /// Share of frames lost in each direction.
    pub loss: f64,
    /// Bit budget of each end, bit/s.
    pub budget_bps: u32,
    /// Useful payload over the payload that the vehicle's budget could carry.
    pub efficiency: f64,
    /// Ratio of the fullest window of any transmitter to the budget plus one transmission.
    pub budget_use: f64,
}

/// Measures each row over `time` of virtual time.
pub fn measure_budgets(time: Duration, seed: u64) -> Result<Vec<BudgetRow>, IssueError> {
    let mut rows = Vec::new();
    for budget_bps in [250, 1000] {
        for frame_bytes in [64, 256] {
            rows.push(measure(budget_bps, frame_bytes, time, seed)?);
        }
    }
    Ok(rows)
}

fn measure(budget_bps: u32, frame_bytes: usize, time: Duration, seed: u64) -> Result<BudgetRow, IssueError> {
    let loss = 0.1;
    let mut setting = LinkSetting::new(1000.0, frame_bytes, LossModel::Independent { probability: loss });
    setting.budget_bps = budget_bps;
    let mut bench = LinkBench::under_load(&setting, seed);
    let flow = bench.measure_flow(time, None)?;
    Ok(BudgetRow {
        range_km: 1.0,
        frame_bytes,
        loss,
        budget_bps,
        efficiency: round(flow.useful_bps / (f64::from(budget_bps) * (1.0 - loss))),
        budget_use: round(budget_use(&bench)),
    })
}
