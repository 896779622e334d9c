//! The state of the acoustic connection, and whose turn it is.

use super::receiver::Receiver;
use super::sender::Sender;
use crate::Duration;
use crate::modem::s2c::S2c;
use crate::modem::s2c::air::Outgoing;
use crate::modem::s2c::reception::Signal;

/// Where the acoustic connection stands.
#[derive(Debug, Default)]
pub(in super::super) enum Link {
    /// No connection.
    #[default]
    Listen,
    /// A request is out.
    Establishing { peer: u8, session: u8, attempts: u32 },
    /// Connected.
    Online(Box<Connection>),
}

#[derive(Debug)]
pub(in super::super) struct Connection {
    pub peer: u8,
    pub session: u8,
    /// Asked for the connection, and closes it.
    pub initiator: bool,
    pub sender: Sender,
    pub receiver: Receiver,
    pub turn: Turn,
    /// Counts changes of the turn, from another start in each connection, so that old timers are told from the present.
    pub number: u64,
    /// Trains and probes in a row that nobody answered.
    pub silent: u32,
    /// One way, from the last frame heard of the peer.
    pub travel: Duration,
    /// When the peer was last heard.
    pub heard_at: Duration,
    /// Acknowledgements that wait for this modem's turn.
    pub deferred: Vec<Outgoing>,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(in super::super) enum Turn {
    /// Nobody owes anything: either may begin.
    Idle,
    /// Ours: a train is being sent, or is about to be.
    Talking,
    /// The peer's: it owes an acknowledgement.
    Waiting,
    /// The peer's: it is sending.
    Listening,
}

impl Link {
    pub(in super::super) fn connection(&self) -> Option<&Connection> {
        match self {
            Link::Online(connection) => Some(connection),
            _ => None,
        }
    }

    pub(in super::super) fn connection_mut(&mut self) -> Option<&mut Connection> {
        match self {
            Link::Online(connection) => Some(connection),
            _ => None,
        }
    }

    /// The other end of a connection, up or being established.
    pub(in super::super) fn peer(&self) -> Option<u8> {
        match self {
            Link::Listen => None,
            Link::Establishing { peer, .. } => Some(*peer),
            Link::Online(connection) => Some(connection.peer),
        }
    }
}

impl Connection {
    pub(in super::super) fn new(peer: u8, session: u8, initiator: bool, signal: &Signal, number: u64) -> Self {
        Self {
            peer,
            session,
            initiator,
            sender: Sender::default(),
            receiver: Receiver::default(),
            turn: if initiator { Turn::Talking } else { Turn::Listening },
            number,
            silent: 0,
            travel: signal.travel,
            heard_at: signal.heard_at,
            deferred: Vec::new(),
        }
    }
}

impl S2c {
    pub(in super::super) fn is_online(&self) -> bool {
        self.burst.link.connection().is_some()
    }

    /// Whether an instant message may go out now without disturbing a connection.
    pub(in super::super) fn may_talk(&self) -> bool {
        match &self.burst.link {
            Link::Listen => true,
            Link::Establishing { .. } => false,
            Link::Online(connection) => connection.turn == Turn::Idle,
        }
    }

    /// Whether others own the water: a connection between other nodes, or ours to another node than `dst`.
    pub(in super::super) fn in_backoff(&self, dst: u8, now: Duration) -> bool {
        now < self.burst.backoff_until || self.burst.link.peer().is_some_and(|peer| peer != dst)
    }

    /// How much longer an acknowledgement may take because the peer's turn comes later.
    pub(in super::super) fn turn_allowance(&self) -> Duration {
        let train = u64::from(self.settings.get("ZC")) * u64::from(self.settings.get("ZP"));
        if self.is_online() { Duration::from_millis(train + 2000) } else { Duration::ZERO }
    }

    pub(in super::super) fn connected_to(&self, peer: u8) -> bool {
        self.burst.link.connection().is_some_and(|connection| connection.peer == peer)
    }

    /// Sends an acknowledgement at this modem's next turn.
    pub(in super::super) fn defer(&mut self, out: Outgoing) {
        if let Some(connection) = self.burst.link.connection_mut() {
            connection.deferred.push(out);
        }
    }

    /// The words of `AT?S`.
    pub(in super::super) fn state_name(&self, now: Duration) -> &'static str {
        use crate::modem::s2c::Physical;
        match (&self.burst.link, self.physical) {
            (_, Physical::Noise) => "NOISE",
            (_, Physical::Deaf) => "DEAF",
            (Link::Establishing { .. }, _) => "INITIATION ESTABLISH",
            (Link::Online(_), _) => "ONLINE",
            (Link::Listen, _) if now < self.burst.backoff_until => "BACKOFF",
            (Link::Listen, _) => "INITIATION LISTEN",
        }
    }
}
