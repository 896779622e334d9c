//! The vehicle's side of the directive: it decides about each version of each slot once.

use crate::directive::Series;
use crate::directive::{RefusalReason, SLOTS, SlotId, SlotReport, SlotState, VersionedSlot};
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

/// The orders of one series that a vehicle has received.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct SeriesRecord {
    /// The series that the versions and decisions belong to.
    pub series: Series,
    /// The latest version received, by slot.
    pub versions: [Option<u16>; SLOTS],
    /// The decision about that version in the code of the report, by slot; overtaken once another surface's order is applied.
    pub decisions: [u8; SLOTS],
}

/// The state that must survive a restart of the vehicle, so that no order is applied twice.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct SlotInboxState {
    /// The series of the surfaces that the vehicle has met, the one that it met or heard last at the end.
    pub records: VecDeque<SeriesRecord>,
}

impl SlotInboxState {
    /// Series that are remembered, the one met or heard last among them.
    const MEMORY: usize = 16;

    /// The series of the surface that was met or heard last.
    pub fn series(&self) -> Option<Series> {
        self.records.back().map(|record| record.series)
    }

    /// Notes the decision about the latest version of a slot in the series heard last. An applied order overtakes those of
    /// other surfaces.
    pub fn decide(&mut self, id: SlotId, state: SlotState) {
        let Some(present) = self.series() else { return };
        for record in &mut self.records {
            let is_other = !record.series.is_of_same_surface(present);
            let Some(decision) = record.decisions.get_mut(id.index()) else { continue };
            if record.series == present {
                *decision = state.code();
            } else if is_other && state == SlotState::Applied {
                *decision = OVERTAKEN.code();
            }
        }
    }

    fn record(&self, series: Series) -> Option<&SeriesRecord> {
        self.records.iter().find(|record| record.series == series)
    }

    /// Puts the record of a series at the end; returns whether it is a new one.
    fn meet(&mut self, series: Series) -> bool {
        let known = self.records.iter().position(|record| record.series == series);
        let record = known.and_then(|place| self.records.remove(place));
        self.records.push_back(record.unwrap_or(SeriesRecord {
            series,
            versions: [None; SLOTS],
            decisions: [0; SLOTS],
        }));
        if self.records.len() > Self::MEMORY {
            self.records.pop_front();
        }
        known.is_none()
    }

    /// Whether the newest order of a kind that was applied is of another surface, and newer than every order of `series`.
    fn is_overtaken(&self, series: Series, id: SlotId) -> bool {
        let decision = |record: &SeriesRecord| record.decisions.get(id.index()).copied().unwrap_or_default();
        match self.record(series).map_or(0, decision) {
            0 => {
                let others = self.records.iter().filter(|record| !record.series.is_of_same_surface(series));
                others.map(decision).any(|code| code == SlotState::Applied.code())
            }
            code => code == OVERTAKEN.code(),
        }
    }
}

const OVERTAKEN: SlotState = SlotState::Refused(RefusalReason::Overtaken);

/// Whether a version of a slot counts as received.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Admission {
    /// No version of the series that is as late was received before.
    New,
    /// This version of the series or a later one was received before.
    Known,
    /// Another surface has given a newer order of its kind, which the sender did not know; the report names it.
    Overtaken,
}

/// Filters the slots that come in, and keeps the decisions for the report.
#[derive(Debug, Default)]
pub struct SlotInbox {
    state: SlotInboxState,
    /// Whether the latest version of a slot waits for the decision.
    is_waiting: [bool; SLOTS],
}

impl SlotInbox {
    /// An inbox that continues from the state that survived.
    pub fn restore(state: SlotInboxState) -> Self {
        Self { state, is_waiting: [false; SLOTS] }
    }

    /// The state that must survive a restart.
    pub fn state(&self) -> &SlotInboxState {
        &self.state
    }

    /// Whether orders of a series, or none of them, are on record.
    pub fn knows(&self, series: Series) -> bool {
        self.state.record(series).is_some()
    }

    /// The surface of a series is heard: reports are to it from now on. Returns whether it was unknown.
    pub fn meet(&mut self, series: Series) -> bool {
        let is_same = self.state.series() == Some(series);
        if !is_same {
            self.is_waiting = [false; SLOTS];
        }
        !is_same && self.state.meet(series)
    }

    /// The decisions about the orders of the surface heard last, as the status reports them.
    pub fn reports(&self) -> [SlotReport; SLOTS] {
        let Some(record) = self.state.records.back() else { return Default::default() };
        let mut reports = [SlotReport::default(); SLOTS];
        for (id, report) in SlotId::ALL.into_iter().zip(&mut reports) {
            let of = id.index();
            let version = record.versions.get(of).copied().flatten();
            let decision = record.decisions.get(of).and_then(|&code| SlotState::from_code(code));
            report.version_low = version.unwrap_or_default() as u8;
            report.state = match decision.unwrap_or_default() {
                _ if self.is_waiting.get(of) == Some(&true) => SlotState::Pending,
                // A stop of the vehicle came before the decision.
                SlotState::Unknown if version.is_some() => SlotState::Refused(RefusalReason::Forgotten),
                SlotState::Unknown if self.state.is_overtaken(record.series, id) => OVERTAKEN,
                decided => decided,
            };
        }
        reports
    }

