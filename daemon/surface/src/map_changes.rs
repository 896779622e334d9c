//! The corrections of a map, and the cells that its labels gained.

use scenecast_protocol::map::Relabelled;
use scenecast_protocol::time::Instant;
use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

/// Watches for corrections of a map: samples of it, one after the other, in which many cells changed their label.
#[derive(Debug, Clone, Copy, Default)]
pub struct Corrections {
    last: Relabelled,
    /// What had changed before the correction that is under way, and the calm samples since its last busy one.
    begun: Option<(Relabelled, u32)>,
}

impl Corrections {
    /// A correction begins with a sample in which more than this share of the map changes, and at least so many cells.
    const BUSY: f64 = 0.03;
    const CELLS: u64 = 20;
    /// It has ended after so many samples with less.
    const CALM: u32 = 3;
    /// A smaller share is not reported.
    const REPORTED: f64 = 0.05;

    /// Takes all that has changed up to this sample of a map of so many cells. Returns what a correction has changed, once it has
    /// ended.
    pub fn handle_sample(&mut self, total: Relabelled, cells: usize) -> Option<Relabelled> {
        if total.cells < self.last.cells {
            *self = Self::default();
        }
        let before = std::mem::replace(&mut self.last, total);
        let change = total.since(before).cells;
        let is_busy = change >= Self::CELLS && change as f64 > Self::BUSY * cells as f64;
        match &mut self.begun {
            None if is_busy => self.begun = Some((before, 0)),
            Some((_, calm)) if is_busy => *calm = 0,
            Some((_, calm)) => *calm += 1,
            None => {}
        }
        let (before, _) = self.begun.take_if(|(_, calm)| *calm >= Self::CALM)?;
        let correction = total.since(before);
        (correction.cells as f64 >= Self::REPORTED * cells as f64).then_some(correction)
    }
}

/// The numbers of cells during the last five minutes.
#[derive(Debug, Clone, Default)]
pub struct LabelGains {
    samples: VecDeque<(Instant, BTreeMap<u8, u32>)>,
}

impl LabelGains {
    /// The time over which gains are counted.
    pub const SPAN: Duration = Duration::from_secs(300);
    const INTERVAL: Duration = Duration::from_secs(10);

    /// Whether the next sample is due.
    pub fn is_due(&self, now: Instant) -> bool {
        self.samples.back().is_none_or(|(at, _)| now.since(*at) >= Self::INTERVAL)
    }

    /// Takes the number of cells of each label.
    pub fn handle_cells(&mut self, cells: BTreeMap<u8, u32>, now: Instant) {
        self.samples.push_back((now, cells));
        while self.samples.get(1).is_some_and(|(at, _)| now.since(*at) >= Self::SPAN) {
            self.samples.pop_front();
        }
    }

    /// The cells that a label with `cells` cells has gained in the last five minutes, or since the first sample. Cells that
    /// other labels took from it count as negative.
    pub fn gained(&self, label: u8, cells: u32) -> i64 {
        let before = self.samples.front().and_then(|(_, before)| before.get(&label).copied());
        match self.samples.is_empty() {
            true => 0,
            false => i64::from(cells) - i64::from(before.unwrap_or(0)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The corrections in samples of a map of 1000 cells that change so many cells each, of four bytes a cell.
    fn corrections(changes: &[u64]) -> Vec<(usize, u64, u64)> {
        let (mut watch, mut total) = (Corrections::default(), Relabelled::default());
        let sample = |(at, &cells): (usize, &u64)| {
            total = Relabelled { cells: total.cells + cells, bytes: total.bytes + 4 * cells };
            watch.handle_sample(total, 1000).map(|found| (at, found.cells, found.bytes))
        };
        changes.iter().enumerate().filter_map(sample).collect()
    }

    #[test]
    fn a_correction_is_reported_once_with_all_that_it_took() {
        assert_eq!(corrections(&[0, 5, 80, 200, 2, 40, 0, 1, 0, 0, 0, 0]), [(8, 323, 1292)]);
    }

    #[test]
    fn occasional_changes_of_cells_are_no_correction() {
        assert_eq!(corrections(&[10; 60]), []);
        assert_eq!(corrections(&[35, 0, 0, 0, 0]), [], "too few");
    }

    #[test]
    fn the_map_of_another_run_starts_without_corrections() {
        let mut watch = Corrections::default();
        assert_eq!(watch.handle_sample(Relabelled { cells: 500, bytes: 9 }, 600), None);
        for _ in 0..9 {
            assert_eq!(watch.handle_sample(Relabelled::default(), 10), None);
        }
    }

    #[test]
    fn gains_are_those_of_the_last_five_minutes() {
        let mut gains = LabelGains::default();
        assert_eq!(gains.gained(1, 40), 0, "nothing is known yet");
        for second in 0..=900 {
            let now = Instant::from_secs_f64(f64::from(second));
            if gains.is_due(now) {
                gains.handle_cells([(1, second), (2, 50)].into(), now);
            }
        }
        assert_eq!(gains.gained(1, 900), 300);
        assert_eq!((gains.gained(2, 30), gains.gained(3, 7)), (-20, 7));
        assert!(gains.samples.len() <= 32);
    }
}
