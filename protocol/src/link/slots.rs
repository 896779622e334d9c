//! The vehicle's side of the directive: it decides about each version of each slot once.

use crate::directive::Series;
use crate::directive::{SLOTS, SlotId, SlotReport, SlotState, VersionedSlot};
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

/// The state that must survive a restart of the vehicle, so that no order is applied twice.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct SlotInboxState {
    /// The series of the surface's orders.
    pub series: Option<Series>,
    /// Series that have ended, oldest first.
    pub retired: VecDeque<Series>,
    /// The latest version received, by slot.
    pub versions: [Option<u16>; SLOTS],
    /// The decision about that version in the code of the report, by slot.
    pub decisions: [u8; SLOTS],
}

impl SlotInboxState {
    /// Notes the decision about the latest version of a slot.
    pub fn decide(&mut self, id: SlotId, state: SlotState) {
        if let Some(decision) = self.decisions.get_mut(id.index()) {
            *decision = state.code();
        }
    }
}

/// Filters the slots that come in, and keeps the decisions for the report.
#[derive(Debug, Default)]
pub struct SlotInbox {
    state: SlotInboxState,
    reports: [SlotReport; SLOTS],
}

impl SlotInbox {
    /// Ended series that are remembered.
    const MEMORY: usize = 16;

    /// An inbox that continues from the state that survived.
    pub fn restore(state: SlotInboxState) -> Self {
        let mut reports = [SlotReport::default(); SLOTS];
        for (report, (version, code)) in reports.iter_mut().zip(state.versions.into_iter().zip(state.decisions)) {
            if let (Some(version), Some(state)) = (version, SlotState::from_code(code)) {
                *report = SlotReport { version_low: version as u8, state };
            }
        }
        Self { state, reports }
    }

    /// The state that must survive a restart.
    pub fn state(&self) -> &SlotInboxState {
        &self.state
    }

    /// The decisions, as the status reports them.
    pub fn reports(&self) -> [SlotReport; SLOTS] {
        self.reports
    }

    /// Whether a version of a series is new; if so, it counts as received from now on. A version of a series that has
    /// ended is not, and the report names it.
    pub fn admit(&mut self, series: Series, slot: &VersionedSlot) -> bool {
        if self.state.retired.contains(&series) {
            if let Some(report) = self.reports.get_mut(slot.id.index()) {
                *report = SlotReport { version_low: slot.version as u8, state: SlotState::SeriesEnded };
            }
            return false;
        }
        if self.state.series != Some(series) {
            self.begin_series(series);
        }
        let i = slot.id.index();
        let (Some(seen), Some(report)) = (self.state.versions.get_mut(i), self.reports.get_mut(i)) else {
            return false;
        };
        let newer = seen.is_none_or(|v| (slot.version.wrapping_sub(v) as i16) > 0);
        if newer {
            *seen = Some(slot.version);
            *report = SlotReport { version_low: slot.version as u8, state: SlotState::Pending };
        }
        newer
    }

    /// Keeps the host's decision about the latest version of a slot.
    pub fn decide(&mut self, id: SlotId, state: SlotState) {
        let i = id.index();
        if let (Some(&Some(version)), Some(report)) = (self.state.versions.get(i), self.reports.get_mut(i)) {
            *report = SlotReport { version_low: version as u8, state };
            self.state.decide(id, state);
        }
    }

    fn begin_series(&mut self, series: Series) {
        if let Some(old) = self.state.series.replace(series) {
            self.state.retired.push_back(old);
            if self.state.retired.len() > Self::MEMORY {
                self.state.retired.pop_front();
            }
        }
        self.state.versions = [None; SLOTS];
        self.state.decisions = [0; SLOTS];
        self.reports = [SlotReport::default(); SLOTS];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    fn slot(version: u16) -> VersionedSlot {
        VersionedSlot { id: SlotId::Utility, version, content: None }
    }

    proptest! {
        #[test]
        fn no_version_is_admitted_twice_even_across_restarts(
            arrivals in proptest::collection::vec((0u64..4, 1u16..30, any::<bool>()), 1..200),
        ) {
            let mut inbox = SlotInbox::default();
            let mut admitted = BTreeSet::new();
            for (series, version, restart) in arrivals {
                if inbox.admit(Series::from_random(series), &slot(version)) {
                    prop_assert!(admitted.insert((series, version)));
                }
                if restart {
                    inbox = SlotInbox::restore(inbox.state().clone());
                }
            }
        }
    }

    #[test]
    fn the_report_names_a_version_of_a_series_that_has_ended() {
        let (mut inbox, [ended, present]) = (SlotInbox::default(), [1, 2].map(Series::from_random));
        assert!(inbox.admit(ended, &slot(3)) && inbox.admit(present, &slot(1)));
        inbox.decide(SlotId::Utility, SlotState::Applied);
        assert!(!inbox.admit(ended, &slot(4)));
        let named = SlotReport { version_low: 4, state: SlotState::SeriesEnded };
        assert_eq!(inbox.reports()[SlotId::Utility.index()], named);
        let after = SlotInbox::restore(inbox.state().clone()).reports()[SlotId::Utility.index()];
        assert_eq!(after, SlotReport { version_low: 1, state: SlotState::Applied }, "the decision is kept");
    }

    #[test]
    fn versions_wrap_without_going_back() {
        let (mut inbox, series) = (SlotInbox::default(), Series::from_random(1));
        assert!(inbox.admit(series, &slot(65_535)));
        assert!(inbox.admit(series, &slot(0)));
        assert!(!inbox.admit(series, &slot(65_535)));
    }
}
