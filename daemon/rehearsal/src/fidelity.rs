//! The operator's map over time at a given bit budget.

use super::baseline::whole_png;
use super::mission::{MapQuality, Mission, MissionOptions};
use super::quality::{Curve, Line, Panel};
use super::uplink::{Repeats, Uplink};
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
    /// Both maps at the end of the survey.
    pub end: MapQuality,
    /// The operator's mutual information divided by the vehicle's, after the best rigid fit: at the end, and mean over the
    /// survey.
    pub operator_share: Option<f64>,
    pub operator_share_mean: Option<f64>,
    /// Number of bits that the vehicle put on air.
    pub sent_bits: u64,
    /// The vehicle's bytes; whole PNG files count as map.
    pub uplink_bytes: Uplink,
    /// The part of these bytes that is map, and the part that belongs to frames of mainly map, 0..=1.
    pub map_share: f64,
    pub map_frames_share: f64,
    /// Copies of the vehicle's frames.
    pub repeats: Repeats,
    /// Energy that the vehicle's modem has transmitted with, joules, in all and for each bit of the map that arrived.
    pub energy_j: Option<f64>,
    pub energy_per_map_bit_j: Option<f64>,
    /// Both maps over time.
    pub series: Vec<MapQuality>,
}

/// Runs the same mission at each budget, for the delta stream and for whole PNGs.
pub fn fidelity(
    config: &Config,
    world: &World,
    seed: u64,
    budgets_bps: &[u32],
    progress: &mut dyn FnMut(&FidelityRow),
) -> Result<Vec<FidelityRow>, UserError> {
    let mut rows = Vec::new();
    for &budget_bps in budgets_bps {
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
    let [median, p95, max] = mission.meters.labels.delays(mission.now()).summary();
    let (uplink_bytes, by_kind) = (Uplink::of(&mission), &mission.frames().up);
    let of_map = by_kind.get(mission.map_class().name()).map_or(0, |sum| sum.bytes);
    let end = mission.quality();
    let series: Vec<MapQuality> = mission.quality_series().iter().copied().chain([end]).collect();
    Ok(FidelityRow {
        budget_bps,
        stream,
        agreement_mean: mission.meters.labels.agreement_mean(),
        age_s_median: median,
        age_s_p95: p95,
        age_s_max: max,
        end,
        operator_share: end.operator_share(),
        operator_share_mean: mean_share(&series),
        sent_bits: mission.audits()[0].total_bits(),
        map_share: uplink_bytes.map_share(),
        map_frames_share: of_map as f64 / by_kind.values().map(|sum| sum.bytes).sum::<u64>().max(1) as f64,
        repeats: Repeats::of(&mission),
        energy_j: mission.energy_j().map(|[up, _]| up),
        energy_per_map_bit_j: mission.energy_per_map_bit_j(),
        uplink_bytes,
        series,
    })
}

/// The operator's information over that of the vehicle, both added up over time.
pub(crate) fn mean_share(series: &[MapQuality]) -> Option<f64> {
    let sum = |of: fn(&MapQuality) -> Option<f64>| series.iter().map(of).sum::<Option<f64>>();
    let vehicle = sum(|s| s.vehicle.map(|v| v.rigid_nats)).filter(|nats| *nats > 0.0)?;
    Some(sum(|s| s.operator.map(|o| o.rigid_nats))? / vehicle)
}

/// A chart for each budget: the information of both maps over time, for both streams.
pub fn fidelity_panels(rows: &[FidelityRow]) -> Vec<Panel> {
    let of_budget = |rows: &[FidelityRow]| {
        let mut curves = Vec::new();
        for row in rows {
            let line = if row.stream == "delta" { Line::OURS } else { Line::BASELINE };
            let mut curve = |name: String, line, of: &dyn Fn(&MapQuality) -> Option<f64>| {
                curves.push(Curve::new(&name, line, &row.series, of));
            };
            if row.stream == "delta" {
                curve("vehicle, rigid".into(), Line::REFERENCE, &|s| s.vehicle.map(|i| i.rigid_nats));
                curve("vehicle, placed".into(), Line::REFERENCE.thin(), &|s| s.vehicle.map(|i| i.placed_nats));
            }
            curve(format!("{}, rigid", row.stream), line, &|s| s.operator.map(|i| i.rigid_nats));
            curve(format!("{}, placed", row.stream), line.thin(), &|s| s.operator.map(|i| i.placed_nats));
        }
        let budget_bps = rows.first().map_or(0, |row| row.budget_bps);
        Panel { title: format!("{budget_bps} bit/s"), unit: "nats", curves }
    };
    rows.chunk_by(|a, b| a.budget_bps == b.budget_bps).map(of_budget).collect()
}
