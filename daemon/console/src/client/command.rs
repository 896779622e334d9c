//! Who has command, and changes of it.

use super::session::Session;
use super::text::{self, span};
use crate::orders::CommandOrder;
use crate::state::{CommandState, MissionState, PrincipalInfo};
use scenecast_core::UserError;
use serde::Serialize;
use std::fmt::Write;

/// The client's principal, and who has command.
#[derive(Debug, Serialize)]
struct CommandView<'a> {
    now_s: f64,
    you: &'a PrincipalInfo,
    #[serde(flatten)]
    command: &'a CommandState,
}

/// Prints who has command, who requests it, and the actions that are possible.
pub async fn show_command(session: &Session) -> Result<(), UserError> {
    let state = session.state().await?;
    let (bytes, _) = session.client.get("/api/v2/principal").await?;
    let you: PrincipalInfo = serde_json::from_slice(&bytes).map_err(|e| session.client.unreadable(&e))?;
    let view = CommandView { now_s: state.now_s, you: &you, command: &state.command };
    session.print(&view, || view_text(&state, &you, session.client.name()))
}

/// Requests command, hands it over, takes it or gives it up.
pub async fn change_command(session: &Session, order: &CommandOrder) -> Result<(), UserError> {
    let command: CommandState = session.client.post("/api/v2/command", order).await?;
    session.print(&command, || match &command.holder {
        Some(holder) => format!("{} has command\n", holder.name),
        None => "nobody has command\n".to_owned(),
    })
}

fn view_text(state: &MissionState, you: &PrincipalInfo, client: &str) -> String {
    let command = &state.command;
    let mut out = format!("command    {}\n", text::command(command, state.now_s));
    let _ = writeln!(out, "you        {}, {}", you.name, text::role(you.role));
    for request in &command.requests {
        let _ = writeln!(out, "requested  by {} {} ago", request.name, span(state.now_s - request.at_s));
    }
    let remedy = match &command.holder {
        None => "the first order takes it",
        Some(holder) if holder.name == you.name => match &holder.client {
            Some(name) if name != client => "move it here with: scenecast ctl command take",
            _ => "hand it over with hand-over NAME, or give it up with release",
        },
        Some(holder) if state.now_s >= holder.takeable_s => "take it with: scenecast ctl command take",
        Some(_) => "request it with: scenecast ctl command request",
    };
    let _ = writeln!(out, "possible   {remedy}");
    for change in &command.history {
        let _ = writeln!(out, "{:>10}  {}", span(change.at_s), text::command_change(change));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::state::{CommandHolderState, PrincipalRole};

    #[test]
    fn the_text_names_the_holder_and_the_possible_actions() {
        let you = PrincipalInfo { name: "bob".to_owned(), role: PrincipalRole::Operator };
        let mut state = MissionState { now_s: 160.0, ..MissionState::default() };
        assert!(view_text(&state, &you, "ctl").contains("nobody has it\n"));
        state.command.holder = Some(CommandHolderState {
            name: "anna".to_owned(),
            role: PrincipalRole::Operator,
            client: Some("page-1".to_owned()),
            since_s: 30.0,
            last_active_s: 100.0,
            takeable_s: 220.0,
        });
        let text = view_text(&state, &you, "ctl");
        assert!(
            text.contains("anna (page-1) for 2 min 10 s, last active 1 min 00 s ago; free to take in 1 min 00 s"),
            "{text}"
        );
        assert!(text.contains("you        bob, operator") && text.contains("command request"), "{text}");
        let elsewhere = view_text(&state, &PrincipalInfo { name: "anna".to_owned(), ..you.clone() }, "ctl");
        assert!(elsewhere.contains("move it here with: scenecast ctl command take"), "{elsewhere}");
        state.now_s = 221.0;
        assert!(view_text(&state, &you, "ctl").contains("command take"));
    }
}
