//! The state of one end toward one peer.

use super::handshake::{Handshake, HandshakeOutcome};
use super::mismatch::{Mismatch, MismatchReport};
use super::run::{Authenticity, Identity};
use super::{DropReason, FrameNumber, LinkStats, LinkWindow, WindowRefusal};
use crate::directive::Series;
use crate::seal::{Direction, SessionKey, TAG_BYTES};
use crate::wire::{
    Address, ChunkKind, Chunks, Envelope, Frame, FrameBuilder, FrameKind, Header, Introduction, MissionId, Seal, Stamp,
    WIRE_VERSION,
};

/// The content of a verified frame.
#[derive(Debug)]
pub struct Inbound<'a, T> {
    /// Whether the peer has begun a new run, so that it holds none of our state. To be handled before all else.
    pub restarted: bool,
    /// The content of own frames that are newly judged, in the order sent, and whether each arrived.
    pub fates: Vec<(T, bool)>,
    /// The frame's number, if it was accepted.
    pub number: Option<FrameNumber>,
    /// Whether no frame with a higher number came in before.
    pub is_latest: bool,
    /// The sender bases its map chunks on every frame up to here.
    pub base: FrameNumber,
    /// Whether it was rejected because it builds on frames that we never acknowledged.
    pub lacks_base: bool,
    frame: Frame<'a>,
}

impl<'a, T> Inbound<'a, T> {
    /// A frame of which only the header counts.
    fn empty(restarted: bool, frame: Frame<'a>) -> Self {
        Self { restarted, fates: Vec::new(), number: None, is_latest: true, base: 0, lacks_base: false, frame }
    }

    /// The header of the frame.
    pub fn header(&self) -> &Header {
        &self.frame.header
    }

    /// The chunks of the frame; none if it was not accepted.
    pub fn chunks(&self) -> Chunks<'_> {
        if self.number.is_some() { self.frame.chunks() } else { Chunks::default() }
    }
}

/// Handshake, flight, window and counters toward one peer. `T` is the content of a sent frame.
#[derive(Debug)]
pub struct LinkPair<T> {
    mission: MissionId,
    us: Address,
    peer: Address,
    authenticity: Option<Authenticity>,
    /// The introduction in the hellos of this end.
    introduction: Introduction,
    handshake: Handshake<T>,
    mismatch: MismatchReport,
    /// At the vehicle: the surface's last frame with a turn is to be answered with a hello.
    owes_hello: bool,
    /// Consecutive frames that seem to come from another run of the peer.
    strays: u32,
    /// Counters and estimates of this link.
    pub stats: LinkStats,
}

impl<T> LinkPair<T> {
    /// Strays after which the two ends are taken to have lost each other's runs.
    const STRAYS: u32 = 3;

    /// A pair without contact; `seed` must be random for each start of the program.
    pub fn new(
        mission: MissionId,
        us: Address,
        peer: Address,
        authenticity: Option<Authenticity>,
        introduction: Introduction,
        seed: u64,
    ) -> Self {
        let (handshake, mismatch, stats) = (Handshake::new(seed), MismatchReport::default(), LinkStats::default());
        Self { mission, us, peer, authenticity, introduction, handshake, mismatch, owes_hello: false, strays: 0, stats }
    }

    /// The introduction of the peer's current run.
    pub fn peer_introduction(&self) -> Option<&Introduction> {
        self.handshake.run().map(|r| &r.introduction)
    }

    /// Names another series in the hellos of this end; returns whether it is another one.
    pub fn set_series(&mut self, series: Series) -> bool {
        self.introduction.series.replace(series) != Some(series)
    }

    /// A setting in which the peer differs, once after it was found.
    pub fn poll_mismatch(&mut self) -> Option<Mismatch> {
        self.mismatch.poll()
    }

    /// The address of the other end.
    pub fn peer(&self) -> Address {
        self.peer
    }

    /// Whether there is a current run of the peer.
    pub fn has_run(&self) -> bool {
        self.handshake.run().is_some() && !self.handshake.is_leaving()
    }

