//! Who has command, as the API shows it.

use super::facts::seconds;
use crate::state::{
    CommandChangeName, CommandChangeState, CommandHolderState, CommandRequestState, CommandState, PrincipalInfo,
    PrincipalRole,
};
use scenecast_protocol::time::Instant;
use scenecast_surface::{COMMAND_SILENCE, Command, CommandChange, CommandChangeKind, Principal, Role};

pub(crate) fn command_state(command: &Command, now: Instant) -> CommandState {
    CommandState {
        holder: command.holder().map(|h| CommandHolderState {
            name: h.principal.name().to_owned(),
            role: role(h.principal.role()),
            client: h.client.as_ref().map(|client| client.as_str().to_owned()),
            since_s: seconds(h.since),
            last_active_s: seconds(h.last_active),
            takeable_s: seconds(h.last_active + COMMAND_SILENCE),
        }),
        requests: command
            .requests(now)
            .map(|r| CommandRequestState { name: r.principal.name().to_owned(), at_s: seconds(r.at) })
            .collect(),
        principals: command.principals().iter().map(principal_info).collect(),
        history: command.changes().map(change).collect(),
    }
}

/// A principal as the API shows it.
pub(crate) fn principal_info(principal: &Principal) -> PrincipalInfo {
    PrincipalInfo { name: principal.name().to_owned(), role: role(principal.role()) }
}

fn role(role: Role) -> PrincipalRole {
    match role {
        Role::Viewer => PrincipalRole::Viewer,
        Role::Operator => PrincipalRole::Operator,
        Role::Administrator => PrincipalRole::Administrator,
    }
}

fn change(change: &CommandChange) -> CommandChangeState {
    let kind = match change.kind {
        CommandChangeKind::Taken => CommandChangeName::Taken,
        CommandChangeKind::HandedOver => CommandChangeName::HandedOver,
        CommandChangeKind::Released => CommandChangeName::Released,
        CommandChangeKind::Requested => CommandChangeName::Requested,
        CommandChangeKind::Withdrawn => CommandChangeName::Withdrawn,
        CommandChangeKind::Moved => CommandChangeName::Moved,
    };
    let CommandChange { at, by, from, to, .. } = change.clone();
    CommandChangeState { at_s: seconds(at), kind, by, from, to }
}
