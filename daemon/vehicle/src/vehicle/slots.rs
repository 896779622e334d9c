//! The vehicle applies the slots of the directive; the utility in force, and the weights of labels that were born after it.

use super::gallery::Gallery;
use super::storing::{UnreportedDecision, WaitingOrder};
use super::{AppliedSlot, Vehicle, VehicleOutput};
use crate::{FixVerdict, LastPlace};
use scenecast_protocol::coordinates::DecimetrePoint;
use scenecast_protocol::directive::{
    Areas, AreasFault, Budget, Constraints, Destination, ExemplarRequests, Fence, Fix, Limits, LimitsFault,
    RefusalReason, Settings, Slot, SlotId, SlotState, Utility,
};
use scenecast_protocol::link::VehicleLink;
use scenecast_protocol::map::{LabelTree, LayerMask, LayerSource};
use scenecast_protocol::time::Instant;
use std::time::Duration;

impl Vehicle {
    /// Has an order wait until the disk has taken a record. A disk that refuses it would keep neither the order nor the
    /// fact that it was applied, so that only holds and aborts are obeyed then.
    pub(super) fn handle_slot(&mut self, id: SlotId, version: u16, content: Option<Slot>, now: Instant) {
        if self.storing.await_disk(WaitingOrder { id, version, content, at: now }) {
            self.outputs.push_back(VehicleOutput::Persist);
        }
    }

    /// Decides about the orders that waited for the disk; returns whether there were any.
    pub(super) fn decide_waiting(&mut self) -> bool {
        let waiting = self.storing.take_orders();
        for WaitingOrder { id, version, content, at } in &waiting {
            // The host stores the decision before it acts; otherwise a power cut could have the order applied twice.
            self.outputs.push_back(VehicleOutput::Persist);
            let state = match content.clone().ok_or(RefusalReason::Malformed) {
                Ok(slot) => self.decide_known(slot, *at),
                Err(reason) => SlotState::Refused(reason),
            };
            self.put_in_force((*id, *version), state, *at);
        }
        !waiting.is_empty()
    }

    /// The disk has refused a record: holds and aborts are obeyed from memory, and the other waiting orders are refused.
    pub(super) fn refuse_waiting(&mut self) {
        for WaitingOrder { id, version, content, at } in self.storing.take_orders() {
            match content.filter(|slot| self.is_obeyed_from_memory(slot)) {
                Some(slot) => {
                    let state = self.decide(slot, at);
                    self.put_in_force((id, version), state, at);
                }
                None => {
                    let state = SlotState::Refused(RefusalReason::Disk);
                    self.link.decide(id, state, at);
                    self.outputs.push_back(VehicleOutput::Applied(AppliedSlot { id, version, state, at }));
                }
            }
        }
        self.durable.inbox = self.storing.with_decisions(self.link.persistent_state().clone());
    }

    /// Reports decisions that are on the disk. Until then the surface shows their orders as received, and sends them
    /// again to a vehicle that has restarted.
    pub(super) fn report_decisions(&mut self, decisions: Vec<UnreportedDecision>) {
        decisions.into_iter().for_each(|(id, state, at)| self.link.decide(id, state, at));
    }

    fn put_in_force(&mut self, (id, version): (SlotId, u16), state: SlotState, at: Instant) {
        self.has_new_orders |= id.steers() && state == SlotState::Applied;
        self.storing.handle_decision(id, state, at);
        self.durable.inbox = self.storing.with_decisions(self.link.persistent_state().clone());
        self.outputs.push_back(VehicleOutput::Applied(AppliedSlot { id, version, state, at }));
    }

    /// Refuses an order that may have been applied before its record was lost. A hold or an abort is obeyed again.
    fn decide_known(&mut self, slot: Slot, at: Instant) -> SlotState {
        let series = self.link.persistent_state().series();
        match self.durable.lost.may_contain(series) && !self.is_obeyed_from_memory(&slot) {
            true => SlotState::Refused(RefusalReason::Forgotten),
            false => self.decide(slot, at),
        }
    }

