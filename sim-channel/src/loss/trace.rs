//! Loss replayed from a record.

#![cfg_attr(not(test), deny(clippy::indexing_slicing, clippy::unwrap_used, clippy::expect_used))]

use super::{FrameContext, FrameFate, LinkLoss};
use crate::random::RandomStream;
use std::sync::Arc;
use std::time::Duration;
use thiserror::Error;

/// A record of the frames that got through and of those that did not.
///
/// ```
/// use sim_channel::Duration;
/// use sim_channel::loss::Trace;
///
/// let trace = Trace::from_csv("time_s,delivered\n0,1\n2,0\n4,1\n6,1").unwrap();
/// assert_eq!((trace.loss_rate(), trace.period()), (0.25, Duration::from_secs(8)));
/// ```
///
/// A frame has the fate of the last record at or before the time at which it begins to arrive. After its end the record
/// starts again, one mean spacing later.
#[derive(Clone, PartialEq, Debug)]
pub struct Trace {
    records: Arc<[TraceRecord]>,
    period: Duration,
}

#[derive(Clone, Copy, PartialEq, Debug)]
struct TraceRecord {
    /// Time since the first record.
    at: Duration,
    delivered: bool,
}

/// An error in a record of losses.
#[derive(Clone, PartialEq, Eq, Debug, Error)]
#[non_exhaustive]
pub enum TraceError {
    /// A line is not `time,delivered`; lines count from 1.
    #[error("line {line}: expected time_s,delivered (0 or 1)")]
    Line {
        /// Number of the line in the record.
        line: usize,
    },
    /// The text contains no record.
    #[error("no record found")]
    Empty,
}

impl Trace {
    /// Reads lines `time,delivered`: seconds, then 0 or 1 (or false, true).
    ///
    /// A header and lines that begin with `#` are skipped.
    ///
    /// # Errors
    ///
    /// The first wrong line, or [`TraceError::Empty`].
    pub fn from_csv(text: &str) -> Result<Self, TraceError> {
        let mut records = Vec::new();
        for (line, content) in (1..).zip(text.lines().map(str::trim)) {
            if content.is_empty() || content.starts_with('#') {
                continue;
            }
            match csv_record(content) {
                Some(record) => records.push(record),
                None if line == 1 => {}
                None => return Err(TraceError::Line { line }),
            }
        }
        Self::from_records(records)
    }

    /// Reads a `frames.log` of scenecast: lines `time_s direction bytes kind lost`, separated by blanks, commas or tabs.
    ///
    /// Only lines of `direction` are used, if it is given. Other lines are skipped, so that a log that ends in mid-line
    /// can be read. The field `lost` means a lost frame unless it is empty, 0, `false`, `no`, `ok`, `-` or `delivered`;
    /// a line with `open` is skipped.
    ///
    /// # Errors
    ///
    /// [`TraceError::Empty`] if no line is a record.
    pub fn from_frames_log(text: &str, direction: Option<&str>) -> Result<Self, TraceError> {
        Self::from_records(text.lines().filter_map(|line| log_record(line, direction)).collect())
    }

    /// Share of the records that were lost, 0..=1.
    #[must_use]
    pub fn loss_rate(&self) -> f64 {
        self.records.iter().filter(|record| !record.delivered).count() as f64 / self.records.len() as f64
    }

    /// Time after which the record starts again.
    #[must_use]
    pub fn period(&self) -> Duration {
        self.period
    }

    fn from_records(mut timed: Vec<(f64, bool)>) -> Result<Self, TraceError> {
        timed.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (Some(first), Some(last)) = (timed.first().copied(), timed.last().copied()) else {
            return Err(TraceError::Empty);
        };
        let length = last.0 - first.0;
        let spacing = if timed.len() > 1 { length / (timed.len() - 1) as f64 } else { 1.0 };
        let record =
            |(at, delivered): (f64, bool)| TraceRecord { at: Duration::from_secs_f64(at - first.0), delivered };
        let period = Duration::from_secs_f64(length + spacing).max(Duration::from_nanos(1));
        Ok(Self { records: timed.into_iter().map(record).collect(), period })
    }

    fn delivered_at(&self, at: Duration) -> bool {
        let within = Duration::from_nanos((at.as_nanos() % self.period.as_nanos()) as u64);
        let after = self.records.partition_point(|record| record.at <= within);
        after.checked_sub(1).and_then(|index| self.records.get(index)).is_none_or(|record| record.delivered)
    }

