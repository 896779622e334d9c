//! The content in force at a vehicle, as far as the surface knows it.

use crate::directive::{
    InForceAssembly, InForceDigests, InForcePart, InForceSummary, OrderStatus, PerSlot, REPORTED_SLOTS, Settings, Slot,
    SlotId, SlotProgress,
};
use crate::link::FrameNumber;
use crate::time::Instant;
use std::time::Duration;

/// The content in force of a slot, as the surface knows it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum InForce<'a> {
    /// The vehicle has not reported it in this pair of runs, or never reports it.
    NotReported,
    /// By the vehicle's report no content is in force.
    None,
    /// This content is in force.
    Known(&'a Slot),
    /// A content is in force that the surface does not know, or not for certain. It inquires for it.
    Unknown,
}

/// The content that was last known to be in force, compared with the vehicle's reports.
#[derive(Debug, Default)]
pub(super) struct InForceCopy {
    held: PerSlot<Option<Slot>>,
    /// Whether the content of a slot came in after the last report that differs.
    confirmed: PerSlot<bool>,
    /// Whether the vehicle has put a slot in force since its last summary.
    decided: PerSlot<bool>,
    /// Contents that may be in force: those of orders that were replaced before their decision came in, and the former
    /// content, because the vehicle may report a decision before it puts the order in force.
    candidates: PerSlot<Vec<Slot>>,
    /// Whether a report has proved that the last applied order of a slot was in force.
    proved: PerSlot<bool>,
    reported: Option<(InForceSummary, FrameNumber)>,
    is_equal: bool,
    parts: PerSlot<InForceAssembly>,
    next_inquiry: Instant,
    /// Inquiries since the last part of an answer.
    inquiries: u32,
}

/// The content in force after an order. Settings join the earlier ones.
fn joined(order: &Slot, before: Option<Slot>) -> Option<Slot> {
    match (order, before) {
        (Slot::Settings(order), Some(Slot::Settings(before))) => Slot::Settings(before.then(order)).in_force(),
        (Slot::Settings(order), _) => Slot::Settings(Settings::default().then(order)).in_force(),
        (slot, _) => slot.clone().in_force(),
    }
}

impl InForceCopy {
    /// Bytes of an inquiry in a frame.
    pub(super) const INQUIRY_BYTES: usize = 2 + 2 * REPORTED_SLOTS.len();
    const FIRST_PAUSE: Duration = Duration::from_secs(15);
    /// Candidates that are kept of a slot, the latest ones.
    const MAX_CANDIDATES: usize = 3;
    /// Combinations that are compared with a summary. Its digest has 16 bits, so of many some would match by chance.
    const MAX_COMBINATIONS: usize = 64;
    /// The pause after each inquiry is twice the one before, at most 240 s.
    const MAX_DOUBLINGS: u32 = 4;

