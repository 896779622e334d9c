//! Orders, and what becomes of them.

use super::{Ctl, figures};
use crate::orders::{BudgetOrder, SharesOrder, UtilityOrder};
use crate::state::{Accepted, LifeLine, State};
use scenecast_core::UserError;
use serde::Serialize;
use std::collections::BTreeMap;
use std::time::Duration;

/// A change of the budget.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct BudgetChange {
    /// Bits on air a second; `None`: as it is.
    pub bits_per_s: Option<u32>,
    /// Least shares in percent by class; those that are not named stay.
    pub shares: BTreeMap<String, u8>,
    /// What left-over bits are spent on; `None`: as it is.
    pub spend: Option<Vec<String>>,
}

/// What became of an order at a vehicle.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct Outcome {
    vehicle: u8,
    slot: String,
    version: u16,
    state: Option<LifeLine>,
    reason: Option<String>,
}

impl Ctl {
    /// Prints the weights that were sent last.
    pub async fn utility(&self) -> Result<(), UserError> {
        let state = self.state().await?;
        let vehicle = self.choose(&state)?;
        let weights = vehicle.labels.iter().filter(|l| l.weight != 0.0).map(|l| (l.id.to_string(), l.weight)).collect();
        let order =
            UtilityOrder { weights, exploration: vehicle.utility.exploration, curiosity: vehicle.utility.curiosity };
        self.tell(&order, || {
            let weights = order.weights.iter().map(|(label, w)| format!("label {label}: {w:.2}\n"));
            format!("{}unseen cells: {:.2}\n", weights.collect::<String>(), order.exploration)
        })
    }

    /// Sends weights; with `keep` those that are not named stay as they were sent last, else they become 0.
    pub async fn set_utility(
        &self,
        weights: BTreeMap<u8, f64>,
        exploration: Option<f64>,
        keep: bool,
    ) -> Result<(), UserError> {
        let state = self.state().await?;
        let vehicle = self.choose(&state)?;
        let mut order =
            UtilityOrder { weights: BTreeMap::new(), exploration: exploration.unwrap_or(0.0), curiosity: 0.0 };
        if keep {
            let sent = vehicle.labels.iter().filter(|l| l.weight != 0.0).map(|l| (l.id.to_string(), l.weight));
            order.weights.extend(sent);
            order.exploration = exploration.unwrap_or(vehicle.utility.exploration);
            order.curiosity = vehicle.utility.curiosity;
        }
        order.weights.extend(weights.into_iter().map(|(label, w)| (label.to_string(), w)));
        let accepted = self.client.post(&format!("/api/v1/vehicles/{}/utility", vehicle.id), &order).await?;
        self.follow(accepted).await
    }

    /// Prints budget and shares.
    pub async fn budget(&self) -> Result<(), UserError> {
        let state = self.state().await?;
        let link = &state.link;
        let value =
            serde_json::json!({ "budget_bps": link.budget_bps, "shares": link.shares, "background": link.background });
        self.tell(&value, || {
            let shares = link.shares.iter().map(|(class, percent)| format!("{class:<10} at least {percent} %\n"));
            let theirs = state.vehicles.iter().filter_map(|v| Some((v, v.status.as_ref()?)));
            let theirs = theirs.map(|(v, s)| {
                let age = figures::span(state.now_s - s.at_s);
                format!("vehicle {:<2} {} bit/s, said {age} ago\n", v.id, s.budget_bps)
            });
            let own = format!("surface    {} bit/s\n", link.budget_bps);
            let rest = format!("left-over  to {}\n", figures::spend(link));
            [own].into_iter().chain(theirs).chain(shares).chain([rest]).collect()
        })
    }