    /// Whether there is a run of the peer, or a hello of one.
    pub fn has_contact(&self) -> bool {
        self.handshake.run().is_some() || self.handshake.offered().is_some()
    }

    /// Whether a numbered frame has shown that the peer uses the current run.
    pub fn is_proven(&self) -> bool {
        self.handshake.run().is_some_and(|r| r.window.highest() > 0)
    }

    /// Whether frames of unknown fate fill the window.
    pub fn is_full(&self) -> bool {
        self.handshake.run().is_some_and(|r| r.flight.is_full())
    }

    /// The number of frames of unknown fate.
    pub fn outstanding(&self) -> u64 {
        self.handshake.run().map_or(0, |r| r.flight.next_number() - 1 - r.flight.horizon())
    }

    /// The last frame whose fate is known, 0 before the first.
    pub fn horizon(&self) -> FrameNumber {
        self.handshake.run().map_or(0, |r| r.flight.horizon())
    }

    /// The number of the next frame, 0 without a run.
    pub fn next_number(&self) -> FrameNumber {
        self.handshake.run().map_or(0, |r| r.flight.next_number())
    }

    /// The window of received frames, if there is a run.
    pub fn window_mut(&mut self) -> Option<&mut LinkWindow> {
        self.handshake.run_mut().map(|r| &mut r.window)
    }

    /// Whether the peer seems to use other runs than this end does.
    pub fn seems_out_of_step(&self) -> bool {
        self.strays >= Self::STRAYS
    }

    /// Received frames that no acknowledgement statement of ours covers yet.
    pub fn unstated(&self) -> u64 {
        self.handshake.run().map_or(0, |r| r.window.unstated())
    }

    /// Bytes of the acknowledgement statement on all received frames.
    pub fn statement_bytes(&self) -> usize {
        self.handshake.run().map_or(0, |r| r.window.statement_bytes())
    }

    /// Bytes of the seal of our frames, and of the nonce of a hello.
    pub fn seal_bytes(&self) -> usize {
        match (self.is_keyed(self.direction_out()), self.has_run()) {
            (true, true) => TAG_BYTES,
            (true, false) => TAG_BYTES + 8,
            (false, _) => 4,
        }
    }

    /// The most bytes of a hello of ours.
    pub fn hello_bytes(&self) -> usize {
        const HEADER_AND_TURN: usize = 9;
        const CHUNK_HEAD: usize = 2;
        let seal = if self.authenticity.is_some() { 8 + TAG_BYTES } else { Seal::bytes(false, 0) };
        HEADER_AND_TURN + CHUNK_HEAD + self.introduction.encode().len() + seal
    }

    /// Bytes of the seal of a full frame of ours.
    pub fn full_seal_bytes(&self, frame_bytes: usize) -> usize {
        Seal::bytes(self.is_keyed(self.direction_out()), frame_bytes)
    }

    fn direction_out(&self) -> Direction {
        if self.us == Address::SURFACE { Direction::Down } else { Direction::Up }
    }

    fn direction_in(&self) -> Direction {
        if self.us == Address::SURFACE { Direction::Up } else { Direction::Down }
    }

    fn is_keyed(&self, direction: Direction) -> bool {
        self.authenticity.as_ref().is_some_and(|a| a.all || matches!(direction, Direction::Down))
    }

