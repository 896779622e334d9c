//! Command: the right to give orders, which one principal has at a time.
//!
//! Every way in (page, `scenecast ctl`, API, later other peers) passes [`Command::check`] before an order and
//! [`Command::handle_order`] after it was accepted.

use crate::record::MAX_COMMAND_CHANGES;
use scenecast_core::{Principal, Role};
use scenecast_protocol::time::Instant;
use std::collections::VecDeque;
use std::time::Duration;

/// Without an order or a sign of its holder for this long, command may be taken.
pub const COMMAND_SILENCE: Duration = Duration::from_secs(120);
/// A request for command lapses after this time.
const REQUEST_LIFETIME: Duration = Duration::from_secs(120);
/// Pending requests at most; a further one replaces the oldest.
const MAX_REQUESTS: usize = 16;

/// An action, as far as it decides who may take it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OrderKind {
    /// Hold or abort: any operator may stop a vehicle, with and without command.
    Stop,
    /// A record that stays at the surface, such as a note: any operator, with and without command.
    Record,
    /// Any other order: an operator who has command.
    Order,
    /// A change of settings: an administrator who has command.
    Settings,
}

impl OrderKind {
    /// The least role that may do it.
    pub fn role(self) -> Role {
        match self {
            Self::Stop | Self::Record | Self::Order => Role::Operator,
            Self::Settings => Role::Administrator,
        }
    }

    /// Whether its giver must have command.
    pub fn needs_command(self) -> bool {
        matches!(self, Self::Order | Self::Settings)
    }
}

/// An action on command itself.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum CommandAction {
    /// Asks the holder for command; takes it if nobody has it.
    Request,
    Withdraw,
    /// Takes command after the holder's silence, or if nobody has it.
    Take,
    /// Gives command to this principal, or to the one whose request is the oldest.
    HandOver(Option<String>),
    Release,
    /// A sign that the holder is present; ignored from others.
    Keep,
}

/// The reason why an action is refused, as one line for people.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CommandRefusal {
    #[error("this needs the role {needed}; the role of {name} is {role}")]
    Role { name: String, role: Role, needed: Role },
    #[error("{holder} has command for {} and was last active {} ago: {}", span(*.held), span(*.idle), remedy(*.idle))]
    Held { holder: String, held: Duration, idle: Duration },
    #[error("nobody has command: the first order takes it")]
    Vacant,
    #[error("nobody requests command: name a principal to hand it over to")]
    NoRequest,
    #[error("{0} is not a principal of this surface")]
    Unknown(String),
    #[error("{name} cannot have command: it needs the role operator, and the role of {name} is {role}")]
    CannotHold { name: String, role: Role },
}

fn remedy(idle: Duration) -> String {
    match COMMAND_SILENCE.saturating_sub(idle) {
        Duration::ZERO => "take it".to_owned(),
        left => format!("request it, or take it after {} more without a sign of the holder", span(left)),
    }
}

fn span(duration: Duration) -> String {
    match duration.as_secs() {
        seconds @ 0..60 => format!("{seconds} s"),
        seconds @ 60..3600 => format!("{} min {:02} s", seconds / 60, seconds % 60),
        seconds => format!("{} h {:02} min", seconds / 3600, seconds / 60 % 60),
    }
}

/// The principal who has command.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CommandHolder {
    pub principal: Principal,
    pub since: Instant,
    /// The last order of the holder or sign of presence.
    pub last_active: Instant,
}

/// A pending request for command.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CommandRequest {
    pub principal: Principal,
    pub at: Instant,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CommandChangeKind {
    Taken,
    HandedOver,
    Released,
    Requested,
    Withdrawn,
}

impl CommandChangeKind {
    /// Every kind, in the order of the numbers in files.
    pub(super) const ALL: [Self; 5] = [Self::Taken, Self::HandedOver, Self::Released, Self::Requested, Self::Withdrawn];
}

/// A change of command, for the page's history.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CommandChange {
    pub at: Instant,
    pub kind: CommandChangeKind,
    /// The principal who made the change.
    pub by: String,
    /// The holder before it, by name.
    pub from: Option<String>,
    /// The holder after it, by name.
    pub to: Option<String>,
}

