//! A client of the operator's page: what `scenecast ctl` does.

mod changes;
mod client;
mod constraints;
mod figures;
mod files;
mod geojson;
mod orders;
mod settings;

pub use client::Client;
pub use orders::BudgetChange;
pub use settings::SettingsChange;

use crate::state::{State, Vehicle};
use scenecast_core::UserError;
use serde::Serialize;
use std::io::{ErrorKind, Write};
use std::time::Duration;

/// A conversation with a running surface.
#[derive(Debug)]
pub struct Ctl {
    /// Where it runs.
    pub client: Client,
    /// Whether programs read the output.
    pub json: bool,
    /// The vehicle that is meant; `None` if there is but one.
    pub vehicle: Option<u8>,
    /// How long to wait for an order to be applied; `None`: as the command thinks fit.
    pub wait: Option<Duration>,
}

impl Ctl {
    async fn state(&self) -> Result<State, UserError> {
        let (bytes, _) = self.client.get("/api/v1/state").await?;
        serde_json::from_slice(&bytes).map_err(|e| self.client.unlike(&e))
    }

    /// The vehicle that is meant.
    fn choose<'a>(&self, state: &'a State) -> Result<&'a Vehicle, UserError> {
        let there: Vec<String> = state.vehicles.iter().map(|v| v.id.to_string()).collect();
        let there = there.join(", ");
        match (self.vehicle, &state.vehicles[..]) {
            (Some(id), all) => all
                .iter()
                .find(|v| v.id == id)
                .ok_or_else(|| UserError::Input(format!("--vehicle {id}: there is no such vehicle; there is {there}"))),
            (None, [one]) => Ok(one),
            (None, []) => Err(UserError::Failed("the surface knows no vehicle yet".to_owned())),
            (None, _) => Err(UserError::Input(format!("which vehicle? --vehicle takes one of {there}"))),
        }
    }

    /// Prints the state of everything.
    pub async fn status(&self) -> Result<(), UserError> {
        let state = self.state().await?;
        self.tell(&state, || figures::status(&state, self.vehicle))
    }

    /// Prints the labels of a vehicle.
    pub async fn labels(&self) -> Result<(), UserError> {
        let state = self.state().await?;
        let vehicle = self.choose(&state)?;
        self.tell(&vehicle.labels, || figures::labels(vehicle, state.now_s))
    }

    /// Prints changes until it is interrupted.
    pub async fn watch(&self) -> Result<(), UserError> {
        tokio::select! {
            _ = tokio::signal::ctrl_c() => Ok(()),
            ended = self.watch_on() => ended,
        }
    }

    async fn watch_on(&self) -> Result<(), UserError> {
        let mut events = self.client.events().await?;
        let mut before: Option<State> = None;
        loop {
            let after = events.state().await?;
            let all = match &before {
                Some(before) => changes::changes(before, &after),
                None => changes::first(&after),
            };
            for change in
                all.iter().filter(|c| self.vehicle.is_none() || c.vehicle.is_none() || c.vehicle == self.vehicle)
            {
                let line = if self.json { json(change)? } else { change.line() };
                if !print(&format!("{line}\n"))? {
                    return Ok(());
                }
            }
            before = Some(after);
        }
    }

    /// Prints a value for programs, or a text for people.
    fn tell(&self, value: &impl Serialize, text: impl FnOnce() -> String) -> Result<(), UserError> {
        let said = if self.json { format!("{}\n", json(value)?) } else { text() };
        print(&said).map(drop)
    }
}

fn json(value: &impl Serialize) -> Result<String, UserError> {
    serde_json::to_string(value).map_err(|e| UserError::Failed(e.to_string()))
}

/// Prints; says whether anybody reads on.
fn print(text: &str) -> Result<bool, UserError> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Ok(()) => Ok(true),
        Err(e) if e.kind() == ErrorKind::BrokenPipe => Ok(false),
        Err(e) => Err(UserError::Failed(format!("standard output: {e}"))),
    }
}

/// Runs a conversation to its end.
pub fn block_on(talk: impl Future<Output = Result<(), UserError>>) -> Result<(), UserError> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
    runtime.map_err(|e| UserError::Failed(e.to_string()))?.block_on(talk)
}
