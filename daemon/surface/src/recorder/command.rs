//! Command across restarts: who has it, who requests it, and how that came about.

use crate::Surface;
use crate::command::{Command, CommandChange, CommandChangeKind};
use crate::record::{StoredCommand, StoredCommandChange, SurfaceMemory};
use scenecast_core::ClientName;
use scenecast_protocol::time::Instant;

/// The holder and the requests as they are stored.
pub(super) fn stored(command: &Command, now: Instant) -> StoredCommand {
    let holder = command.holder().map(|holder| {
        let name = holder.principal.name().to_owned();
        let client = holder.client.as_ref().map(|client| client.as_str().to_owned());
        (name, client, holder.since.as_micros(), holder.last_active.as_micros())
    });
    let requests = command.requests(now).map(|r| (r.principal.name().to_owned(), r.at.as_micros()));
    StoredCommand { holder, requests: requests.collect() }
}

/// The changes that `known` does not have yet, the oldest first.
pub(super) fn news(command: &Command, known: &SurfaceMemory) -> Vec<StoredCommandChange> {
    let all: Vec<StoredCommandChange> = command.changes().map(stored_change).collect();
    let last = known.command_changes.back();
    let seen = last.and_then(|last| all.iter().rposition(|change| change == last)).map_or(0, |at| at + 1);
    all.into_iter().skip(seen).collect()
}

fn stored_change(change: &CommandChange) -> StoredCommandChange {
    let CommandChange { at, kind, by, from, to } = change.clone();
    let kind = CommandChangeKind::ALL.iter().position(|k| *k == kind).unwrap_or(0) as u8;
    StoredCommandChange { at: at.as_micros(), kind, by, from, to }
}

/// Puts command back as it was stored.
pub(super) fn restore(surface: &mut Surface, memory: &SurfaceMemory) {
    let at = Instant::from_micros;
    let holder = memory.command.holder.as_ref().map(|(name, client, since, last)| {
        let client = client.as_ref().map(|name| ClientName::new(name).unwrap_or_default());
        (name.as_str(), client, at(*since), at(*last))
    });
    let requests = memory.command.requests.iter().map(|(name, asked)| (name.clone(), at(*asked)));
    let changes = memory.command_changes.iter().filter_map(|change| {
        let StoredCommandChange { at: changed, kind, by, from, to } = change.clone();
        let kind = *CommandChangeKind::ALL.get(usize::from(kind))?;
        Some(CommandChange { at: at(changed), kind, by, from, to })
    });
    surface.command.restore(holder, requests, changes);
}