/// Who has command of the vehicles, who requests it, and how that came about.
#[derive(Debug, Clone, Default)]
pub struct Command {
    principals: Vec<Principal>,
    holder: Option<CommandHolder>,
    requests: Vec<CommandRequest>,
    changes: VecDeque<CommandChange>,
}

impl Command {
    /// Nobody has command. It can be handed over to these principals.
    pub fn new(principals: impl IntoIterator<Item = Principal>) -> Self {
        Self { principals: principals.into_iter().collect(), ..Self::default() }
    }

    /// Takes over the state before a restart. A principal that this surface does not know any more has no command and no
    /// request.
    pub(super) fn restore(
        &mut self,
        holder: Option<(&str, Instant, Instant)>,
        requests: impl IntoIterator<Item = (String, Instant)>,
        changes: impl IntoIterator<Item = CommandChange>,
    ) {
        let holds = |name: &str| self.known(name).filter(|principal| principal.role() >= Role::Operator);
        let holder = holder
            .and_then(|(name, since, last_active)| Some(CommandHolder { principal: holds(name)?, since, last_active }));
        let requests =
            requests.into_iter().filter_map(|(name, at)| Some(CommandRequest { principal: holds(&name)?, at }));
        let requests = requests.take(MAX_REQUESTS).collect();
        (self.holder, self.requests, self.changes) = (holder, requests, changes.into_iter().collect());
    }

    /// A principal by name. Without tokens there is one, `local`.
    fn known(&self, name: &str) -> Option<Principal> {
        let local = self.principals.is_empty().then(Principal::local);
        self.principals.iter().cloned().chain(local).find(|principal| principal.name() == name)
    }

    pub fn principals(&self) -> &[Principal] {
        &self.principals
    }

    pub fn holder(&self) -> Option<&CommandHolder> {
        self.holder.as_ref()
    }

    /// The requests that have not lapsed, the oldest first.
    pub fn requests(&self, now: Instant) -> impl Iterator<Item = &CommandRequest> {
        self.requests.iter().filter(move |r| now.since(r.at) < REQUEST_LIFETIME)
    }

    /// The last changes, the oldest first.
    pub fn changes(&self) -> impl Iterator<Item = &CommandChange> {
        self.changes.iter()
    }

    /// Whether the principal may give an order of this kind now.
    pub fn check(&self, by: &Principal, kind: OrderKind, now: Instant) -> Result<(), CommandRefusal> {
        require_role(by, kind.role())?;
        match &self.holder {
            Some(holder) if kind.needs_command() && holder.principal.name() != by.name() => Err(held(holder, now)),
            _ => Ok(()),
        }
    }

    /// An order that passed [`Command::check`] was accepted. If nobody has command and the order needs
    /// it, its giver takes it. Returns the change.
    pub fn handle_order(&mut self, by: &Principal, kind: OrderKind, now: Instant) -> Option<CommandChange> {
        if self.check(by, kind, now).is_err() {
            return None;
        }
        match self.holder {
            None if kind.needs_command() => Some(self.give(CommandChangeKind::Taken, by, Some(by.clone()), now)),
            _ => {
                self.keep(by, now);
                None
            }
        }
    }

    /// Carries out an action; returns the change, if there is one.
    pub fn handle_action(
        &mut self,
        by: &Principal,
        action: &CommandAction,
        now: Instant,
    ) -> Result<Option<CommandChange>, CommandRefusal> {
        require_role(by, Role::Operator)?;
        self.requests.retain(|r| now.since(r.at) < REQUEST_LIFETIME);
        self.keep(by, now);
        Ok(match action {
            CommandAction::Request => self.request(by, now),
            CommandAction::Withdraw => self.withdraw(by, now),
            CommandAction::Take => self.take(by, now)?,
            CommandAction::HandOver(to) => self.hand_over(by, to.as_deref(), now)?,
            CommandAction::Release => {
                self.require_command(by, now)?;
                Some(self.give(CommandChangeKind::Released, by, None, now))
            }
            CommandAction::Keep => None,
        })
    }

