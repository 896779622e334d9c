//! Command: the right to give orders, which one principal has at a time, at one client: a browser, a terminal or a program.
//!
//! Every way in (page, `scenecast ctl`, API, later other peers) passes [`Command::check`] before an order and
//! [`Command::handle_order`] after it was accepted.

use crate::record::MAX_COMMAND_CHANGES;
use scenecast_core::{ClientName, Giver, Principal, Role};
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
    /// Asks the holder for command; takes it if nobody has it, or from another client of the same principal.
    Request,
    Withdraw,
    /// Takes command after the holder's silence, or if nobody has it, or from another client of the same principal.
    Take,
    /// Gives command to this principal, or to the one whose request is the oldest.
    HandOver(Option<String>),
    Release,
    /// A sign that the holder is present; ignored from others.
    Keep,
}

impl CommandAction {
    /// What is asked, for the log.
    pub fn told(&self) -> String {
        match self {
            Self::Request => "request for command".to_owned(),
            Self::Withdraw => "end of a request for command".to_owned(),
            Self::Take => "taking of command".to_owned(),
            Self::HandOver(Some(to)) => format!("hand-over of command to {to}"),
            Self::HandOver(None) => "hand-over of command".to_owned(),
            Self::Release => "release of command".to_owned(),
            Self::Keep => "sign of presence".to_owned(),
        }
    }
}

/// The reason why an action is refused, as one line for people.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CommandRefusal {
    #[error("this needs the role {needed}; the role of {name} is {role}")]
    Role { name: String, role: Role, needed: Role },
    #[error("{holder} has had command for {} and was last active {} ago: {}", span(*.held), span(*.idle), remedy(*.idle))]
    Held { holder: String, held: Duration, idle: Duration },
    #[error("{name} has command at another client{}: take command to move it here", named(client))]
    Elsewhere { name: String, client: ClientName },
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

fn named(client: &ClientName) -> String {
    if client.as_str().is_empty() { String::new() } else { format!(" ({})", client.as_str()) }
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
    /// The client that has command. `None` after it was handed over: the first one that gives an order or a sign has it.
    pub client: Option<ClientName>,
    pub since: Instant,
    /// The last order of the holder or sign of presence.
    pub last_active: Instant,
}

impl CommandHolder {
    fn is(&self, by: &Giver) -> bool {
        self.principal.name() == by.name() && self.client.as_ref().is_none_or(|client| *client == by.client)
    }

    /// The reason why another one is refused what needs command.
    fn refusal(&self, by: &Giver, now: Instant) -> CommandRefusal {
        let name = self.principal.name().to_owned();
        match &self.client {
            Some(client) if name == by.name() => CommandRefusal::Elsewhere { name, client: client.clone() },
            _ => CommandRefusal::Held { holder: name, held: now.since(self.since), idle: now.since(self.last_active) },
        }
    }
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
    /// To another client of the same principal.
    Moved,
}

