//! What the last minutes brought to the map: the number of cells of each label over time.

use scenecast_protocol::time::Instant;
use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

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
