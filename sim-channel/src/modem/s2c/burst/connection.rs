//! The state of the acoustic connection, and whose turn it is.

use super::pool::{Receiver, Sender};
use crate::modem::s2c::base::{QueuedFrame, ReceivedSignal, S2cFrame};
use std::time::Duration;

#[derive(Debug, Default)]
pub(super) enum AcousticLink {
    #[default]
    Listen,
    /// A request has been sent.
    Establishing {
        peer: u8,
        session: u8,
        attempts: u32,
    },
    Online(Box<Connection>),
}

#[derive(Debug)]
pub(super) struct Connection {
    pub peer: u8,
    pub session: u8,
    /// This modem requested the connection, and closes it.
    pub initiator: bool,
    pub sender: Sender,
    pub receiver: Receiver,
    turn: TurnState,
    /// Counts changes of the turn, from another start in each connection, so that old timers are recognised.
    number: u64,
    /// Trains and probes in a row that the peer did not acknowledge.
    unanswered: u32,
    /// One way, from the last frame of the peer.
    travel: Duration,
    /// Time of the last frame of the peer.
    last_received_at: Duration,
    /// Acknowledgements that wait for this modem's turn.
    pub deferred: Vec<QueuedFrame>,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum TurnState {
    /// Neither modem owes an acknowledgement: either may begin.
    Idle,
    /// Ours: a train is being sent, or is about to be.
    Sending,
    /// The peer's: it owes an acknowledgement.
    AwaitingAck,
    /// The peer's: it is sending.
    Receiving,
}

impl AcousticLink {
    pub(super) fn connection(&self) -> Option<&Connection> {
        match self {
            AcousticLink::Online(connection) => Some(connection),
            _ => None,
        }
    }

    pub(super) fn connection_mut(&mut self) -> Option<&mut Connection> {
        match self {
            AcousticLink::Online(connection) => Some(connection),
            _ => None,
        }
    }

    /// The connection, if its turn still is the one with that number.
    pub(super) fn connection_in_turn(&mut self, number: u64) -> Option<&mut Connection> {
        self.connection_mut().filter(|connection| connection.number == number)
    }

    pub(super) fn peer(&self) -> Option<u8> {
        match self {
            AcousticLink::Listen => None,
            AcousticLink::Establishing { peer, .. } => Some(*peer),
            AcousticLink::Online(connection) => Some(connection.peer),
        }
    }
}

impl Connection {
    pub(super) fn new(peer: u8, session: u8, initiator: bool, signal: &ReceivedSignal, number: u64) -> Self {
        Self {
            peer,
            session,
            initiator,
            sender: Sender::default(),
            receiver: Receiver::default(),
            turn: if initiator { TurnState::Sending } else { TurnState::Receiving },
            number,
            unanswered: 0,
            travel: signal.one_way,
            last_received_at: signal.received_at,
            deferred: Vec::new(),
        }
    }

    pub(super) fn turn(&self) -> TurnState {
        self.turn
    }

    /// The number of the present turn.
    pub(super) fn number(&self) -> u64 {
        self.number
    }

    /// Changes the turn; returns its new number.
    pub(super) fn enter(&mut self, turn: TurnState) -> u64 {
        self.turn = turn;
        self.number += 1;
        self.number
    }

    /// One-way travel time to the peer.
    pub(super) fn travel(&self) -> Duration {
        self.travel
    }

    pub(super) fn last_received_at(&self) -> Duration {
        self.last_received_at
    }

    /// Whether a frame belongs to this connection.
    pub(super) fn owns(&self, frame: &S2cFrame) -> bool {
        self.peer == frame.src && self.session == frame.tag
    }

    /// A frame of the peer has come.
    pub(super) fn on_peer_frame(&mut self, signal: &ReceivedSignal) {
        self.unanswered = 0;
        self.travel = signal.one_way;
        self.last_received_at = signal.received_at;
    }

    /// The peer did not acknowledge; returns how often in a row.
    pub(super) fn on_unanswered(&mut self) -> u32 {
        self.unanswered += 1;
        self.unanswered
    }
}