    fn request(&mut self, by: &Principal, now: Instant) -> Option<CommandChange> {
        let Some(holder) = &self.holder else {
            return Some(self.give(CommandChangeKind::Taken, by, Some(by.clone()), now));
        };
        if holder.principal.name() == by.name() {
            return None;
        }
        if let Some(own) = self.requests.iter_mut().find(|r| r.principal.name() == by.name()) {
            own.at = now;
            return None;
        }
        if self.requests.len() >= MAX_REQUESTS {
            self.requests.remove(0);
        }
        self.requests.push(CommandRequest { principal: by.clone(), at: now });
        Some(self.record(CommandChangeKind::Requested, by, self.holder_name(), now))
    }

    fn withdraw(&mut self, by: &Principal, now: Instant) -> Option<CommandChange> {
        let before = self.requests.len();
        self.requests.retain(|r| r.principal.name() != by.name());
        let is_withdrawn = self.requests.len() < before;
        is_withdrawn.then(|| self.record(CommandChangeKind::Withdrawn, by, self.holder_name(), now))
    }

    fn take(&mut self, by: &Principal, now: Instant) -> Result<Option<CommandChange>, CommandRefusal> {
        match &self.holder {
            Some(holder) if holder.principal.name() == by.name() => Ok(None),
            Some(holder) if now.since(holder.last_active) < COMMAND_SILENCE => Err(held(holder, now)),
            _ => Ok(Some(self.give(CommandChangeKind::Taken, by, Some(by.clone()), now))),
        }
    }

    fn hand_over(
        &mut self,
        by: &Principal,
        to: Option<&str>,
        now: Instant,
    ) -> Result<Option<CommandChange>, CommandRefusal> {
        self.require_command(by, now)?;
        let requested = self.requests.iter().map(|r| &r.principal);
        let to = match to {
            None => requested.clone().next().ok_or(CommandRefusal::NoRequest)?,
            Some(name) => {
                let found = self.principals.iter().chain(requested).chain([by]).find(|p| p.name() == name);
                found.ok_or_else(|| CommandRefusal::Unknown(name.to_owned()))?
            }
        };
        if to.role() < Role::Operator {
            return Err(CommandRefusal::CannotHold { name: to.name().to_owned(), role: to.role() });
        }
        let to = to.clone();
        Ok((to.name() != by.name()).then(|| self.give(CommandChangeKind::HandedOver, by, Some(to), now)))
    }

    fn require_command(&self, by: &Principal, now: Instant) -> Result<(), CommandRefusal> {
        let holder = self.holder.as_ref().ok_or(CommandRefusal::Vacant)?;
        if holder.principal.name() == by.name() { Ok(()) } else { Err(held(holder, now)) }
    }

    /// Notes a sign of the holder.
    fn keep(&mut self, by: &Principal, now: Instant) {
        if let Some(holder) = self.holder.as_mut().filter(|h| h.principal.name() == by.name()) {
            holder.last_active = now;
        }
    }

    fn holder_name(&self) -> Option<String> {
        self.holder.as_ref().map(|h| h.principal.name().to_owned())
    }

    /// Makes `to` the holder. A request of the new holder is granted by that; others remain.
    fn give(&mut self, kind: CommandChangeKind, by: &Principal, to: Option<Principal>, now: Instant) -> CommandChange {
        let from = self.holder_name();
        self.requests.retain(|r| to.as_ref().is_none_or(|to| r.principal.name() != to.name()));
        self.holder = to.map(|principal| CommandHolder { principal, since: now, last_active: now });
        self.record(kind, by, from, now)
    }

    fn record(&mut self, kind: CommandChangeKind, by: &Principal, from: Option<String>, now: Instant) -> CommandChange {
        let change = CommandChange { at: now, kind, by: by.name().to_owned(), from, to: self.holder_name() };
        if self.changes.len() >= MAX_COMMAND_CHANGES {
            self.changes.pop_front();
        }
        self.changes.push_back(change.clone());
        change
    }
}

fn require_role(by: &Principal, needed: Role) -> Result<(), CommandRefusal> {
    let refusal = || CommandRefusal::Role { name: by.name().to_owned(), role: by.role(), needed };
    if by.role() >= needed { Ok(()) } else { Err(refusal()) }
}

fn held(holder: &CommandHolder, now: Instant) -> CommandRefusal {
    CommandRefusal::Held {
        holder: holder.principal.name().to_owned(),
        held: now.since(holder.since),
        idle: now.since(holder.last_active),
    }
}
