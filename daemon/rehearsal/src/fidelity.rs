//! The operator's map over time at a given bit budget: its agreement with the vehicle's, and its delay.

use super::baseline::{Baseline, Stream};
use super::frames_log::{Repeats, Uplink};
use super::meter::Delays;
use super::mission::{MapQuality, Mission, MissionOptions};
use super::quality::{Curve, Line, Panel};
use super::world::World;
use scenecast_config::Config;
use scenecast_core::UserError;
use scenecast_protocol::link::LinkStats;
use scenecast_protocol::schedule::Class;
use serde::Serialize;
use std::time::Duration;

/// One stream of the comparison.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FidelityRow {
    /// Bit budget of each end, bit/s.
    pub budget_bps: u32,
    /// The stream that carries the map: `delta` or `whole-png`.
    pub stream: &'static str,
    /// Share of explored cells on which the maps agree, mean over the survey.
    pub agreement_mean: f64,
    #[serde(flatten)]
    pub age: MapAge,
    /// Both maps at the end of the survey.
    pub end: MapQuality,
    /// The operator's mutual information divided by the vehicle's, after the best rigid fit: at the end, and mean over the
    /// survey.
    pub operator_share: Option<f64>,
    pub operator_share_mean: Option<f64>,
    /// Number of bits that the vehicle put on air.
    pub sent_bits: u64,
    /// The vehicle's bytes; parts of PNG files count as map.
    pub uplink_bytes: Uplink,
    /// The part of these bytes that is map, and the part that belongs to frames of mainly map, 0..=1.
    pub map_share: f64,
    pub map_frames_share: f64,
    /// Copies of the vehicle's frames.
    pub repeats: Repeats,
    #[serde(flatten)]
    pub energy: UplinkEnergy,
    /// The quality of the vehicle's and of the operator's map, a sample each 30 s.
    pub series: Vec<MapQuality>,
}

/// Seconds until a change of the vehicle's map is on the operator's.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct MapAge {
    pub age_s_median: f64,
    pub age_s_p95: f64,
    pub age_s_max: f64,
}

impl MapAge {
    fn of(delays: &Delays) -> Self {
        let [age_s_median, age_s_p95, age_s_max] = delays.summary();
        Self { age_s_median, age_s_p95, age_s_max }
    }
}

/// Energy that the vehicle's modem has transmitted with, joules; `None` where its power is not known.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct UplinkEnergy {
    /// Joules of all transmissions of the vehicle.
    pub energy_j: Option<f64>,
    /// For each bit of the map that arrived.
    pub energy_per_map_bit_j: Option<f64>,
}

impl UplinkEnergy {
    fn of(joules: Option<f64>, stats: &LinkStats) -> Self {
        Self { energy_j: joules, energy_per_map_bit_j: joules.and_then(|joules| per_map_bit(joules, stats)) }
    }
}

/// Time between two looks at the baseline.
const STEP: Duration = Duration::from_secs(1);

/// Runs the same mission at each budget, and beside it the links that carry its map as whole PNGs.
pub fn fidelity(
    config: &Config,
    world: &World,
    seed: u64,
    budgets_bps: &[u32],
    progress: &mut dyn FnMut(&FidelityRow),
) -> Result<Vec<FidelityRow>, UserError> {
    let mut rows = Vec::new();
    for &budget_bps in budgets_bps {
        let mut config = config.clone();
        config.link.budget_bps = budget_bps;
        let mut baseline = Baseline::new(&config, seed)?;
        let mut mission = Mission::new(config, MissionOptions { world: world.clone(), seed, record: None })?;
        mission.run_survey(STEP, &mut |mission| {
            baseline.follow(mission);
            Ok(())
        })?;
        for stream in [delta(&mission), baseline.stream(&mission)] {
            let row = FidelityRow::new(&mission, stream);
            progress(&row);
            rows.push(row);
        }
    }
    Ok(rows)
}

