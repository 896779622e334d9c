//! Figures that several measurements of the link have.

use super::bench::{LinkBench, WINDOW};
use scenecast_protocol::schedule::Audit;

/// Ratio of the fullest window of any transmitter to the budget of a window plus one transmission.
pub fn budget_use(bench: &LinkBench) -> f64 {
    let budget = f64::from(bench.setting().budget_bps) * WINDOW.as_secs_f64();
    let of = |audit: &Audit| audit.worst_window_bits() as f64 / (budget + audit.largest_bits() as f64);
    bench.vehicles.iter().map(|v| of(v.host.audit())).fold(of(bench.surface.audit()), f64::max)
}

/// Rounds to a thousandth, the precision of the measurements.
pub fn round(value: f64) -> f64 {
    (value * 1000.0).round() / 1000.0
}
