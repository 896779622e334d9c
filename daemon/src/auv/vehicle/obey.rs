//! What the vehicle does with a slot of the directive.

use super::{LastPlace, Vehicle, VehicleOutput};
use crate::auv::FixVerdict;
use scenecast_protocol::directive::{Budget, RefusalReason, Slot, Utility};
use scenecast_protocol::time::Instant;
use std::time::Duration;

impl Vehicle {
    pub(super) fn apply(&mut self, slot: Slot, now: Instant) -> Result<(), RefusalReason> {
        match slot {
            Slot::Utility(utility) => self.apply_utility(utility),
            Slot::Constraints(constraints) => {
                self.durable.hold = constraints.hold;
                self.waypoint = None;
                if constraints.hold {
                    self.outputs.push_back(VehicleOutput::Hold);
                }
                Ok(())
            }
            Slot::Settings(settings) => {
                self.durable.refine_words_per_s = Some(settings.refine_words_per_s);
                self.outputs.push_back(VehicleOutput::RefineRate(settings.refine_words_per_s));
                Ok(())
            }
            Slot::Budget(budget) if is_in_range(&budget) => {
                self.follow_budget(budget, now);
                Ok(())
            }
            Slot::Budget(_) => Err(RefusalReason::OutOfRange),
            Slot::Requests(requests) if requests.epoch != self.durable.epoch => Err(RefusalReason::OtherEpoch),
            Slot::Requests(requests) if requests.wanted.iter().any(|&(l, _)| l == 0 || l > self.labels) => {
                Err(RefusalReason::UnknownLabel)
            }
            Slot::Requests(requests) => {
                self.replace_requests(requests);
                Ok(())
            }
            Slot::Fix(fix) => {
                let taken = now - Duration::from_secs_f64(fix.age_s);
                match self.navigator.handle_fix(fix.x_m, fix.y_m, fix.sigma_m, taken, now) {
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
        self.waypoint = None;
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
        self.limit_backlog();
        self.link.set_shares(budget.shares);
        self.durable.budget_bps = Some(budget.bits_per_s);
        self.durable.shares = Some(budget.shares.0);
    }
}

fn is_in_range(budget: &Budget) -> bool {
    (10..=10_000_000).contains(&budget.bits_per_s) && budget.shares.is_sound()
}
