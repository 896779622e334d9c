//! Principals, and who has command.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The role of a principal. Each one may do everything that the roles before it may do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PrincipalRole {
    /// Reads everything and changes no state.
    Viewer,
    /// Gives orders, and reads everything.
    Operator,
    /// Changes settings, gives orders, and reads everything.
    Administrator,
}

/// The holder of a token; without tokens every client of this machine is the principal `local`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct PrincipalInfo {
    /// The name in the file of tokens.
    pub name: String,
    /// The role in the file of tokens.
    pub role: PrincipalRole,
}

/// Who has command: the right to give orders other than hold and abort. It belongs to one client of a principal: a browser, a
/// terminal or a program.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct CommandState {
    /// The principal who has command; null if nobody has it. Then the first order takes it.
    pub holder: Option<CommandHolderState>,
    /// Requests for command, the oldest first; a request lapses after 120 s.
    pub requests: Vec<CommandRequestState>,
    /// The principals that have a token.
    pub principals: Vec<PrincipalInfo>,
    /// The last changes, the oldest first, at most 32.
    pub history: Vec<CommandChangeState>,
}

/// The principal who has command.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CommandHolderState {
    /// The name of the principal.
    pub name: String,
    /// The role that its token gives.
    pub role: PrincipalRole,
    /// The client that has command, by the name that it gives itself; empty if it gives none. Null after command was handed over: the
    /// first client of the principal that gives an order or a sign of presence has it then.
    pub client: Option<String>,
    /// Mission time since which it has command.
    pub since_s: f64,
    /// Mission time of its last order or sign of presence.
    pub last_active_s: f64,
    /// Mission time from which another operator may take command, unless the holder gives a sign before.
    pub takeable_s: f64,
}

/// A request for command that is open.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CommandRequestState {
    /// The principal who requests it.
    pub name: String,
    /// Mission time of the request.
    pub at_s: f64,
}

/// A change of command, with its time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CommandChangeState {
    /// Mission time of the change.
    pub at_s: f64,
    /// How command changed, or was requested.
    pub kind: CommandChangeName,
    /// The principal who made it.
    pub by: String,
    /// The holder before; null for nobody.
    pub from: Option<String>,
    /// The holder after; null for nobody.
    pub to: Option<String>,
}

/// The kind of a change of command.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CommandChangeName {
    /// Taken: nobody had it, or its holder was silent for 120 s.
    Taken,
    /// Handed over by its holder.
    HandedOver,
    /// Given up by its holder.
    Released,
    /// Command was requested from its holder.
    Requested,
    /// The request for command was withdrawn.
    Withdrawn,
    /// Moved to another client of the same principal.
    Moved,
}