    /// Judges a version of a series; a new one counts as received from now on. `is_informed`: its sender knew the last
    /// report on its slot, or is to be obeyed at once.
    pub fn admit(&mut self, series: Series, slot: &VersionedSlot, is_informed: bool) -> Admission {
        self.meet(series);
        let (i, is_overtaken) = (slot.id.index(), self.state.is_overtaken(series, slot.id));
        let Some(record) = self.state.records.back_mut() else { return Admission::Known };
        let (Some(seen), Some(decision), Some(is_waiting)) =
            (record.versions.get_mut(i), record.decisions.get_mut(i), self.is_waiting.get_mut(i))
        else {
            return Admission::Known;
        };
        if seen.is_some_and(|v| (slot.version.wrapping_sub(v) as i16) <= 0) {
            return Admission::Known;
        }
        if is_overtaken && !is_informed {
            return Admission::Overtaken;
        }
        (*seen, *decision, *is_waiting) = (Some(slot.version), 0, true);
        Admission::New
    }

    /// Keeps the host's decision about the latest version of a slot.
    pub fn decide(&mut self, id: SlotId, state: SlotState) {
        let i = id.index();
        let is_received = self.state.records.back().is_some_and(|r| r.versions.get(i).is_some_and(Option::is_some));
        if let Some(is_waiting) = self.is_waiting.get_mut(i).filter(|_| is_received) {
            *is_waiting = state == SlotState::Pending;
            self.state.decide(id, state);
        }
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

    /// Series of surfaces that are far apart.
    fn series(number: u64) -> Series {
        Series::from_random(1 + (number << 20))
    }

    proptest! {
        #[test]
        fn no_version_is_admitted_twice_even_across_restarts(
            arrivals in proptest::collection::vec((0u64..4, 1u16..30, any::<[bool; 3]>()), 1..200),
        ) {
            let mut inbox = SlotInbox::default();
            let mut admitted = BTreeSet::new();
            for (number, version, [restart, is_informed, is_applied]) in arrivals {
                if inbox.admit(series(number), &slot(version), is_informed) == Admission::New {
                    prop_assert!(admitted.insert((number, version)));
                    if is_applied {
                        inbox.decide(SlotId::Utility, SlotState::Applied);
                    }
                }
                if restart {
                    inbox = SlotInbox::restore(inbox.state().clone());
                }
            }
        }
    }

    fn report(inbox: &SlotInbox) -> SlotReport {
        inbox.reports()[SlotId::Utility.index()]
    }

    #[test]
    fn an_order_from_a_surface_unaware_of_a_newer_one_is_overtaken() {
        let (mut inbox, [first, second, third]) = (SlotInbox::default(), [1, 2, 3].map(series));
        assert_eq!(inbox.admit(first, &slot(3), false), Admission::New);
        inbox.decide(SlotId::Utility, SlotState::Applied);
        assert_eq!(inbox.admit(second, &slot(1), false), Admission::Overtaken);
        assert_eq!(report(&inbox), SlotReport { version_low: 0, state: OVERTAKEN }, "by an order of the first surface");
        assert_eq!(inbox.admit(second, &slot(1), true), Admission::New);
        inbox.decide(SlotId::Utility, SlotState::Applied);
        inbox = SlotInbox::restore(inbox.state().clone());

        assert!(!inbox.meet(first));
        assert_eq!(report(&inbox), SlotReport { version_low: 3, state: OVERTAKEN });
        let of_first = [(3, true), (4, false), (4, true)]
            .map(|(version, is_informed)| inbox.admit(first, &slot(version), is_informed));
        assert_eq!(of_first, [Admission::Known, Admission::Overtaken, Admission::New]);
        inbox.decide(SlotId::Utility, SlotState::Refused(RefusalReason::Unable));
        assert_eq!(report(&inbox).state, SlotState::Refused(RefusalReason::Unable));
        assert!(inbox.meet(third));
        assert_eq!(report(&inbox).state, OVERTAKEN, "the order of the second surface is in force");
    }

    #[test]
    fn versions_wrap_without_going_back() {
        let mut inbox = SlotInbox::default();
        let admissions = [65_535, 0, 65_535].map(|version| inbox.admit(series(1), &slot(version), false));
        assert_eq!(admissions, [Admission::New, Admission::New, Admission::Known]);
    }
}