    pub(super) fn instance(&self) -> Box<dyn LinkLoss> {
        Box::new(self.clone())
    }
}

impl LinkLoss for Trace {
    fn draw_fate(&mut self, frame: &FrameContext, _chance: &mut RandomStream) -> FrameFate {
        FrameFate::lost_if(!self.delivered_at(frame.at))
    }
}

/// A time in seconds within 0..=10^9, which a `Duration` can hold.
fn seconds(text: &str) -> Option<f64> {
    text.trim().parse().ok().filter(|at| (0.0..=1e9).contains(at))
}

fn csv_record(line: &str) -> Option<(f64, bool)> {
    let (at, delivered) = line.split_once([',', ';', '\t'])?;
    let delivered = match delivered.trim().to_ascii_lowercase().as_str() {
        "1" | "true" => true,
        "0" | "false" => false,
        _ => return None,
    };
    Some((seconds(at)?, delivered))
}

fn log_record(line: &str, wanted: Option<&str>) -> Option<(f64, bool)> {
    let mut fields = line.split([' ', '\t', ',']).filter(|field| !field.is_empty());
    let at = seconds(fields.next()?)?;
    let direction = fields.next()?;
    let _bytes: u64 = fields.next()?.parse().ok()?;
    let _kind = fields.next()?;
    let lost = fields.next().unwrap_or_default().to_ascii_lowercase();
    // The fate of a frame that was under way at the end of the log is not known.
    if lost == "open" {
        return None;
    }
    let delivered = matches!(lost.as_str(), "" | "0" | "false" | "no" | "ok" | "-" | "delivered");
    wanted.is_none_or(|wanted| wanted == direction).then_some((at, delivered))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frame_shares_the_fate_of_the_last_record() {
        let trace = Trace::from_csv("time,delivered\n10,1\n12,0\n14,1\n").expect("record");
        let fate = |s| trace.delivered_at(Duration::from_secs_f64(s));
        assert_eq!([0.0, 1.9, 2.0, 3.9, 4.0, 5.9].map(fate), [true, true, false, false, true, true]);
    }

    #[test]
    fn the_record_begins_again_after_its_end() {
        let trace = Trace::from_csv("0,0\n1,1\n2,1\n").expect("record");
        assert_eq!(trace.period(), Duration::from_secs(3));
        let fates: Vec<_> = (0..7).map(|s| trace.delivered_at(Duration::from_secs(s))).collect();
        assert_eq!(fates, [false, true, true, false, true, true, false]);
    }

    #[test]
    fn loss_rate_is_that_of_the_record() {
        let trace = Trace::from_csv("0,0\n1,1\n2,1\n3,0\n").expect("record");
        assert_eq!(trace.loss_rate(), 0.5);
    }

    #[test]
    fn frames_log_is_read_by_direction_and_tolerantly() {
        let log = "# time_s direction bytes kind lost\n0.5 up 256 map 0\n1.5 down 32 directive noise\n2.5 up 256 map 1\n3.5 up 25";
        let up = Trace::from_frames_log(log, Some("up")).expect("records");
        assert_eq!((up.records.len(), up.loss_rate()), (2, 0.5));
        assert_eq!(Trace::from_frames_log(log, Some("down")).expect("record").loss_rate(), 1.0);
        assert_eq!(Trace::from_frames_log(log, None).expect("records").records.len(), 3);
        assert_eq!(Trace::from_frames_log("", None), Err(TraceError::Empty));
    }

    #[test]
    fn frames_of_unknown_fate_are_skipped() {
        let log = "# time_s direction bytes kind fate [reason]\n1.000 up 256 map ok\n2.000 up 256 map lost noise\n3.000 up 64 status ok\n4.000 up 256 map open\n";
        let trace = Trace::from_frames_log(log, Some("up")).expect("records");
        assert_eq!((trace.records.len(), trace.loss_rate()), (3, 1.0 / 3.0));
    }

    #[test]
    fn a_wrong_line_is_named() {
        assert_eq!(Trace::from_csv("0,1\n1,perhaps\n"), Err(TraceError::Line { line: 2 }));
        assert_eq!(Trace::from_csv("0,1\n-4,1\n"), Err(TraceError::Line { line: 2 }));
        assert_eq!(Trace::from_csv("a,b\n"), Err(TraceError::Empty));
    }
}
