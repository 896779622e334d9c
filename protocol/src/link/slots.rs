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

/// Whether a version of a slot counts as received.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Admission {
    /// No version of the series that is as late was received before.
    New,
    /// This version of the series or a later one was received before.
    Known,
    /// The series has ended; the report names it.
    SeriesEnded,
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

    /// Judges a version of a series; a new one counts as received from now on.
    pub fn admit(&mut self, series: Series, slot: &VersionedSlot) -> Admission {
        if self.state.retired.contains(&series) {
            if let Some(report) = self.reports.get_mut(slot.id.index()) {
                *report = SlotReport { version_low: slot.version as u8, state: SlotState::SeriesEnded };
            }
            return Admission::SeriesEnded;
        }
        if self.state.series != Some(series) {
            self.begin_series(series);
        }
        let i = slot.id.index();
        let (Some(seen), Some(report)) = (self.state.versions.get_mut(i), self.reports.get_mut(i)) else {
            return Admission::Known;
        };
        if seen.is_some_and(|v| (slot.version.wrapping_sub(v) as i16) <= 0) {
            return Admission::Known;
        }
        *seen = Some(slot.version);
        *report = SlotReport { version_low: slot.version as u8, state: SlotState::Pending };
        Admission::New
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
                if inbox.admit(Series::from_random(series), &slot(version)) == Admission::New {
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
        assert_eq!([inbox.admit(ended, &slot(3)), inbox.admit(present, &slot(1))], [Admission::New; 2]);
        inbox.decide(SlotId::Utility, SlotState::Applied);
        assert_eq!(inbox.admit(ended, &slot(4)), Admission::SeriesEnded);
        let named = SlotReport { version_low: 4, state: SlotState::SeriesEnded };
        assert_eq!(inbox.reports()[SlotId::Utility.index()], named);
        let after = SlotInbox::restore(inbox.state().clone()).reports()[SlotId::Utility.index()];
        assert_eq!(after, SlotReport { version_low: 1, state: SlotState::Applied }, "the decision is kept");
    }

    #[test]
    fn versions_wrap_without_going_back() {
        let (mut inbox, series) = (SlotInbox::default(), Series::from_random(1));
        let admissions = [65_535, 0, 65_535].map(|version| inbox.admit(series, &slot(version)));
        assert_eq!(admissions, [Admission::New, Admission::New, Admission::Known]);
    }
}
