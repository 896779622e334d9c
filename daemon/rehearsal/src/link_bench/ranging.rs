//! The cost of ranging, and the accuracy of the measured range.

use super::bench::{BIT_RATE_BPS, LinkBench, LinkSetting};
use super::figures::round;
use super::trial::Flow;
use scenecast_protocol::link::IssueError;
use serde::Serialize;
use sim_channel::LossModel;
use std::time::Duration;

const FIX_INTERVAL: Duration = Duration::from_secs(10);

/// One row: a fix every ten seconds, compared with no fixes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RangingRow {
    pub range_km: f64,
    /// Maximum length of a frame, bytes.
    pub frame_bytes: usize,
    /// Share of frames lost in each direction.
    pub loss: f64,
    pub efficiency: f64,
    pub efficiency_with_fixes: f64,
    /// Share of the efficiency that the fixes cost.
    pub cost: f64,
    /// Error of the two-way propagation time that the surface measured, ms.
    pub round_trip_error_ms: f64,
    /// Error of the one-way propagation time that the vehicle knows, ms.
    pub one_way_error_ms: f64,
}

/// Measures both rows, each over `time` of virtual time.
pub fn measure_ranging(time: Duration, seed: u64) -> Result<Vec<RangingRow>, IssueError> {
    [0.0, 0.1].into_iter().map(|loss| measure(loss, time, seed)).collect()
}

fn measure(loss: f64, time: Duration, seed: u64) -> Result<RangingRow, IssueError> {
    let setting = LinkSetting::new(1000.0, 256, LossModel::Independent { probability: loss });
    let efficiency = |flow: Flow| flow.useful_bps / (f64::from(BIT_RATE_BPS) * (1.0 - loss));
    let without = efficiency(LinkBench::under_load(&setting, seed).measure_flow(time, None)?);
    let mut bench = LinkBench::under_load(&setting, seed);
    let with = efficiency(bench.measure_flow(time, Some(FIX_INTERVAL))?);
    let error_ms = |measured: Option<Duration>, truth: Duration| {
        (measured.unwrap_or_default().as_secs_f64() - truth.as_secs_f64()) * 1000.0
    };
    let truth = setting.round_trip();
    Ok(RangingRow {
        range_km: 1.0,
        frame_bytes: 256,
        loss,
        efficiency: round(without),
        efficiency_with_fixes: round(with),
        cost: round(1.0 - with / without),
        round_trip_error_ms: round(error_ms(bench.view().and_then(|v| v.round_trip()), truth)),
        one_way_error_ms: round(error_ms(bench.vehicle().host.end().one_way(), truth / 2)),
    })
}