    /// Changes budget and shares of the surface and of all vehicles.
    pub async fn set_budget(&self, change: BudgetChange) -> Result<(), UserError> {
        let link = self.state().await?.link;
        if let Some(unknown) = change.shares.keys().find(|class| !link.shares.contains_key(*class)) {
            let classes: Vec<&str> = link.shares.keys().map(String::as_str).collect();
            return Err(UserError::Input(format!("--shares {unknown}: it takes {}", classes.join(", "))));
        }
        let share = |class: &str| change.shares.get(class).or_else(|| link.shares.get(class)).copied().unwrap_or(0);
        let shares = SharesOrder {
            directive: share("directive"),
            status: share("status"),
            fix: share("fix"),
            map: share("map"),
            exemplar: share("exemplar"),
        };
        let shares = (!change.shares.is_empty()).then_some(shares);
        let budget_bps = change.bits_per_s.unwrap_or(link.budget_bps);
        let order = BudgetOrder { budget_bps, shares, background: change.spend };
        let accepted = self.client.post("/api/v1/budget", &order).await?;
        self.follow(accepted).await
    }

    /// Waits as long as is asked until an order is applied; refused is failed.
    pub(super) async fn follow(&self, accepted: Accepted) -> Result<(), UserError> {
        let wait = self.wait.unwrap_or(Duration::ZERO);
        let mut outcomes: Vec<Outcome> = accepted
            .versions
            .iter()
            .map(|(&vehicle, &version)| Outcome {
                vehicle,
                slot: accepted.slot.clone(),
                version,
                state: None,
                reason: None,
            })
            .collect();
        if wait.is_zero() {
            return self.tell(&outcomes, || {
                let handed = outcomes
                    .iter()
                    .map(|o| format!("vehicle {}: {} version {} waits for its turn\n", o.vehicle, o.slot, o.version));
                handed.collect()
            });
        }
        let settled = tokio::time::timeout(wait, self.settle(&mut outcomes)).await;
        if let Ok(Err(problem)) = settled {
            return Err(problem);
        }
        self.tell(&outcomes, || outcomes.iter().map(|o| format!("{}\n", o.text())).collect())?;
        match outcomes.iter().find(|o| o.state != Some(LifeLine::Applied)) {
            None => Ok(()),
            Some(o) if o.is_settled() => Err(UserError::Failed(o.text())),
            Some(o) => {
                Err(UserError::Failed(format!("{} after {:.0} s; it goes on waiting", o.text(), wait.as_secs_f64())))
            }
        }
    }

    async fn settle(&self, outcomes: &mut [Outcome]) -> Result<(), UserError> {
        let mut events = self.client.events().await?;
        let mut last = String::new();
        while !outcomes.iter().all(Outcome::is_settled) {
            let state = events.state().await?;
            for outcome in outcomes.iter_mut() {
                outcome.see(&state)?;
            }
            if !outcomes.iter().all(Outcome::is_settled) {
                self.note(&mut last, outcomes.iter().map(Outcome::text).collect::<Vec<_>>().join("; "));
            }
        }
        Ok(())
    }
}

impl Outcome {
    fn see(&mut self, state: &State) -> Result<(), UserError> {
        let vehicle = state.vehicles.iter().find(|v| v.id == self.vehicle);
        let slot = vehicle.and_then(|v| v.directive.slots.iter().find(|s| s.slot == self.slot));
        let Some(slot) = slot.filter(|s| s.version >= self.version) else { return Ok(()) };
        if slot.version > self.version {
            let what = "another order of this kind was given in the meantime and counts instead";
            return Err(UserError::Failed(format!("vehicle {}: {what}", self.vehicle)));
        }
        (self.state, self.reason) = (Some(slot.state), slot.reason.clone());
        Ok(())
    }

    fn is_settled(&self) -> bool {
        matches!(self.state, Some(LifeLine::Applied | LifeLine::Refused))
    }

    fn text(&self) -> String {
        let reason = self.reason.as_ref().map_or(String::new(), |why| format!(": {why}"));
        let state = self.state.map_or("not told yet", figures::life);
        format!("vehicle {}: {} version {} {state}{reason}", self.vehicle, self.slot, self.version)
    }
}
