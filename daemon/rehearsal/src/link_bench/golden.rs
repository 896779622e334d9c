//! All measurements of the link in virtual time.

use super::budgets::{BudgetRow, measure_budgets};
use super::fleet::{FleetRow, measure_fleet};
use super::ranging::{RangingRow, measure_ranging};
use super::table::{LinkRow, link_cases};
use super::trial::LinkEffort;
use scenecast_protocol::link::IssueError;
use serde::Serialize;
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