    pub(super) fn get(&self, id: SlotId) -> InForce<'_> {
        let (Some((summary, _)), Some(held)) = (self.reported, self.held.get(id)) else { return InForce::NotReported };
        let is_decided = self.decided.get(id) == Some(&true);
        let is_certain = is_decided || self.is_equal || self.confirmed.get(id) == Some(&true);
        match held {
            _ if !is_decided && !summary.has(id) => InForce::None,
            None if is_decided => InForce::None,
            Some(slot) if is_certain => InForce::Known(slot),
            _ => InForce::Unknown,
        }
    }

    /// An order is in force now, by the vehicle's decision or by what an earlier run of the surface knew.
    pub(super) fn apply(&mut self, order: &SlotProgress) {
        let Some(held) = self.held.get_mut(order.id).filter(|_| order.status == OrderStatus::Applied) else { return };
        let former = held.clone();
        *held = joined(&order.slot, held.take());
        if let Some(candidates) =
            self.candidates.get_mut(order.id).filter(|_| self.decided.get(order.id) == Some(&false))
        {
            candidates.clear();
        }
        self.add_candidate(order.id, former);
        for (of_slot, is_so) in [(&mut self.decided, true), (&mut self.proved, false), (&mut self.confirmed, false)] {
            if let Some(of_slot) = of_slot.get_mut(order.id) {
                *of_slot = is_so;
            }
        }
    }

    /// Takes a content of [`Self::memory`], of an earlier run of the surface. It is not certain until a report confirms it.
    pub(super) fn restore(&mut self, contents: impl IntoIterator<Item = Slot>) {
        let mut is_restored = PerSlot::<bool>::default();
        for content in contents {
            let id = content.id();
            let is_further = is_restored.get_mut(id).is_some_and(|is_restored| std::mem::replace(is_restored, true));
            if is_further {
                self.add_candidate(id, content.in_force());
            } else if let Some(held) = self.held.get_mut(id) {
                *held = content.in_force();
            }
        }
    }

    /// The contents that are held, each followed by the candidates of its slot.
    pub(super) fn memory(&self) -> impl Iterator<Item = &Slot> {
        let candidates = |id| self.candidates.get(id).into_iter().flatten();
        self.held.iter().flat_map(move |(id, held)| held.iter().chain(candidates(id)))
    }

    /// An order is replaced by a newer one before its decision has come in: the vehicle may have put it in force.
    pub(super) fn note_replaced(&mut self, order: &Slot) {
        let held = self.held.get(order.id()).cloned().flatten();
        self.add_candidate(order.id(), joined(order, held));
    }

    fn add_candidate(&mut self, id: SlotId, content: Option<Slot>) {
        let (Some(content), Some(candidates)) = (content, self.candidates.get_mut(id)) else { return };
        let is_held = self.held.get(id).is_some_and(|held| held.as_ref() == Some(&content));
        if !is_held && !candidates.contains(&content) {
            candidates.push(content);
            let surplus = candidates.len().saturating_sub(Self::MAX_CANDIDATES);
            candidates.drain(..surplus);
        }
    }

    /// Whether everything in force is known and shows that an order never was, although the vehicle reports its version as
    /// applied: the report has a part of the version only, and a forged order can have the same. Settings are not judged,
    /// because the vehicle joins them with earlier ones.
    pub(super) fn refutes(&self, order: &SlotProgress) -> bool {
        let (Some(Some(held)), Some(false), Some(false)) =
            (self.held.get(order.id), self.decided.get(order.id), self.proved.get(order.id))
        else {
            return false;
        };
        let is_judged = self.is_equal && !matches!(held, Slot::Settings(_)) && order.status == OrderStatus::Applied;
        is_judged && order.slot.clone().in_force().map(|slot| slot.payload()) != Some(held.payload())
    }

    /// Whether something else than an order that was applied is in force, or may be. One that was never in force is not replaced but
    /// refuted, and what orders of hold and abort have left is told by the vehicle's mode alone.
    pub(super) fn has_replaced(&self, order: &SlotProgress) -> bool {
        if self.refutes(order) {
            return false;
        }
        let payload = |slot: Option<Slot>| slot.map(|slot| slot.payload());
        match self.get(order.id) {
            InForce::NotReported => order.id == SlotId::Constraints,
            InForce::Unknown => true,
            InForce::None => order.slot.clone().in_force().is_some(),
            InForce::Known(held) => payload(joined(&order.slot, Some(held.clone()))) != payload(Some(held.clone())),
        }
    }

    /// The orders that are in force by now were so in an earlier run of the surface.
    pub(super) fn trust(&mut self) {
        self.proved = PerSlot::from_fn(|_| true);
    }

    /// Takes the summary of the report in frame `number`. `pending` are the orders of which no decision has come in.
    pub(super) fn handle_report(
        &mut self,
        summary: InForceSummary,
        pending: &[Slot],
        number: FrameNumber,
        now: Instant,
    ) {
        if self.reported.is_some_and(|(_, before)| number <= before) {
            return;
        }
        let is_same = self.reported.is_some_and(|(before, _)| before == summary);
        self.reported = Some((summary, number));
        self.decided = PerSlot::default();
        let is_proved = self.digests().summary() == summary;
        let is_equal = is_proved || self.is_of_candidates(pending, summary);
        let was_equal = std::mem::replace(&mut self.is_equal, is_equal);
        if !is_same || self.is_equal {
            self.confirmed = PerSlot::default();
        }
        if is_proved {
            self.trust();
        }
        if !self.is_equal && (was_equal || !is_same) {
            (self.next_inquiry, self.inquiries) = (now, 0);
        }
    }

    /// Whether the contents in force are those that are held with some of the pending orders and of the candidates; they are
    /// held then. So an order makes nothing unknown if its decision comes in before it is in force, follows in a later frame,
    /// was reported to an earlier run of the surface, or never comes in because a newer order replaced it.
    fn is_of_candidates(&mut self, pending: &[Slot], summary: InForceSummary) -> bool {
        let options = PerSlot::from_fn(|id| self.options(id, pending, summary));
        let combinations =
            options.iter().map(|(_, options)| options.len()).product::<usize>().min(Self::MAX_COMBINATIONS);
        let before = self.held.clone();
        // The first combination is what is held.
        for number in 1..combinations {
            let mut rest = number;
            for (id, options) in options.iter() {
                let option = options.get(rest % options.len()).cloned();
                rest /= options.len();
                if let (Some(held), Some(option)) = (self.held.get_mut(id), option) {
                    *held = option;
                }
            }
            if self.digests().summary() == summary {
                before.iter().for_each(|(id, former)| self.add_candidate(id, former.clone()));
                return true;
            }
        }
        self.held = before;
        false
    }

    /// The contents of a slot that may be in force, at first the one that is held.
    fn options(&self, id: SlotId, pending: &[Slot], summary: InForceSummary) -> Vec<Option<Slot>> {
        let held = self.held.get(id).cloned().flatten();
        let mut options = vec![held.clone()];
        if summary.has(id) {
            let pending = pending.iter().filter(|slot| slot.id() == id).map(|slot| joined(slot, held.clone()));
            let candidates = self.candidates.get(id).into_iter().flatten().cloned().map(Some);
            for option in pending.chain(candidates) {
                if !options.contains(&option) {
                    options.push(option);
                }
            }
        }
        options
    }

    /// Takes a part of an answer in frame `number`; returns whether a content is known now that was not.
    pub(super) fn handle_part(&mut self, part: &InForcePart<'_>, number: FrameNumber, now: Instant) -> bool {
        // Further parts of the answer follow.
        self.inquiries = self.inquiries.min(1);
        self.next_inquiry = self.next_inquiry.max(now + Self::FIRST_PAUSE);
        let Some(content) = self.parts.get_mut(part.id).and_then(|parts| parts.take(part)) else { return false };
        let was_known = matches!(self.get(part.id), InForce::Known(known) if *known == content);
        // A part that was written before the last report may be of a content that is not in force any more.
        let is_later = self.reported.is_some_and(|(_, report)| report <= number);
        if let (Some(held), Some(confirmed)) = (self.held.get_mut(part.id), self.confirmed.get_mut(part.id)) {
            (*held, *confirmed) = (Some(content), is_later);
        }
        self.is_equal = self.reported.is_some_and(|(summary, _)| summary == self.digests().summary());
        !was_known && matches!(self.get(part.id), InForce::Known(_))
    }

    /// Digests of the contents that are held, without those that the vehicle reports as not in force.
    fn digests(&self) -> InForceDigests {
        let held = InForceDigests::of(&self.held);
        let is_present = |id| self.reported.is_none_or(|(summary, _)| summary.has(id));
        InForceDigests::from_fn(|id| held.get(id).copied().filter(|_| is_present(id)).unwrap_or_default())
    }

    /// Whether a content in force is not known, so that an inquiry is to be sent.
    pub(super) fn lacks_any(&self) -> bool {
        self.reported.is_some() && !self.is_equal
    }

    /// When the next inquiry is to be sent, if one is.
    pub(super) fn next_inquiry(&self) -> Option<Instant> {
        self.lacks_any().then_some(self.next_inquiry)
    }

    /// The payload of an inquiry, if one is due.
    pub(super) fn inquiry(&self, now: Instant) -> Option<Vec<u8>> {
        self.next_inquiry().filter(|&at| now >= at).map(|_| self.digests().encode())
    }

    /// An inquiry was written into a frame.
    pub(super) fn note_inquiry(&mut self, now: Instant) {
        self.next_inquiry = now + Self::FIRST_PAUSE * (1 << self.inquiries.min(Self::MAX_DOUBLINGS));
        self.inquiries += 1;
    }

    /// One of the two ends has begun a new run. The contents are held until a report differs.
    pub(super) fn handle_peer_restart(&mut self) {
        let (held, proved) = (std::mem::take(&mut self.held), std::mem::take(&mut self.proved));
        let candidates = std::mem::take(&mut self.candidates);
        *self = Self { held, proved, candidates, ..Self::default() };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::directive::Limits;

    fn limits(time_s: u32) -> Slot {
        Slot::Limits(Limits { time_s: Some(time_s), ..Limits::default() })
    }

    fn summary(contents: &[Slot]) -> InForceSummary {
        let of = |id| contents.iter().find(|slot| slot.id() == id).cloned();
        InForceDigests::of(&PerSlot::from_fn(of)).summary()
    }

    #[test]
    fn a_pending_order_that_is_in_force_makes_nothing_unknown() {
        let (utility, now) = (Slot::Utility(Default::default()), Instant::ZERO);
        let mut copy = InForceCopy::default();
        copy.restore([utility.clone()]);
        copy.handle_report(summary(&[utility.clone(), limits(60)]), &[limits(60)], 1, now);
        assert_eq!(copy.get(SlotId::Utility), InForce::Known(&utility));
        assert_eq!(copy.get(SlotId::Limits), InForce::Known(&limits(60)));
        copy.handle_report(summary(&[utility.clone(), limits(90)]), &[limits(70)], 2, now);
        assert_eq!(copy.get(SlotId::Limits), InForce::Unknown, "those of another surface");
        copy.handle_report(summary(&[utility, limits(60)]), &[limits(70)], 3, now);
        assert_eq!(copy.get(SlotId::Limits), InForce::Known(&limits(60)), "the pending one is not in force yet");
    }

    #[test]
    fn an_order_that_was_replaced_on_its_way_makes_nothing_unknown() {
        let (utility, now) = (Slot::Utility(Default::default()), Instant::ZERO);
        let mut copy = InForceCopy::default();
        copy.restore([utility.clone(), limits(60)]);
        copy.note_replaced(&limits(70));
        copy.note_replaced(&limits(80));
        copy.handle_report(summary(&[utility.clone(), limits(70)]), &[limits(90)], 1, now);
        assert_eq!(copy.get(SlotId::Limits), InForce::Known(&limits(70)));
        copy.handle_report(summary(&[utility.clone(), limits(90)]), &[limits(90)], 2, now);
        assert_eq!(copy.get(SlotId::Limits), InForce::Known(&limits(90)));

        // The surface starts again, and the vehicle still gets the second one.
        let memory: Vec<Slot> = copy.memory().cloned().collect();
        let mut restarted = InForceCopy::default();
        restarted.restore(memory);
        restarted.handle_report(summary(&[utility.clone(), limits(80)]), &[limits(90)], 1, now);
        assert_eq!(restarted.get(SlotId::Limits), InForce::Known(&limits(80)));
        assert_eq!(restarted.get(SlotId::Utility), InForce::Known(&utility));
        restarted.handle_report(summary(&[utility, limits(50)]), &[limits(90)], 2, now);
        assert_eq!(restarted.get(SlotId::Limits), InForce::Unknown, "those of another surface");
    }

    #[test]
    fn an_early_decision_makes_no_content_in_force_unknown() {
        let (utility, now) = (Slot::Utility(Default::default()), Instant::ZERO);
        let mut copy = InForceCopy::default();
        copy.restore([utility.clone(), limits(60)]);
        copy.handle_report(summary(&[utility.clone(), limits(60)]), &[], 1, now);
        let (id, slot, status) = (SlotId::Limits, limits(70), OrderStatus::Applied);
        copy.apply(&SlotProgress { id, version: 1, slot, status, issued: now, changed: now, sent: None });
        copy.handle_report(summary(&[utility.clone(), limits(60)]), &[], 2, now);
        assert_eq!(copy.get(SlotId::Limits), InForce::Known(&limits(60)));
        copy.handle_report(summary(&[utility.clone(), limits(70)]), &[], 3, now);
        assert_eq!(copy.get(SlotId::Limits), InForce::Known(&limits(70)));
        assert_eq!(copy.get(SlotId::Utility), InForce::Known(&utility));
    }
}
