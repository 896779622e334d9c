//! The state of one pair of ends.

use super::{DropReason, Flight, FrameNumber, LinkStats, Refusal, Sessions, Sighting, Window};
use crate::wire::{Address, Chunks, Frame, FrameBuilder, Header, MissionId, SessionId};

/// What a taken frame tells.
#[derive(Debug)]
pub struct Inbound<'a, T> {
    /// Its header.
    pub header: Header,
    /// Whether the peer has restarted: all it had acknowledged is void. To be handled before everything else.
    pub restarted: bool,
    /// What own frames carried that are newly judged, and whether they arrived; in the order sent.
    pub fates: Vec<(T, bool)>,
    /// Its number, unless it is a hello.
    pub number: Option<FrameNumber>,
    /// The sender bases its map chunks on every frame up to here.
    pub base: FrameNumber,
    /// What it carries.
    pub chunks: Chunks<'a>,
}

/// Sessions, flight, window and counters toward one peer; `T` is what a frame carried.
#[derive(Debug)]
pub struct Pair<T> {
    mission: MissionId,
    us: Address,
    peer: Address,
    sessions: Sessions,
    flight: Flight<T>,
    window: Option<Window>,
    /// Counters.
    pub stats: LinkStats,
}

impl<T> Pair<T> {
    /// A pair that has not met; `own` is the random session of this run.
    pub fn new(mission: MissionId, us: Address, peer: Address, own: SessionId) -> Self {
        let stats = LinkStats::default();
        Self { mission, us, peer, sessions: Sessions::new(own), flight: Flight::default(), window: None, stats }
    }

    /// The other end.
    pub fn peer(&self) -> Address {
        self.peer
    }

    /// Whether the peer's session is known.
    pub fn is_met(&self) -> bool {
        self.sessions.peer().is_some()
    }

    /// Our session.
    pub fn own_session(&self) -> SessionId {
        self.sessions.own()
    }

    /// The peer's session.
    pub fn peer_session(&self) -> Option<SessionId> {
        self.sessions.peer()
    }

    /// Whether frames of unknown fate fill the window.
    pub fn is_full(&self) -> bool {
        self.flight.is_full()
    }

    /// The last frame whose fate is known.
    pub fn horizon(&self) -> FrameNumber {
        self.flight.horizon()
    }

    /// Number of the next frame; the peer sees its low bits.
    pub fn next_number(&self) -> FrameNumber {
        self.flight.next_number()
    }

    /// The window of heard frames, if there is one.
    pub fn window_mut(&mut self) -> Option<&mut Window> {
        self.window.as_mut()
    }

    /// Reads a frame of this peer; what is dropped is counted.
    pub fn handle_frame<'a>(&mut self, bytes: &'a [u8]) -> Result<Inbound<'a, T>, DropReason> {
        let result = self.read_frame(bytes);
        match &result {
            Ok(inbound) => self.stats.frames_heard += u64::from(inbound.number.is_some()),
            Err(reason) => self.stats.drop(*reason),
        }
        result
    }

    fn read_frame<'a>(&mut self, bytes: &'a [u8]) -> Result<Inbound<'a, T>, DropReason> {
        let own = self.sessions.own();
        let frame = Frame::decode(bytes, self.mission, self.us, |_| own)?;
        if frame.header.from != self.peer {
            return Err(DropReason::Stranger);
        }
        if !frame.chunks().are_sound() {
            return Err(DropReason::Malformed);
        }
        let restarted = match self.sessions.observe(frame.header.session) {
            Sighting::Known => false,
            Sighting::New => true,
            Sighting::Retired => return Err(DropReason::OldSession),
        };
        if restarted {
            self.stats.peer_restarts += 1;
            self.flight.handle_peer_restart();
            self.window = None;
        }
        let header = frame.header.clone();
        if header.hello {
            return Ok(Inbound {
                header,
                restarted,
                fates: Vec::new(),
                number: None,
                base: 0,
                chunks: Chunks::default(),
            });
        }
        let fates = header.ack.as_ref().map_or_else(Vec::new, |ack| self.flight.handle_statement(ack));
        for (_, delivered) in &fates {
            *(if *delivered { &mut self.stats.frames_delivered } else { &mut self.stats.frames_lost }) += 1;
        }
        let window = self.window.get_or_insert_with(|| Window::opened_by(header.number, header.base));
        // A frame that is not taken has still told us the fate of ours, so that goes up with the refusal.
        let before = window.highest();
        let number = match window.accept(header.number, header.base) {
            Ok(number) => {
                self.stats.frames_numbered += window.highest() - before;
                Some(number)
            }
            Err(refusal) if fates.is_empty() && !restarted => return Err(refusal.into()),
            Err(refusal) => {
                self.stats.drop(refusal.into());
                None
            }
        };
        let base = window.base();
        let chunks = if number.is_some() { frame.chunks() } else { Chunks::default() };
        Ok(Inbound { header, restarted, fates, number, base, chunks })
    }

    /// Starts the next frame, with at most `ack_room` bytes of acknowledgement; a hello if the peer's session is not known or
    /// `hello` is asked for.
    pub fn begin_frame(
        &mut self,
        size: usize,
        ack_room: usize,
        remaining: u8,
        turn: Option<u8>,
        hello: bool,
    ) -> (FrameBuilder, bool) {
        let hello = hello || !self.is_met();
        let ack = if hello { None } else { self.window.as_mut().and_then(|w| w.statement(ack_room)) };
        let header = Header {
            from: self.us,
            to: self.peer,
            session: self.sessions.own(),
            number: self.flight.next_number() as u16,
            base: self.flight.base_distance(),
            remaining,
            turn,
            ack,
            hello,
        };
        (FrameBuilder::new(&header, size), hello)
    }

    /// Seals a frame and remembers what it carries.
    pub fn finish_frame(&mut self, builder: FrameBuilder, carried: T, hello: bool, short: bool) -> Vec<u8> {
        self.stats.frames_sent += 1;
        if hello {
            return builder.finish(self.mission, None, short);
        }
        self.flight.push(carried);
        builder.finish(self.mission, self.sessions.peer(), short)
    }

    /// Begins a new run of ours toward the peer, because what the two ends hold does not agree.
    pub fn renew(&mut self, own: SessionId) {
        self.stats.resyncs += 1;
        self.sessions.renew(own);
        self.flight.handle_peer_restart();
        self.window = None;
    }
}

impl From<Refusal> for DropReason {
    fn from(refusal: Refusal) -> Self {
        match refusal {
            Refusal::Duplicate => Self::Duplicate,
            Refusal::Late => Self::Late,
            Refusal::NoBase => Self::NoBase,
        }
    }
}