    fn decide(&mut self, slot: Slot, at: Instant) -> SlotState {
        self.apply(slot, at).map_or_else(SlotState::Refused, |()| SlotState::Applied)
    }

    /// Whether an order stops the vehicle, and lifts no abort.
    fn is_obeyed_from_memory(&self, slot: &Slot) -> bool {
        matches!(slot, Slot::Constraints(order) if order.abort || order.hold && !self.durable.abort)
    }

    pub(super) fn apply(&mut self, slot: Slot, now: Instant) -> Result<(), RefusalReason> {
        let result = self.apply_content(slot, now);
        self.report_in_force(now);
        result
    }

    /// Has the link report the content in force of each slot. The link reports its budget by itself.
    pub(super) fn report_in_force(&mut self, now: Instant) {
        let limits = self.durable.limits.order().map(Slot::Limits);
        let fence = Fence::from_bytes(&self.durable.fence).filter(|fence| fence.check().is_ok()).map(Slot::Fence);
        self.link.set_in_force(SlotId::Utility, self.weights.ordered().cloned().map(Slot::Utility), now);
        self.link.set_in_force(SlotId::Settings, Some(Slot::Settings(self.settings)), now);
        self.link.set_in_force(SlotId::Limits, limits, now);
        self.link.set_in_force(SlotId::Fence, fence, now);
        let areas = self.durable.goals.areas().map(Slot::Areas);
        self.link.set_in_force(SlotId::Areas, areas, now);
        let destination = Destination { place: self.durable.goals.destination() };
        self.link.set_in_force(SlotId::Destination, Some(Slot::Destination(destination)), now);
    }

    fn apply_content(&mut self, slot: Slot, now: Instant) -> Result<(), RefusalReason> {
        match slot {
            Slot::Utility(utility) => self.apply_utility(utility),
            Slot::Constraints(constraints) => {
                self.apply_constraints(constraints);
                Ok(())
            }
            Slot::Settings(settings) => self.apply_settings(&settings, now),
            Slot::Budget(budget) if is_in_range(&budget) => {
                self.apply_budget(budget, now);
                Ok(())
            }
            Slot::Budget(_) => Err(RefusalReason::OutOfRange),
            Slot::Requests(requests) => self.apply_requests(requests, now),
            Slot::Limits(limits) => self.apply_limits(limits),
            Slot::Fence(fence) => self.apply_fence(&fence),
            Slot::Fix(fix) => self.apply_fix(fix, now),
            Slot::Destination(destination) => self.apply_destination(destination),
            Slot::Areas(areas) => self.apply_areas(areas),
        }
    }

    fn apply_requests(&mut self, requests: ExemplarRequests, now: Instant) -> Result<(), RefusalReason> {
        if requests.epoch != self.storing.epoch() {
            return Err(RefusalReason::OtherEpoch);
        }
        if requests.wanted.iter().any(|r| r.label == 0 || r.label > self.publisher.labels()) {
            return Err(RefusalReason::UnknownLabel);
        }
        if requests.wanted.len() > Gallery::MAX_REQUESTS {
            return Err(RefusalReason::OutOfRange);
        }
        let series = self.link.persistent_state().series();
        self.gallery.replace_requests(requests, series, &mut self.link);
        self.serve_exemplars(now);
        Ok(())
    }

    fn apply_fix(&mut self, fix: Fix, now: Instant) -> Result<(), RefusalReason> {
        let taken = now - Duration::from_secs_f64(fix.age_s);
        match self.navigator.handle_fix(fix.position, fix.sigma_m, taken, now) {
            FixVerdict::Used => {
                self.durable.place = Some(LastPlace::of(&self.navigator));
                self.outputs.push_back(VehicleOutput::Fixed(fix, taken));
                Ok(())
            }
            FixVerdict::TooOld => Err(RefusalReason::TooOld),
            FixVerdict::Invalid | FixVerdict::Outlier => Err(RefusalReason::OutOfRange),
        }
    }

