//! Follows an order until each vehicle has applied or refused it.

use super::session::Session;
use super::text;
use crate::state::{AcceptedOrder, MissionState, OrderStatus};
use scenecast_core::UserError;
use serde::Serialize;
use std::time::Duration;

/// The fate of an order at one vehicle.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct OrderOutcome {
    vehicle: u8,
    slot: String,
    name: String,
    version: u16,
    state: Option<OrderStatus>,
    reason: Option<String>,
}

/// Waits for an order as long as the session requests. A refusal is an error.
pub(super) async fn follow(session: &Session, accepted: AcceptedOrder) -> Result<(), UserError> {
    let wait = session.wait.unwrap_or(Duration::ZERO);
    let outcome = |(&vehicle, &version)| OrderOutcome {
        vehicle,
        slot: accepted.slot.clone(),
        name: accepted.name.clone(),
        version,
        state: None,
        reason: None,
    };
    let mut outcomes: Vec<OrderOutcome> = accepted.versions.iter().map(outcome).collect();
    if wait.is_zero() {
        let line = |o: &OrderOutcome| format!("vehicle {}: {} version {} is queued\n", o.vehicle, o.name, o.version);
        return session.print(&outcomes, || outcomes.iter().map(line).collect());
    }
    if let Ok(Err(error)) = tokio::time::timeout(wait, wait_for_all(session, &mut outcomes)).await {
        return Err(error);
    }
    session.print(&outcomes, || outcomes.iter().map(|o| format!("{}\n", o.line())).collect())?;
    match outcomes.iter().find(|o| o.state != Some(OrderStatus::Applied)) {
        None => Ok(()),
        Some(o) if o.is_final() => Err(UserError::Failed(o.line())),
        Some(o) => {
            let seconds = wait.as_secs_f64();
            Err(UserError::Failed(format!("{} after {seconds:.0} s; it is still on its way", o.line())))
        }
    }
}

async fn wait_for_all(session: &Session, outcomes: &mut [OrderOutcome]) -> Result<(), UserError> {
    let mut events = session.client.events().await?;
    let mut last = String::new();
    while !outcomes.iter().all(OrderOutcome::is_final) {
        let state = events.state().await?;
        for outcome in outcomes.iter_mut() {
            outcome.update(&state)?;
        }
        if !outcomes.iter().all(OrderOutcome::is_final) {
            session.note(&mut last, outcomes.iter().map(OrderOutcome::line).collect::<Vec<_>>().join("; "));
        }
    }
    Ok(())
}

impl OrderOutcome {
    fn update(&mut self, state: &MissionState) -> Result<(), UserError> {
        let vehicle = state.vehicles.iter().find(|v| v.id == self.vehicle);
        let slot = vehicle.and_then(|v| v.orders.directive.slots.iter().find(|s| s.slot == self.slot));
        let Some(slot) = slot.filter(|s| s.version >= self.version) else { return Ok(()) };
        if slot.version > self.version {
            let line = format!("vehicle {}: a later order has replaced this one", self.vehicle);
            return Err(UserError::Failed(line));
        }
        (self.state, self.reason) = (Some(slot.state), slot.reason.clone());
        Ok(())
    }

    fn is_final(&self) -> bool {
        self.state.is_some_and(|state| !state.is_pending())
    }

    fn line(&self) -> String {
        let reason = self.reason.as_ref().map_or(String::new(), |reason| format!(": {reason}"));
        let state = self.state.map_or("not reported yet", text::order_status);
        format!("vehicle {}: {} version {} {state}{reason}", self.vehicle, self.name, self.version)
    }
}
