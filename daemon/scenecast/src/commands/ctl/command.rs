//! `scenecast ctl command`

use clap::Subcommand;
use scenecast_console::client::{self, Session};
use scenecast_core::UserError;
use scenecast_surface::{CommandOrder, CommandOrderAction};

#[derive(Debug, Subcommand)]
pub(super) enum CommandChange {
    /// Ask the holder for command, for 120 s; take it if nobody has it.
    #[command(after_help = "Example: scenecast ctl command request --token-file anna.token")]
    Request,
    /// Withdraw your request for command.
    #[command(after_help = "Example: scenecast ctl command withdraw")]
    Withdraw,
    /// Take command if nobody has it, or its holder was silent for 120 s.
    #[command(after_help = "Example: scenecast ctl command take")]
    Take,
    /// Hand command over to another operator.
    #[command(after_help = "Example: scenecast ctl command hand-over bob")]
    HandOver {
        /// Name of a principal [default: the one whose request is the oldest]
        name: Option<String>,
    },
    /// Give command up; the next order takes it.
    #[command(after_help = "Example: scenecast ctl command release")]
    Release,
}

pub(super) async fn command(session: &Session, change: Option<CommandChange>) -> Result<(), UserError> {
    let (action, to) = match change {
        None => return client::show_command(session).await,
        Some(CommandChange::Request) => (CommandOrderAction::Request, None),
        Some(CommandChange::Withdraw) => (CommandOrderAction::Withdraw, None),
        Some(CommandChange::Take) => (CommandOrderAction::Take, None),
        Some(CommandChange::HandOver { name }) => (CommandOrderAction::HandOver, name),
        Some(CommandChange::Release) => (CommandOrderAction::Release, None),
    };
    client::change_command(session, &CommandOrder { action, to }).await
}