    fn apply_constraints(&mut self, order: Constraints) {
        (self.durable.hold, self.durable.abort) = (order.hold, order.abort);
        self.durable.limits.breach = 0;
        self.guidance.set_constraints(order);
    }

    fn apply_limits(&mut self, limits: Limits) -> Result<(), RefusalReason> {
        limits.check().map_err(|fault| match fault {
            LimitsFault::EmptyBand(_) => RefusalReason::Contradiction,
            LimitsFault::OutOfRange(..) => RefusalReason::OutOfRange,
        })?;
        if !self.guidance.is_able(&limits, self.navigator.depth_m()) {
            return Err(RefusalReason::Unable);
        }
        self.durable.limits.keep(&limits);
        self.guidance.set_limits(limits);
        Ok(())
    }

    /// A fence that the vehicle is outside of would be broken at once. It is probably a typing error, so it is refused;
    /// the last fence stays in force, and the operator can still order hold and abort.
    fn apply_fence(&mut self, fence: &Fence) -> Result<(), RefusalReason> {
        fence.check().map_err(|_| RefusalReason::Contradiction)?;
        let at = self.navigator.to_world(self.navigator.position());
        let is_inside = DecimetrePoint::nearest(at).is_some_and(|at| fence.allows(at));
        if fence.outlines().next().is_some() && !is_inside {
            return Err(RefusalReason::Outside);
        }
        self.durable.fence = fence.to_bytes();
        self.durable.limits.breach = 0;
        self.guidance.set_fence(fence);
        Ok(())
    }

    /// A place that the fence does not allow is refused at once, so that the operator learns it before the vehicle goes.
    fn apply_destination(&mut self, Destination { place }: Destination) -> Result<(), RefusalReason> {
        if place.is_some_and(|place| !self.guidance.can_reach(&self.navigator, place)) {
            return Err(RefusalReason::Contradiction);
        }
        self.durable.goals.keep_destination(place);
        self.guidance.set_destination(place);
        Ok(())
    }

    fn apply_areas(&mut self, areas: Areas) -> Result<(), RefusalReason> {
        areas.check().map_err(|fault| match fault {
            AreasFault::Weight(..) => RefusalReason::OutOfRange,
            _ => RefusalReason::Contradiction,
        })?;
        self.durable.goals.keep_areas(&areas);
        self.guidance.set_areas(areas);
        Ok(())
    }

    fn apply_utility(&mut self, utility: Utility) -> Result<(), RefusalReason> {
        if !utility.is_in_range() {
            return Err(RefusalReason::OutOfRange);
        }
        if utility.epoch != self.storing.epoch() {
            return Err(RefusalReason::OtherEpoch);
        }
        if utility.weights.keys().any(|&label| label > self.publisher.labels()) {
            return Err(RefusalReason::UnknownLabel);
        }
        let labels = self.publisher.labels();
        self.durable.utility.keep(&utility, labels);
        self.weights = Weights::new(Some(utility), labels);
        self.guidance.replan();
        self.follow_utility();
        Ok(())
    }

    /// Has the link send the labels with the greatest weights first.
    pub(super) fn follow_utility(&mut self) {
        self.link.source_mut().set_interest(|label| self.weights.weight(label));
    }

    fn apply_settings(&mut self, settings: &Settings, now: Instant) -> Result<(), RefusalReason> {
        settings.check().map_err(|_| RefusalReason::OutOfRange)?;
        let before = self.settings;
        self.settings = before.then(settings);
        self.durable.settings = self.settings.to_bytes();
        let choices = |settings: &Settings| (settings.planner.value(), settings.at_end.value());
        if choices(&self.settings) != choices(&before) {
            self.guidance.set_choices(&self.settings);
        }
        self.publisher.set_settings(&self.settings);
        self.publisher.select(&mut self.link);
        self.publisher.publish(&mut self.link, now);
        self.outputs.push_back(VehicleOutput::Tune(self.settings));
        Ok(())
    }

