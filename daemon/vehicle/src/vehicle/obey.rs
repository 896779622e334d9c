//! What the vehicle does with a slot of the directive.

use super::gallery::Gallery;
use super::{LastPlace, Vehicle, VehicleOutput};
use crate::FixVerdict;
use scenecast_protocol::coordinates::DecimetrePoint;
use scenecast_protocol::directive::{Budget, Constraints, Fence, Limits, LimitsFault, RefusalReason, Slot, Utility};
use scenecast_protocol::time::Instant;
use std::time::Duration;

impl Vehicle {
    pub(super) fn apply(&mut self, slot: Slot, now: Instant) -> Result<(), RefusalReason> {
        match slot {
            Slot::Utility(utility) => self.apply_utility(utility),
            Slot::Constraints(constraints) => {
                self.follow_order(constraints);
                Ok(())
            }
            Slot::Settings(settings) => self.apply_settings(&settings, now),
            Slot::Budget(budget) if is_in_range(&budget) => {
                self.follow_budget(budget, now);
                Ok(())
            }
            Slot::Budget(_) => Err(RefusalReason::OutOfRange),
            Slot::Requests(requests) if requests.epoch != self.durable.epoch => Err(RefusalReason::OtherEpoch),
            Slot::Requests(requests) if requests.wanted.iter().any(|r| r.label == 0 || r.label > self.labels) => {
                Err(RefusalReason::UnknownLabel)
            }
            Slot::Requests(requests) if requests.wanted.len() > Gallery::MAX_REQUESTS => Err(RefusalReason::OutOfRange),
            Slot::Requests(requests) => {
                let series = self.link.persistent_state().series;
                self.gallery.replace_requests(requests, series, &mut self.link);
                self.tend_gallery();
                Ok(())
            }
            Slot::Limits(limits) => self.apply_limits(limits),
            Slot::Fence(fence) => self.apply_fence(&fence),
            Slot::Fix(fix) => {
                let taken = now - Duration::from_secs_f64(fix.age_s);
                match self.navigator.handle_fix(fix.position, fix.sigma_m, taken, now) {
                    FixVerdict::Used => {
                        self.fixes_applied += 1;
                        self.durable.place = Some(LastPlace::of(&self.navigator));
                        self.outputs.push_back(VehicleOutput::Fixed(fix, taken));
                        Ok(())
                    }
                    FixVerdict::TooOld => Err(RefusalReason::TooOld),
                    FixVerdict::Absurd | FixVerdict::Outlier => Err(RefusalReason::OutOfRange),
                }
            }
        }
    }

    fn follow_order(&mut self, order: Constraints) {
        (self.durable.hold, self.durable.abort) = (order.hold, order.abort);
        self.failsafe.order = order;
        self.forgive();
    }

    fn apply_limits(&mut self, limits: Limits) -> Result<(), RefusalReason> {
        limits.check().map_err(|fault| match fault {
            LimitsFault::EmptyBand(_) => RefusalReason::Contradiction,
            LimitsFault::OutOfRange(..) => RefusalReason::OutOfRange,
        })?;
        if !self.failsafe.is_able(&limits, self.navigator.depth_m()) {
            return Err(RefusalReason::Unable);
        }
        self.durable.limits = limits.to_bytes();
        self.durable.used = (0, 0);
        self.failsafe.set_limits(limits);
        self.reconsider();
        Ok(())
    }

    /// A fence outside of which the vehicle is would be broken at once: more likely it is mistyped than meant, and the last
    /// one, and hold and abort, stay at hand.
    fn apply_fence(&mut self, fence: &Fence) -> Result<(), RefusalReason> {
        fence.check().map_err(|_| RefusalReason::Contradiction)?;
        let at = self.navigator.to_world(self.navigator.position());
        let is_inside = DecimetrePoint::nearest(at).is_some_and(|at| fence.allows(at));
        if fence.outlines().next().is_some() && !is_inside {
            return Err(RefusalReason::Outside);
        }
        self.durable.fence = fence.to_bytes();
        self.steering.set_fence(fence);
        self.forgive();
        Ok(())
    }

    /// The operator has answered a breach.
    fn forgive(&mut self) {
        self.failsafe.forgive();
        self.durable.breach = 0;
        self.reconsider();
    }

    fn apply_utility(&mut self, utility: Utility) -> Result<(), RefusalReason> {
        if !utility.is_in_range() {
            return Err(RefusalReason::OutOfRange);
        }
        if utility.epoch != self.durable.epoch {
            return Err(RefusalReason::OtherEpoch);
        }
        if utility.weights.keys().any(|&label| label > self.labels) {
            return Err(RefusalReason::UnknownLabel);
        }
        let u = &utility;
        self.durable.utility = Some((u.epoch, u.exploration, u.curiosity, u.weights.clone()));
        self.utility = Some(utility);
        self.reconsider();
        self.follow_utility();
        Ok(())
    }

    pub(super) fn follow_utility(&mut self) {
        let utility = self.utility.clone().unwrap_or_default();
        self.link.source_mut().set_interest(|label| utility.weight(label));
    }

    /// Changes budget and shares on the vehicle itself; the surface learns of it by the next report.
    pub fn set_budget(&mut self, budget: Budget, now: Instant) {
        self.follow_budget(budget, now);
        self.outputs.push_back(VehicleOutput::Persist);
    }

    fn follow_budget(&mut self, budget: Budget, now: Instant) {
        self.link.set_budget(budget.bits_per_s, now);
        self.follow_telling();
        self.link.set_shares(budget.shares);
        self.link.set_background(budget.background);
        self.tend_gallery();
        self.durable.budget_bps = Some(budget.bits_per_s);
        self.durable.shares = Some(budget.shares.0);
        self.durable.background = Some(budget.background.code());
    }
}

fn is_in_range(budget: &Budget) -> bool {
    (10..=10_000_000).contains(&budget.bits_per_s) && budget.shares.is_sound()
}
