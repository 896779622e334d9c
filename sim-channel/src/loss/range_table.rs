//! Loss from measured delivery against range.

#![cfg_attr(not(test), deny(clippy::indexing_slicing, clippy::unwrap_used, clippy::expect_used))]

use super::{FrameContext, FrameFate, LinkLoss};
use crate::random::RandomStream;
use std::sync::Arc;
use thiserror::Error;

/// Delivery ratios at measured ranges, with linear interpolation between them; the first and the last value hold outside.
///
/// ```
/// use sim_channel::loss::RangeTable;
///
/// let table = RangeTable::from_csv("# range_m delivery\n1000 0.9\n2000 0.5").unwrap();
/// assert!((table.delivery(1500.0) - 0.7).abs() < 1e-9);
/// ```
#[derive(Clone, PartialEq, Debug)]
pub struct RangeTable {
    points: Arc<[(f64, f64)]>,
}

/// An error in a table of delivery ratios.
#[derive(Clone, PartialEq, Eq, Debug, Error)]
#[non_exhaustive]
pub enum RangeTableError {
    /// A line is not a range in metres and a ratio 0..=1; lines count from 1.
    #[error("line {line}: expected range_m and delivery ratio 0..=1")]
    Line {
        /// Number of the line in the table.
        line: usize,
    },
    /// The table contains no point.
    #[error("no point found")]
    Empty,
}

impl RangeTable {
    /// Reads lines of range in metres and delivery ratio, separated by tab, blank, comma or semicolon.
    ///
    /// Lines that begin with `#` are skipped; the ranges may come in any order.
    ///
    /// # Errors
    ///
    /// The first wrong line, or [`RangeTableError::Empty`].
    pub fn from_csv(text: &str) -> Result<Self, RangeTableError> {
        let lines = (1..).zip(text.lines().map(str::trim));
        let points: Result<Vec<_>, _> = lines
            .filter(|(_, content)| !content.is_empty() && !content.starts_with('#'))
            .map(|(line, content)| point(content).ok_or(RangeTableError::Line { line }))
            .collect();
        let mut points = points?;
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        if points.is_empty() { Err(RangeTableError::Empty) } else { Ok(Self { points: points.into() }) }
    }

    /// Share of frames that are delivered at `range_m`, 0..=1.
    #[must_use]
    pub fn delivery(&self, range_m: f64) -> f64 {
        let after = self.points.partition_point(|(range, _)| *range <= range_m);
        let below = after.checked_sub(1).and_then(|index| self.points.get(index));
        match (below, self.points.get(after)) {
            (Some((r0, d0)), Some((r1, d1))) => d0 + (d1 - d0) * (range_m - r0) / (r1 - r0),
            (Some((_, only)), None) | (None, Some((_, only))) => *only,
            (None, None) => 0.0,
        }
    }

    pub(super) fn instance(&self) -> Box<dyn LinkLoss> {
        Box::new(self.clone())
    }
}

impl LinkLoss for RangeTable {
    fn draw_fate(&mut self, frame: &FrameContext, rng: &mut RandomStream) -> FrameFate {
        FrameFate::lost_if(rng.bernoulli(1.0 - self.delivery(frame.range_m)))
    }
}

fn point(line: &str) -> Option<(f64, f64)> {
    let mut fields = line.split(['\t', ' ', ',', ';']).filter(|field| !field.is_empty());
    let range: f64 = fields.next()?.parse().ok()?;
    let delivery: f64 = fields.next()?.parse().ok()?;
    (range.is_finite() && range >= 0.0 && (0.0..=1.0).contains(&delivery)).then_some((range, delivery))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::loss::tests::{losses, share};
    use std::time::Duration;

    const TABLE: &str = "# range_m delivery\n500\t0.9\n1500,0.5\n2000 0\n";

    #[test]
    fn delivery_lies_on_straight_lines() {
        let table = RangeTable::from_csv(TABLE).expect("table");
        for (range_m, delivery) in
            [(0.0, 0.9), (500.0, 0.9), (1000.0, 0.7), (1500.0, 0.5), (1750.0, 0.25), (9000.0, 0.0)]
        {
            assert!((table.delivery(range_m) - delivery).abs() < 1e-12);
        }
    }

    #[test]
    fn loss_at_a_kilometre_matches_the_table() {
        let model = RangeTable::from_csv(TABLE).expect("table").into();
        assert!((share(&losses(&model, Duration::from_secs(1), 50_000)) - 0.3).abs() < 0.01);
    }

    #[test]
    fn a_wrong_line_is_named() {
        assert_eq!(RangeTable::from_csv("1 0.5\n2 1.5"), Err(RangeTableError::Line { line: 2 }));
        assert_eq!(RangeTable::from_csv("x"), Err(RangeTableError::Line { line: 1 }));
        assert_eq!(RangeTable::from_csv("\n"), Err(RangeTableError::Empty));
    }
}