    /// Changes budget and shares on the vehicle itself. The surface learns it from the next report.
    pub fn set_budget(&mut self, budget: Budget, now: Instant) {
        self.apply_budget(budget, now);
        self.outputs.push_back(VehicleOutput::Persist);
    }

    fn apply_budget(&mut self, budget: Budget, now: Instant) {
        self.link.set_budget(budget.bits_per_s, now);
        self.publisher.select(&mut self.link);
        self.link.set_shares(budget.shares);
        let live = |link: &VehicleLink| link.layers().map(LayerSource::id).collect::<LayerMask>();
        let before = live(&self.link);
        self.link.set_background(budget.background);
        if live(&self.link) != before {
            self.publisher.publish(&mut self.link, now);
        }
        self.serve_exemplars(now);
        self.durable.budget.keep(&budget);
    }
}

fn is_in_range(budget: &Budget) -> bool {
    (10..=10_000_000).contains(&budget.bits_per_s) && budget.shares.is_sound()
}

/// The weights of labels. A label that was assigned after the order has the weight of its nearest relative in the tree: a part of a
/// favoured label that becomes a label of its own stays favoured.
#[derive(Debug, Default)]
pub(super) struct Weights {
    ordered: Option<Utility>,
    /// The highest label when the order was applied.
    labels: u8,
    /// The order with the weights of later labels.
    in_use: Option<Utility>,
}

impl Weights {
    /// The weights of an order that was applied when `labels` was the highest label.
    pub(super) fn new(ordered: Option<Utility>, labels: u8) -> Self {
        Self { in_use: ordered.clone(), ordered, labels }
    }

    /// The order as it was applied.
    pub(super) fn ordered(&self) -> Option<&Utility> {
        self.ordered.as_ref()
    }

    /// The order with the weights of later labels.
    pub(super) fn in_use(&self) -> Option<&Utility> {
        self.in_use.as_ref()
    }

    pub(super) fn weight(&self, label: u8) -> f64 {
        self.in_use.as_ref().map_or(0.0, |utility| utility.weight(label))
    }

    /// Takes the tree of all labels up to `highest`; returns whether a weight has changed.
    pub(super) fn handle_tree(&mut self, tree: &LabelTree, highest: u8) -> bool {
        let Some(ordered) = &self.ordered else { return false };
        let mut in_use = ordered.clone();
        for label in self.labels.saturating_add(1)..=highest {
            if let Some(&weight) = ordered.weights.get(&tree.weighed_as(label, self.labels)) {
                in_use.weights.insert(label, weight);
            }
        }
        let has_changed = self.in_use.as_ref() != Some(&in_use);
        self.in_use = Some(in_use);
        has_changed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_later_label_has_the_weight_of_its_nearest_relative() {
        let ordered = Utility { weights: [(1, 80), (2, -40)].into(), ..Utility::default() };
        let mut weights = Weights::new(Some(ordered.clone()), 3);
        // 4 joins 1; 6 joins 5, and both join 2; 3 has the weight 0.
        let tree = LabelTree::new(vec![(1, 4), (5, 6), (2, 5), (1, 3), (1, 2)], None).unwrap();
        assert!(weights.handle_tree(&tree, 6) && !weights.handle_tree(&tree, 6));
        assert_eq!([1, 2, 3, 4, 5, 6].map(|label| weights.weight(label)), [0.8, -0.4, 0.0, 0.8, -0.4, -0.4]);
        assert_eq!(weights.ordered(), Some(&ordered));
        assert!(!Weights::default().handle_tree(&tree, 6));
    }
}