    /// Opens a frame of this peer. `decodes` tells whether the chunks of a frame with this base decode; a frame of which
    /// one does not changes nothing. The error is the reason for which the frame was dropped and counted.
    pub fn handle_frame<'a>(
        &mut self,
        envelope: &Envelope<'a>,
        decodes: impl Fn(FrameNumber, Chunks<'_>) -> bool,
    ) -> Result<Inbound<'a, T>, DropReason> {
        let result = match envelope.header.kind {
            FrameKind::Hello => self.read_hello(envelope),
            FrameKind::Numbered => self.read_numbered(envelope, decodes),
        };
        if let Err(reason) = &result {
            self.stats.drop(*reason);
        }
        result
    }

    fn read_hello<'a>(&mut self, envelope: &Envelope<'a>) -> Result<Inbound<'a, T>, DropReason> {
        let header = &envelope.header;
        let own = if self.us == Address::SURFACE { Some(self.handshake.own()) } else { None };
        let (session, nonce) = own.map_or((0, 0), |o| (o.session.get(), o.nonce));
        let frame = match &self.authenticity {
            Some(a) => envelope.open(&Seal::Hello(&a.key, self.mission, session, nonce)),
            None => envelope.open(&Seal::Crc(self.mission, session)),
        };
        let Some(frame) = frame else { return Err(self.refuse(envelope, session)) };
        let is_other = envelope.version != WIRE_VERSION;
        let introduction = introduction_of(&frame).filter(|i| own.is_some() || i.series.is_some());
        let introduction = match (is_other, introduction) {
            (false, Some(introduction)) => introduction,
            (false, None) => return Err(DropReason::Malformed),
            // The answer to it names our version. No numbered frame of such a run is ever read.
            (true, _) => Introduction::default(),
        };
        if is_other {
            self.mismatch.note(Mismatch::Version(envelope.version));
            if own.is_some() {
                return Err(DropReason::Version);
            }
        }
        let peer = Identity { session: header.session, nonce: header.nonce.unwrap_or_default() };
        let key = session_key(self.authenticity.clone(), self.mission, self.us, self.peer);
        let outcome = match own {
            Some(_) => self.handshake.handle_answer(peer, introduction, key),
            None => self.handshake.handle_call(peer, introduction, key),
        };
        if outcome == HandshakeOutcome::Retired {
            // A late hello can make the current run look ended; the vehicle's next frames decide.
            self.strays += u32::from(own.is_some());
            return Err(DropReason::OldSession);
        }
        let is_new = outcome == HandshakeOutcome::New;
        self.owes_hello = is_new && own.is_none();
        let restarted = is_new && own.is_some();
        self.stats.peer_restarts += u64::from(restarted);
        self.strays = 0;
        Ok(Inbound::empty(restarted, frame))
    }

    fn read_numbered<'a>(
        &mut self,
        envelope: &Envelope<'a>,
        decodes: impl Fn(FrameNumber, Chunks<'_>) -> bool,
    ) -> Result<Inbound<'a, T>, DropReason> {
        let (mission, direction) = (self.mission, self.direction_in());
        let keyed = self.is_keyed(direction);
        let offered = self.handshake.offered().and_then(|r| r.open(envelope, mission, direction, keyed));
        let restarted = offered.is_some();
        let known = || self.handshake.run().and_then(|r| r.open(envelope, mission, direction, keyed));
        let Some(frame) = offered.or_else(known) else {
            let reason = self.refuse(envelope, self.handshake.own().session.get());
            let stray = self.handshake.run().is_none_or(|r| r.peer.session != envelope.header.session);
            // Without a valid CRC the session may be noise; without a valid tag it may be a forgery.
            self.strays += u32::from(stray && reason == DropReason::OldSession);
            return Err(reason);
        };
        if !frame.chunks().are_sound() {
            return Err(DropReason::Malformed);
        }
        if !restarted && !self.decodes(&frame, decodes) {
            return Err(DropReason::Undecodable);
        }
        self.strays = 0;
        self.mismatch.clear();
        if restarted {
            self.handshake.accept_offered();
            self.stats.peer_restarts += 1;
        }
        self.owes_hello = self.handshake.is_leaving();
        if self.owes_hello {
            return Ok(Inbound::empty(restarted, frame));
        }
        self.take(frame, restarted)
    }

    /// Whether the chunks of a frame decode, if the window would accept it.
    fn decodes(&self, frame: &Frame<'_>, decodes: impl Fn(FrameNumber, Chunks<'_>) -> bool) -> bool {
        let Some(run) = self.handshake.run() else { return true };
        match run.window.preview(frame.header.number, frame.header.base) {
            Ok((_, base)) => decodes(base, frame.chunks()),
            Err(_) => true,
        }
    }

    fn take<'a>(&mut self, frame: Frame<'a>, restarted: bool) -> Result<Inbound<'a, T>, DropReason> {
        let header = &frame.header;
        let Some(run) = self.handshake.run_mut() else { return Err(DropReason::UnknownSender) };
        let fates = header.ack.as_ref().map_or_else(Vec::new, |ack| run.flight.handle_statement(ack));
        for (_, delivered) in &fates {
            self.stats.judge(*delivered);
        }
        // A rejected frame has still reported fates of ours, so these are returned with it.
        let before = run.window.highest();
        let mut lacks_base = false;
        let number = match run.window.accept(header.number, header.base) {
            Ok(number) => {
                self.stats.take(before, number);
                Some(number)
            }
            Err(refusal) if fates.is_empty() && !restarted => return Err(refusal.into()),
            Err(refusal) => {
                lacks_base = refusal == WindowRefusal::NoBase;
                self.stats.drop(refusal.into());
                None
            }
        };
        let is_latest = number.is_some_and(|n| n > before);
        Ok(Inbound { restarted, fates, number, is_latest, base: run.window.base(), lacks_base, frame })
    }

    /// The most likely reason why a frame does not open.
    fn refuse(&mut self, envelope: &Envelope<'_>, session: u16) -> DropReason {
        let kind = envelope.header.kind;
        let expected = if kind.is_hello() { self.authenticity.is_some() } else { self.is_keyed(self.direction_in()) };
        let plain = || envelope.open(&Seal::Crc(self.mission, session)).is_some();
        match (expected, envelope.header.keyed) {
            (false, true) => {
                self.mismatch.note(Mismatch::Tag);
                DropReason::Keyed
            }
            (true, false) if plain() => {
                self.mismatch.note(Mismatch::NoTag);
                DropReason::Unauthenticated
            }
            (false, false) if !kind.is_hello() && plain() => DropReason::OldSession,
            _ => DropReason::Checksum,
        }
    }

    /// Whether the next frame must be a hello.
    pub fn must_send_hello(&self) -> bool {
        self.owes_hello || self.handshake.run().is_none()
    }

    /// Starts the next frame, with at most `ack_room` bytes of acknowledgement. It becomes a hello if `kind` demands it
    /// or the handshake is not complete.
    pub fn begin_frame(
        &mut self,
        size: usize,
        ack_room: usize,
        turn: Option<u8>,
        stamp: Option<Stamp>,
        kind: FrameKind,
    ) -> FrameBuilder {
        let kind = FrameKind::hello_if(kind.is_hello() || self.must_send_hello());
        let hello = kind.is_hello();
        let own = self.handshake.offered().filter(|_| hello).map_or(self.handshake.own(), |r| r.own);
        let direction = self.direction_out();
        let keyed = if hello { self.authenticity.is_some() } else { self.is_keyed(direction) };
        let run = self.handshake.run_mut().filter(|_| !hello);
        let (number, base) = run.as_ref().map_or((0, 1), |r| (r.flight.next_number() as u16, r.flight.base_distance()));
        let header = Header {
            from: self.us,
            to: self.peer,
            session: own.session,
            number,
            base,
            remaining: 0,
            turn,
            stamp,
            nonce: (hello && keyed).then_some(own.nonce),
            ack: run.and_then(|r| r.window.statement(ack_room)),
            kind,
            keyed,
        };
        let mut builder = FrameBuilder::new(&header, size);
        if hello {
            builder.push(ChunkKind::Introduction, &self.introduction.encode());
        }
        builder
    }

    /// Closes a frame and keeps its content until its fate is known.
    pub fn finish_frame(&mut self, builder: FrameBuilder, carried: T, kind: FrameKind, short: bool) -> Vec<u8> {
        self.stats.frames_sent += 1;
        let direction = self.direction_out();
        if kind.is_hello() || self.must_send_hello() {
            let to = self.handshake.offered().filter(|_| self.us != Address::SURFACE).map(|r| r.peer);
            let (session, nonce) = to.map_or((0, 0), |p| (p.session.get(), p.nonce));
            return match &self.authenticity {
                Some(a) => builder.finish(&Seal::Hello(&a.key, self.mission, session, nonce), short),
                None => builder.finish(&Seal::Crc(self.mission, session), short),
            };
        }
        let (mission, keyed) = (self.mission, self.is_keyed(direction));
        let Some(run) = self.handshake.run_mut() else { return Vec::new() };
        let number = run.flight.next_number();
        run.flight.push(carried);
        match run.key.as_ref().filter(|_| keyed) {
            Some(key) => builder.finish(&Seal::Session(key, direction, number), short),
            None => builder.finish(&Seal::Crc(mission, run.peer.session.get()), short),
        }
    }

    /// Begins a new run toward the peer, because the states of the two ends do not agree.
    pub fn renew(&mut self) {
        self.stats.resyncs += 1;
        self.strays = 0;
        if self.us == Address::SURFACE {
            self.handshake.renew_surface();
        } else {
            let key = session_key(self.authenticity.clone(), self.mission, self.us, self.peer);
            self.handshake.renew_vehicle(key);
            self.owes_hello = self.handshake.is_leaving();
        }
    }
}

