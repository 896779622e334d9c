//! A running surface, the selected vehicle, and the form of the output.

use super::http::Client;
use crate::state::{MissionState, VehicleState};
use scenecast_core::{UserError, printable};
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
    /// The address of the vehicle; `None` selects the only one.
    pub vehicle: Option<u8>,
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
        match (self.vehicle, &state.vehicles[..]) {
            (Some(id), all) => all.iter().find(|v| v.id == id).ok_or_else(|| {
                UserError::Input(format!("--vehicle {id}: there is no such vehicle; the surface knows {known}"))
            }),
            (None, [one]) => Ok(one),
            (None, []) => Err(UserError::Failed("the surface knows no vehicle yet".to_owned())),
            (None, _) => Err(UserError::Input(format!("select a vehicle with --vehicle: one of {known}"))),
        }
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
    serde_json::to_string(value).map_err(|e| UserError::Failed(e.to_string()))
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
