//! A running surface, the selected vehicle and the form of the output; orders are followed until each vehicle has applied or
//! refused them.

use super::http::Client;
use super::{names, text};
use scenecast_core::{UserError, printable};
use scenecast_surface::state::{AcceptedOrder, MissionState, OrderStatus, VehicleState};
use serde::Serialize;
use std::io::{ErrorKind, Write};
use std::time::Duration;

/// A connection to a running surface.
#[derive(Debug)]
pub struct Session {
    /// The client of the surface.
    pub client: Client,
    /// Whether to print JSON instead of text.
    pub json: bool,
    /// Address or name of the vehicle; `None` selects the only one.
    pub vehicle: Option<String>,
    /// Maximum wait for an order to be applied; `None` means the default of the command.
    pub wait: Option<Duration>,
}

impl Session {
    pub(super) async fn state(&self) -> Result<MissionState, UserError> {
        let (bytes, _) = self.client.get("/api/v2/state").await?;
        serde_json::from_slice(&bytes).map_err(|e| self.client.unreadable(&e))
    }

    pub(super) fn choose<'a>(&self, state: &'a MissionState) -> Result<&'a VehicleState, UserError> {
        let known: Vec<String> = state.vehicles.iter().map(|v| v.id.to_string()).collect();
        let known = known.join(", ");
        match (&self.vehicle, &state.vehicles[..]) {
            (Some(text), _) => names::vehicle(state, text),
            (None, [one]) => Ok(one),
            (None, []) => Err(UserError::Failed("the surface knows no vehicle yet".to_owned())),
            (None, _) => Err(UserError::Input(format!("select a vehicle with --vehicle: one of {known}"))),
        }
    }

    /// The address of the vehicle that the person has named, also of one that is not known yet; `None` for all.
    pub(super) fn selected(&self, state: &MissionState) -> Result<Option<u8>, UserError> {
        let Some(text) = &self.vehicle else { return Ok(None) };
        text.parse().or_else(|_| names::vehicle(state, text).map(|vehicle| vehicle.id)).map(Some)
    }

    /// The same, with the present state where there is a name.
    pub(super) async fn selected_now(&self) -> Result<Option<u8>, UserError> {
        let is_named = self.vehicle.as_ref().is_some_and(|text| text.parse::<u8>().is_err());
        let state = if is_named { self.state().await? } else { MissionState::default() };
        self.selected(&state)
    }

    /// Prints a value as JSON, or a text.
    pub(super) fn print(&self, value: &impl Serialize, text: impl FnOnce() -> String) -> Result<(), UserError> {
        let output = if self.json { format!("{}\n", json(value)?) } else { text() };
        write(&output).map(drop)
    }

    /// Prints the progress on standard error, unless it is the same as before.
    pub(super) fn note(&self, last: &mut String, now: String) {
        if *last != now {
            if !self.json {
                eprintln!("{}", printable(&now));
            }
            *last = now;
        }
    }
}

pub(super) fn json(value: &impl Serialize) -> Result<String, UserError> {
    serde_json::to_string(value).map_err(UserError::failed)
}

/// Writes a text or JSON to standard output; false if the reader has closed it.
pub(super) fn write(text: &str) -> Result<bool, UserError> {
    let mut out = std::io::stdout().lock();
    match out.write_all(printable(text).as_bytes()).and_then(|()| out.flush()) {
        Ok(()) => Ok(true),
        Err(e) if e.kind() == ErrorKind::BrokenPipe => Ok(false),
        Err(e) => Err(UserError::Failed(format!("standard output: {e}"))),
    }
}

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
