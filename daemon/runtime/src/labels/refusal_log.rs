//! The lines of the log about refused items.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// Most lines in [`PAUSE`]; further refusals are counted.
const LINES: u32 = 10;
const PAUSE: Duration = Duration::from_secs(1);
/// Shortest time between two lines with the same origin and the same reason: a topic repeats its refused message for ever.
const REPEAT_INTERVAL: Duration = Duration::from_secs(30);

/// Refused items so far, and which of them the log has.
#[derive(Debug, Default)]
pub(super) struct RefusalLog {
    refused: u64,
    /// Refused items since the last line.
    unsaid: u64,
    /// The beginning of a pause, and the lines since then.
    lines: Option<(Instant, u32)>,
    /// The last time of each text. [`LINES`] bounds its size, since older ones are forgotten.
    said: BTreeMap<String, Instant>,
}

impl RefusalLog {
    pub(super) fn refused(&self) -> u64 {
        self.refused
    }

    /// Counts a refused item; returns the line of the log if it has one.
    pub(super) fn count(&mut self, text: String, now: Instant) -> Option<String> {
        self.refused += 1;
        let is_within = |since: Instant, time: Duration| now.saturating_duration_since(since) < time;
        let (since, lines) = self.lines.filter(|&(since, _)| is_within(since, PAUSE)).unwrap_or((now, 0));
        let is_repeated = self.said.get(&text).is_some_and(|&at| is_within(at, REPEAT_INTERVAL));
        if is_repeated || lines >= LINES {
            self.unsaid += 1;
            return None;
        }
        self.lines = Some((since, lines + 1));
        let more = match std::mem::take(&mut self.unsaid) {
            0 => String::new(),
            others => format!(", {others} of them since the last line"),
        };
        let line = format!("{text}; refused so far: {}{more}", self.refused);
        self.said.retain(|_, at| is_within(*at, REPEAT_INTERVAL));
        self.said.insert(text, now);
        Some(line)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_repeated_refusal_is_logged_rarely() {
        let (mut log, start) = (RefusalLog::default(), Instant::now());
        let mut lines = Vec::new();
        for tenth in 0..=300 {
            let now = start + Duration::from_millis(100 * tenth);
            for band in ["slope", "rough"] {
                lines.extend(log.count(format!("/map: band {band:?}"), now));
            }
        }
        let expected = [
            "/map: band \"slope\"; refused so far: 1",
            "/map: band \"rough\"; refused so far: 2",
            "/map: band \"slope\"; refused so far: 601, 598 of them since the last line",
            "/map: band \"rough\"; refused so far: 602",
        ];
        assert_eq!((lines, log.refused()), (expected.map(str::to_owned).to_vec(), 602));
    }

    #[test]
    fn distinct_refusals_are_bounded_in_lines_and_memory() {
        let (mut log, start) = (RefusalLog::default(), Instant::now());
        let at = |ms| start + Duration::from_millis(ms);
        let lines = (0..100_000).filter_map(|i| log.count(format!("{i}.json: class 255"), at(i))).count();
        assert_eq!((lines, log.refused()), (1000, 100_000));
        assert!(log.said.len() <= 310, "{}", log.said.len());
    }
}