/// The introduction in a hello.
fn introduction_of(frame: &Frame<'_>) -> Option<Introduction> {
    let chunk = frame.chunks().find(|chunk| chunk.kind == ChunkKind::Introduction)?;
    Introduction::decode(chunk.payload).ok()
}

/// Derives the key of a run of ours with a run of the peer.
fn session_key(
    authenticity: Option<Authenticity>,
    mission: MissionId,
    us: Address,
    peer: Address,
) -> impl Fn(Identity, Identity) -> Option<SessionKey> {
    move |own, other| {
        let a = authenticity.as_ref()?;
        let (surface, vehicle) = if us == Address::SURFACE { (own, other) } else { (other, own) };
        let number = if us == Address::SURFACE { peer.number() } else { us.number() };
        Some(a.key.session(mission.0, number, surface.nonce, vehicle.nonce, a.encrypt))
    }
}

impl From<WindowRefusal> for DropReason {
    fn from(refusal: WindowRefusal) -> Self {
        match refusal {
            WindowRefusal::Duplicate => Self::Duplicate,
            WindowRefusal::Late => Self::Late,
            WindowRefusal::NoBase => Self::NoBase,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seal::MissionKey;
    use std::sync::Arc;

    fn carry(from: &mut LinkPair<u64>, to: &mut LinkPair<u64>, content: u64, kind: FrameKind) -> Vec<(u64, bool)> {
        let builder = from.begin_frame(64, 20, Some(4), None, kind);
        let bytes = from.finish_frame(builder, content, kind, true);
        let us = to.us;
        let envelope = Envelope::decode(&bytes, |a| a == us).unwrap();
        let inbound = to.handle_frame(&envelope, |_, _| true).unwrap();
        inbound.fates
    }

    #[test]
    fn tags_verify_across_every_wrap_of_the_frame_counter() {
        let key = Arc::new(MissionKey::from_bytes([9; 16]));
        let authenticity = Some(Authenticity { key, all: true, encrypt: true });
        let auv = Address::vehicle(3).unwrap();
        let introduction = Introduction { series: Some(Series::from_random(1)), ..Introduction::default() };
        let mut surface = LinkPair::new(MissionId(1), Address::SURFACE, auv, authenticity.clone(), introduction, 1);
        let mut vehicle = LinkPair::new(MissionId(1), auv, Address::SURFACE, authenticity, introduction, 2);
        carry(&mut surface, &mut vehicle, 0, FrameKind::Hello);
        carry(&mut vehicle, &mut surface, 0, FrameKind::Hello);
        carry(&mut surface, &mut vehicle, 0, FrameKind::Numbered);
        let mut delivered = 0;
        for i in 0..140_000 {
            carry(&mut vehicle, &mut surface, i, FrameKind::Numbered);
            if i % 500 == 0 {
                for (content, held) in carry(&mut surface, &mut vehicle, 0, FrameKind::Numbered) {
                    assert!(held && content == delivered);
                    delivered += 1;
                }
            }
        }
        assert!(delivered > 139_000, "{delivered}");
    }
}
