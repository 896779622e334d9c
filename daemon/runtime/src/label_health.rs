//! What became of the items of other programs, for people.

use std::time::{Duration, Instant};

/// A refusal is a fault for this long.
const FAULT_LASTS: Duration = Duration::from_secs(10);

/// The state of the sources of labels and bands.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct LabelHealth {
    pub(crate) taken: u64,
    pub(crate) refused: u64,
    /// The last item that was refused, and why.
    pub(crate) last_refusal: Option<String>,
    /// Whether an item was refused in the last seconds, or a source is missing.
    pub(crate) is_failing: bool,
    /// Whether a folder is not there, a topic cannot be opened, or whoever read a source has ended.
    pub(crate) is_missing: bool,
}

/// Counts items that were taken or refused.
#[derive(Debug, Default)]
pub(crate) struct LabelTally {
    taken: u64,
    refused: u64,
    last_refusal: Option<(String, Instant)>,
    is_missing: bool,
}

impl LabelTally {
    pub(crate) fn take(&mut self) {
        self.taken += 1;
    }

    pub(crate) fn refuse(&mut self, text: String, now: Instant) {
        self.refused += 1;
        self.last_refusal = Some((text, now));
    }

    pub(crate) fn set_missing(&mut self, is_missing: bool) {
        self.is_missing = is_missing;
    }

    pub(crate) fn health(&self, now: Instant) -> LabelHealth {
        let last = self.last_refusal.as_ref();
        let is_new = last.is_some_and(|(_, at)| now.saturating_duration_since(*at) < FAULT_LASTS);
        LabelHealth {
            taken: self.taken,
            refused: self.refused,
            last_refusal: last.map(|(text, _)| text.clone()),
            is_failing: is_new || self.is_missing,
            is_missing: self.is_missing,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_refusal_is_a_fault_for_a_while() {
        let (mut tally, now) = (LabelTally::default(), Instant::now());
        tally.take();
        assert!(!tally.health(now).is_failing);
        tally.refuse("a.json: class 254".to_owned(), now);
        let health = tally.health(now + FAULT_LASTS / 2);
        assert_eq!((health.taken, health.refused, health.is_failing), (1, 1, true));
        let later = tally.health(now + FAULT_LASTS);
        assert!(!later.is_failing && later.last_refusal.is_some_and(|text| text.contains("class 254")));
        tally.set_missing(true);
        assert!(tally.health(now + FAULT_LASTS).is_failing);
    }
}
