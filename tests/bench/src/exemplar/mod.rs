//! Exemplars: their arrival times under full load, and their bytes.

mod arrival;
mod bytes;
mod command;
#[cfg(test)]
mod tests;

pub use arrival::{ArrivalSetting, Arrivals, arrivals};
pub use bytes::{Bytes, PatchSource, photos, sizes};
pub(crate) use command::ExemplarBench;

/// Median, 95th percentile and maximum of a sample.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Spread {
    pub median: f64,
    pub p95: f64,
    pub max: f64,
}

impl Spread {
    /// The spread of values; `None` for an empty sample.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Option<Self> {
        let mut values: Vec<f64> = values.into_iter().collect();
        values.sort_by(f64::total_cmp);
        let last = values.len().checked_sub(1)?;
        let at = |share: f64| (values[(share * last as f64).round() as usize] * 100.0).round() / 100.0;
        Some(Self { median: at(0.5), p95: at(0.95), max: at(1.0) })
    }
}
