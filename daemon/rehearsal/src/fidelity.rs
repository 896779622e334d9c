//! The agreement of the operator's map with the vehicle's at a given bit budget.

use super::baseline::whole_png;
use super::mission::{Mission, MissionOptions};
use super::world::World;
use scenecast_config::Config;
use scenecast_core::UserError;
use serde::Serialize;
use std::time::Duration;

/// One mission of the comparison.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FidelityRow {
    /// Bit budget of each end, bit/s.
    pub budget_bps: u32,
    /// The stream that was used: `delta` or `whole-png`.
    pub stream: &'static str,
    /// Share of explored cells on which the maps agree, mean over the survey.
    pub agreement_mean: f64,
    /// Seconds until a change of the vehicle's map is on the operator's: median.
    pub age_s_median: f64,
    pub age_s_p95: f64,
    pub age_s_max: f64,
    /// Mutual information of the operator's map with the true classes at the end of the survey, nats.
    pub mutual_information_nats: Option<f64>,
    /// Number of bits that the vehicle put on air.
    pub sent_bits: u64,
    /// Bytes of map data; those of directives, exemplars and fixes are the same for both streams.
    pub map_bytes: u64,
}

/// Runs the same mission at four budgets, for the delta stream and for whole PNGs.
pub fn fidelity(
    config: &Config,
    world: &World,
    seed: u64,
    progress: &mut dyn FnMut(&FidelityRow),
) -> Result<Vec<FidelityRow>, UserError> {
    let mut rows = Vec::new();
    for budget_bps in [100, 250, 1000, 10_000] {
        let mut delta = config.clone();
        delta.link.budget_bps = budget_bps;
        let whole = whole_png(&delta);
        for (stream, config) in [("delta", delta), ("whole-png", whole)] {
            let row = run(config, world, seed, budget_bps, stream)?;
            progress(&row);
            rows.push(row);
        }
    }
    Ok(rows)
}

fn run(
    config: Config,
    world: &World,
    seed: u64,
    budget_bps: u32,
    stream: &'static str,
) -> Result<FidelityRow, UserError> {
    let mut mission = Mission::new(config, MissionOptions { world: world.clone(), seed, record: None })?;
    mission.run(Duration::ZERO, &mut |_| {})?;
    let operator = mission.operator_map();
    let [median, p95, max] = mission.meters.labels.delays(mission.now()).summary();
    let stats = mission.vehicle().stats();
    let class = if stream == "delta" {
        scenecast_protocol::schedule::Class::Map
    } else {
        scenecast_protocol::schedule::Class::Exemplar
    };
    Ok(FidelityRow {
        budget_bps,
        stream,
        agreement_mean: mission.meters.labels.agreement_mean(),
        age_s_median: median,
        age_s_p95: p95,
        age_s_max: max,
        mutual_information_nats: mission.mutual_information(&operator).map(|v| v.0),
        sent_bits: mission.audits()[0].total_bits(),
        map_bytes: stats.bytes_by_class.get(&class).copied().unwrap_or(0),
    })
}
