//! Loss replayed from a record: a trace of losses over time, or the frames of a real link.

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

/// How far a frame may be from a recorded one to share its fate.
const TOLERANCE: Duration = Duration::from_millis(100);
/// Over how much time before and after it a frame between the recorded ones counts them.
const SURROUNDINGS: Duration = Duration::from_secs(60);

/// One direction of a link, of which it is known for each frame whether it arrived.
///
/// A frame whose end arrives within 0.1 s of the end of a recorded one shares its fate, so that the same traffic loses the same frames.
/// Another frame is lost with the share of the recorded ones that were lost within a minute of it. After its end the record
/// starts again.
///
/// ```
/// use sim_channel::Duration;
/// use sim_channel::loss::Replayed;
///
/// let frames = [(0, true), (2, false), (4, true), (6, true)].map(|(s, delivered)| (Duration::from_secs(s), delivered));
/// assert_eq!(Replayed::new(frames).unwrap().loss_rate(), 0.25);
/// ```
#[derive(Clone, PartialEq, Debug)]
pub struct Replayed {
    /// When the end of each frame arrived, or would have, since the start of the run, and whether it did.
    frames: Arc<[(Duration, bool)]>,
    period: Duration,
}

impl Replayed {
    /// A link that carried these frames; `None` without any.
    #[must_use]
    pub fn new(frames: impl IntoIterator<Item = (Duration, bool)>) -> Option<Self> {
        let mut frames: Vec<(Duration, bool)> = frames.into_iter().collect();
        frames.sort_by_key(|(at, _)| *at);
        let period = frames.last()?.0 + SURROUNDINGS;
        Some(Self { frames: frames.into(), period })
    }

    /// Share of the frames that were lost, 0..=1.
    #[must_use]
    pub fn loss_rate(&self) -> f64 {
        share_lost(&self.frames)
    }

    pub(super) fn instance(&self) -> Box<dyn LinkLoss> {
        Box::new(self.clone())
    }

    /// The fate of the recorded frame that ended next to this time, if there is one.
    fn fate(&self, end: Duration) -> Option<bool> {
        let after = self.frames.partition_point(|(at, _)| *at < end);
        let near = [after.checked_sub(1), Some(after)].into_iter().flatten();
        let nearest = near.filter_map(|index| self.frames.get(index)).min_by_key(|(at, _)| at.abs_diff(end))?;
        (nearest.0.abs_diff(end) <= TOLERANCE).then_some(nearest.1)
    }

    /// The share of frames that were lost around this time; that of the whole record where it has none.
    fn loss_around(&self, end: Duration) -> f64 {
        let from = self.frames.partition_point(|(at, _)| *at + SURROUNDINGS < end);
        let to = self.frames.partition_point(|(at, _)| *at <= end + SURROUNDINGS);
        match self.frames.get(from..to) {
            Some(around) if !around.is_empty() => share_lost(around),
            _ => self.loss_rate(),
        }
    }
}

fn share_lost(frames: &[(Duration, bool)]) -> f64 {
    frames.iter().filter(|(_, delivered)| !delivered).count() as f64 / frames.len().max(1) as f64
}

impl LinkLoss for Replayed {
    fn draw_fate(&mut self, frame: &FrameContext, rng: &mut RandomStream) -> FrameFate {
        let end = frame.at + frame.airtime;
        let end = Duration::from_nanos((end.as_nanos() % self.period.as_nanos().max(1)) as u64);
        let delivered = self.fate(end).unwrap_or_else(|| !rng.bernoulli(self.loss_around(end)));
        FrameFate::lost_if(!delivered)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::loss::LossModel;
    use crate::loss::tests::{losses, share};

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

    fn replayed(frames: &[(u64, bool)]) -> Replayed {
        Replayed::new(frames.iter().map(|&(ms, delivered)| (Duration::from_millis(ms), delivered))).unwrap()
    }

    #[test]
    fn the_same_frames_are_lost_again() {
        // Frames of `losses` begin each second and end half a second later.
        let recorded: Vec<(u64, bool)> = (0..40).map(|n| (1000 * n + 540 - n % 3 * 40, n % 4 != 1)).collect();
        let lost = losses(&LossModel::from(replayed(&recorded)), Duration::from_secs(1), 40);
        assert_eq!(lost, recorded.iter().map(|(_, delivered)| !delivered).collect::<Vec<_>>());
    }

    #[test]
    fn other_frames_are_lost_as_often_as_those_around_them() {
        let quiet = (0..300).map(|n| (1000 * n, true));
        let loud = (300..600).map(|n| (1000 * n, n % 2 == 0));
        let model = LossModel::from(replayed(&quiet.chain(loud).collect::<Vec<_>>()));
        let lost = losses(&model, Duration::from_secs(1), 600);
        assert_eq!(share(&lost[..230]), 0.0);
        assert!((0.35..0.65).contains(&share(&lost[370..])), "{}", share(&lost[370..]));
    }

    #[test]
    fn the_record_starts_again_after_its_end() {
        let model = replayed(&[(500, false), (1500, true)]);
        assert_eq!(model.fate(Duration::from_millis(450)), Some(false));
        let lost = losses(&LossModel::from(model), Duration::from_millis(61_500), 2);
        assert_eq!(lost, [true, true], "a frame at 0 s and one a period later");
        assert_eq!(Replayed::new([]), None);
    }
}
