//! The state, the labels, and changes as they happen.

use super::session::{Session, json, write};
use super::{changes, text};
use crate::state::MissionState;
use scenecast_core::UserError;

pub async fn show_status(session: &Session) -> Result<(), UserError> {
    let state = session.state().await?;
    session.print(&state, || text::status(&state, session.vehicle))
}

/// Prints the labels of a vehicle.
pub async fn show_labels(session: &Session) -> Result<(), UserError> {
    let state = session.state().await?;
    let vehicle = session.choose(&state)?;
    session.print(&vehicle.labels, || text::labels(vehicle, state.now_s))
}

pub async fn watch(session: &Session) -> Result<(), UserError> {
    tokio::select! {
        _ = tokio::signal::ctrl_c() => Ok(()),
        ended = print_changes(session) => ended,
    }
}

async fn print_changes(session: &Session) -> Result<(), UserError> {
    let mut events = session.client.events().await?;
    let mut before: Option<MissionState> = None;
    loop {
        let after = events.state().await?;
        let all = match &before {
            Some(before) => changes::changes(before, &after),
            None => changes::first(&after),
        };
        let is_selected = |id: Option<u8>| session.vehicle.is_none() || id.is_none() || id == session.vehicle;
        for change in all.iter().filter(|c| is_selected(c.vehicle)) {
            let line = if session.json { json(change)? } else { change.line() };
            if !write(&format!("{line}\n"))? {
                return Ok(());
            }
        }
        before = Some(after);
    }
}