impl CommandChangeKind {
    /// Every kind, in the order of the numbers in files.
    pub(super) const ALL: [Self; 6] =
        [Self::Taken, Self::HandedOver, Self::Released, Self::Requested, Self::Withdrawn, Self::Moved];
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
        holder: Option<(&str, Option<ClientName>, Instant, Instant)>,
        requests: impl IntoIterator<Item = (String, Instant)>,
        changes: impl IntoIterator<Item = CommandChange>,
    ) {
        let holds = |name: &str| self.known(name).filter(|principal| principal.role() >= Role::Operator);
        let holder = holder.and_then(|(name, client, since, last_active)| {
            Some(CommandHolder { principal: holds(name)?, client, since, last_active })
        });
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

    /// Whether an order of this kind may be given now.
    pub fn check(&self, by: &Giver, kind: OrderKind, now: Instant) -> Result<(), CommandRefusal> {
        require_role(by, kind.role())?;
        match &self.holder {
            Some(holder) if kind.needs_command() && !holder.is(by) => Err(holder.refusal(by, now)),
            _ => Ok(()),
        }
    }

    /// An order that passed [`Command::check`] was accepted. If nobody has command and the order needs
    /// it, its giver takes it. Returns the change.
    pub fn handle_order(&mut self, by: &Giver, kind: OrderKind, now: Instant) -> Option<CommandChange> {
        if self.check(by, kind, now).is_err() {
            return None;
        }
        match self.holder {
            None if kind.needs_command() => Some(self.give_to(CommandChangeKind::Taken, by, now)),
            _ => {
                self.keep(by, now);
                None
            }
        }
    }

    /// Carries out an action; returns the change, if there is one.
    pub fn handle_action(
        &mut self,
        by: &Giver,
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

    fn request(&mut self, by: &Giver, now: Instant) -> Option<CommandChange> {
        if self.holder.as_ref().is_none_or(|holder| holder.principal.name() == by.name()) {
            return self.take(by, now).ok().flatten();
        }
        if let Some(own) = self.requests.iter_mut().find(|r| r.principal.name() == by.name()) {
            own.at = now;
            return None;
        }
        if self.requests.len() >= MAX_REQUESTS {
            self.requests.remove(0);
        }
        self.requests.push(CommandRequest { principal: by.principal.clone(), at: now });
        Some(self.record(CommandChangeKind::Requested, by, self.holder_name(), now))
    }

    fn withdraw(&mut self, by: &Giver, now: Instant) -> Option<CommandChange> {
        let before = self.requests.len();
        self.requests.retain(|r| r.principal.name() != by.name());
        let is_withdrawn = self.requests.len() < before;
        is_withdrawn.then(|| self.record(CommandChangeKind::Withdrawn, by, self.holder_name(), now))
    }

    fn take(&mut self, by: &Giver, now: Instant) -> Result<Option<CommandChange>, CommandRefusal> {
        let kind = match &self.holder {
            Some(holder) if holder.is(by) => return Ok(None),
            Some(holder) if holder.principal.name() == by.name() => CommandChangeKind::Moved,
            Some(holder) if now.since(holder.last_active) < COMMAND_SILENCE => return Err(holder.refusal(by, now)),
            _ => CommandChangeKind::Taken,
        };
        Ok(Some(self.give_to(kind, by, now)))
    }

    fn hand_over(
        &mut self,
        by: &Giver,
        to: Option<&str>,
        now: Instant,
    ) -> Result<Option<CommandChange>, CommandRefusal> {
        self.require_command(by, now)?;
        let requested = self.requests.iter().map(|r| &r.principal);
        let to = match to {
            None => requested.clone().next().ok_or(CommandRefusal::NoRequest)?,
            Some(name) => {
                let found = self.principals.iter().chain(requested).chain([&by.principal]).find(|p| p.name() == name);
                found.ok_or_else(|| CommandRefusal::Unknown(name.to_owned()))?
            }
        };
        if to.role() < Role::Operator {
            return Err(CommandRefusal::CannotHold { name: to.name().to_owned(), role: to.role() });
        }
        let to = to.clone();
        let holder = CommandHolder { principal: to, client: None, since: now, last_active: now };
        let is_other = holder.principal.name() != by.name();
        Ok(is_other.then(|| self.give(CommandChangeKind::HandedOver, by, Some(holder), now)))
    }

    fn require_command(&self, by: &Giver, now: Instant) -> Result<(), CommandRefusal> {
        let holder = self.holder.as_ref().ok_or(CommandRefusal::Vacant)?;
        if holder.is(by) { Ok(()) } else { Err(holder.refusal(by, now)) }
    }

    /// Notes a sign of the holder.
    fn keep(&mut self, by: &Giver, now: Instant) {
        if let Some(holder) = self.holder.as_mut().filter(|holder| holder.is(by)) {
            holder.client = Some(by.client.clone());
            holder.last_active = now;
        }
    }

    fn holder_name(&self) -> Option<String> {
        self.holder.as_ref().map(|h| h.principal.name().to_owned())
    }

    fn give_to(&mut self, kind: CommandChangeKind, by: &Giver, now: Instant) -> CommandChange {
        let Giver { principal, client } = by.clone();
        let holder = CommandHolder { principal, client: Some(client), since: now, last_active: now };
        self.give(kind, by, Some(holder), now)
    }

    /// Makes `to` the holder. A request of the new holder is granted by that; others remain.
    fn give(&mut self, kind: CommandChangeKind, by: &Giver, to: Option<CommandHolder>, now: Instant) -> CommandChange {
        let from = self.holder_name();
        self.requests.retain(|r| to.as_ref().is_none_or(|to| r.principal.name() != to.principal.name()));
        self.holder = to;
        self.record(kind, by, from, now)
    }

    fn record(&mut self, kind: CommandChangeKind, by: &Giver, from: Option<String>, now: Instant) -> CommandChange {
        let change = CommandChange { at: now, kind, by: by.name().to_owned(), from, to: self.holder_name() };
        if self.changes.len() >= MAX_COMMAND_CHANGES {
            self.changes.pop_front();
        }
        self.changes.push_back(change.clone());
        change
    }
}

fn require_role(by: &Giver, needed: Role) -> Result<(), CommandRefusal> {
    let refusal = || CommandRefusal::Role { name: by.name().to_owned(), role: by.role(), needed };
    if by.role() >= needed { Ok(()) } else { Err(refusal()) }
}