fn delta(mission: &Mission) -> Stream<'_> {
    Stream {
        name: "delta",
        labels: &mission.meters.labels,
        series: mission.quality_series(),
        end: mission.quality(),
        stats: mission.vehicle().stats(),
        sent_bits: mission.audits()[0].total_bits(),
        bits_on_air: mission.bits_on_air()[0],
        frames: mission.frames(),
        repeats: Repeats::of(mission.surface().view(mission.address()), mission.frames()),
    }
}

impl FidelityRow {
    fn new(mission: &Mission, stream: Stream<'_>) -> Self {
        let Stream { name, labels, end, stats, frames, .. } = stream;
        let uplink_bytes = Uplink::of(stats);
        let of_map = frames.up.get(Class::Map.name()).map_or(0, |sum| sum.bytes);
        let of_all: u64 = frames.up.values().map(|sum| sum.bytes).sum();
        let series: Vec<MapQuality> = stream.series.iter().copied().chain([end]).collect();
        Self {
            budget_bps: mission.config().link.budget_bps,
            stream: name,
            agreement_mean: labels.agreement_mean(),
            age: MapAge::of(&labels.delays(mission.now())),
            end,
            operator_share: end.operator_share(),
            operator_share_mean: mean_share(&series),
            sent_bits: stream.sent_bits,
            map_share: uplink_bytes.map_share(),
            map_frames_share: of_map as f64 / of_all.max(1) as f64,
            repeats: stream.repeats,
            energy: UplinkEnergy::of(mission.joules(stream.bits_on_air), stats),
            uplink_bytes,
            series,
        }
    }
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

impl Mission {
    /// Energy that the modem of an end transmits so many bits with, joules; `None` if it is not counted.
    pub(crate) fn joules(&self, bits: u64) -> Option<f64> {
        Some(bits as f64 * scenecast_config::joules_per_bit(&self.config, self.modem())?)
    }

    /// Energy that the modems of vehicle and surface have transmitted with, joules; `None` if it is not counted.
    pub fn energy_j(&self) -> Option<[f64; 2]> {
        let [up, down] = self.bits_on_air().map(|bits| self.joules(bits));
        Some([up?, down?])
    }

    /// The vehicle's energy divided by the bits of the map that the surface has acknowledged, joules; `None` without any, or if
    /// energy is not counted.
    pub fn energy_per_map_bit_j(&self) -> Option<f64> {
        per_map_bit(self.energy_j()?[0], self.vehicle().stats())
    }
}

/// The energy divided by the bits of the map that the surface has acknowledged; `None` without any.
pub(crate) fn per_map_bit(joules: f64, stats: &LinkStats) -> Option<f64> {
    let delivered = stats.delivered_by_class.get(&Class::Map).copied().filter(|&bytes| bytes > 0)?;
    Some(joules / (delivered * 8) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn at_a_small_budget_the_operator_learns_less_from_whole_pngs() {
        let is_full = std::env::var_os("SCENECAST_FULL").is_some();
        let duration = if is_full { "survey.duration_s=240" } else { "survey.duration_s=120" };
        let sets = [duration, "camera.width_px=320", "camera.height_px=240", "channel.loss=0.1"];
        let config = scenecast_config::load(None, &sets.map(str::to_owned)).unwrap();
        let rows = fidelity(&config, &World::patches(5, 0.01), 3, &[300], &mut |_| {}).unwrap();
        let [delta, whole] = rows.try_into().unwrap();
        assert_eq!((delta.stream, whole.stream), ("delta", "whole-png"));
        let vehicle = |row: &FidelityRow| row.series.iter().map(|s| (s.t_s, s.vehicle)).collect::<Vec<_>>();
        assert_eq!(vehicle(&delta), vehicle(&whole), "it is one mission");
        assert!(whole.operator_share_mean < delta.operator_share_mean && whole.operator_share_mean > Some(0.0));
        assert!(whole.uplink_bytes.map > 0 && whole.uplink_bytes.other == 0, "{:?}", whole.uplink_bytes);
    }
}
