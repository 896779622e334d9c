//! The state of one end toward one peer.

mod receive;
mod rotation;

pub use receive::Inbound;
use rotation::KeyRotation;

use super::handshake::{FramePurpose, Handshake};
use super::mismatch::{Mismatch, MismatchReport};
use super::run::{Authenticity, Generation, Identities, Identity, LinkAuthenticity, RunKey};
use super::{FrameNumber, LinkStats, LinkWindow};
use crate::directive::Series;
use crate::seal::{Direction, TAG_BYTES};
use crate::time::Instant;
use crate::wire::{
    Address, ChunkKind, FrameBuilder, FrameKind, Header, Introduction, MissionId, Seal, SessionId, Stamp, UtcHours,
    room_for_payload,
};
use std::time::Duration;

/// A surface keeps a vehicle against others until it was silent for this long.
pub const HOLDER_SILENCE: Duration = Duration::from_secs(120);

/// Refused frames since the last accepted one that are a sign of other runs.
#[derive(Debug, Default)]
struct Strays {
    count: u32,
    /// Whether one of them was sent in a run that has ended here.
    of_ended_run: bool,
}

/// At the vehicle: the surfaces that call it.
#[derive(Debug, Default)]
struct Callers {
    /// Hellos of ended runs of the surface since the last frame that was accepted.
    ended_hellos: u32,
    /// Hellos of the surface's current run since the last frame that was accepted, or the last answer that names the vehicle's.
    known_hellos: u32,
    /// How long the surface that holds the vehicle was silent; `None` if it was never heard.
    silence: Option<Duration>,
    /// The run of a surface that the next hello refuses, and the generation of the key by which it called.
    refused: Option<(Identity, Generation)>,
    /// Without a key: another surface that has just called in a run that has ended here.
    retired: Option<Introduction>,
}

/// Where the acknowledgement of a frame may stand.
#[derive(Debug, Clone, Copy)]
pub struct AckRoom {
    /// The most bytes of a statement.
    pub bytes: usize,
    /// At the vehicle: whether the turn byte may have it instead; the frame has one, or gets one if it proves to be the last of its turn.
    pub in_turn: bool,
}

/// Handshake, flight, window and counters toward one peer. `T` is the content of a sent frame.
#[derive(Debug)]
pub struct LinkPair<T> {
    mission: MissionId,
    us: Address,
    peer: Address,
    authenticity: Option<LinkAuthenticity>,
    /// The introduction in the hellos of this end.
    introduction: Introduction,
    handshake: Handshake<T>,
    mismatch: MismatchReport,
    /// At the vehicle: the next frame is a hello, although there is a run.
    owes_hello: bool,
    strays: Strays,
    callers: Callers,
    rotation: KeyRotation,
    /// Counters and estimates of this link.
    pub stats: LinkStats,
}

impl<T> LinkPair<T> {
    /// Strays after which the two ends are taken to have lost each other's runs.
    const STRAYS: u32 = 3;
    /// Hellos of an ended run, with no accepted frame between them, after which a forged frame seems to have ended it.
    const ENDED_HELLOS: u32 = 2;
    /// After so many hellos of the current run, with no accepted frame between them, the vehicle names its own run: the surface
    /// may take a forged one for it.
    const KNOWN_HELLOS: u32 = 3;

    /// A pair without contact; `seed` must be random for each start of the program.
    pub fn new(
        mission: MissionId,
        us: Address,
        peer: Address,
        authenticity: Option<Authenticity>,
        introduction: Introduction,
        seed: u64,
    ) -> Self {
        let encrypts = authenticity.as_ref().is_some_and(|a| a.encrypt);
        let tags_all = authenticity.as_ref().is_some_and(|a| a.all);
        let authenticity = authenticity.map(|a| a.link(if us == Address::SURFACE { peer } else { us }));
        let handshake = Handshake::new(Identities::new(seed, authenticity.as_ref().map(|a| a.key.link().clone())));
        let (mismatch, stats) = (MismatchReport::default(), LinkStats::default());
        Self {
            mission,
            us,
            peer,
            authenticity,
            introduction: Introduction { encrypts, tags_all, ..introduction },
            handshake,
            mismatch,
            owes_hello: false,
            strays: Strays::default(),
            callers: Callers::default(),
            rotation: KeyRotation::default(),
            stats,
        }
    }

    /// The introduction of the peer's current run.
    pub fn peer_introduction(&self) -> Option<&Introduction> {
        self.handshake.run().map(|r| &r.introduction)
    }

    /// Names another series in the hellos of this end; returns whether it is another one.
    pub fn set_series(&mut self, series: Series) -> bool {
        self.introduction.series.replace(series) != Some(series)
    }

    /// Sets the clock in later hellos of this end, with which those of the peer are compared.
    pub fn set_clock(&mut self, clock: UtcHours) {
        if let Some(before) = self.introduction.clock.replace(clock) {
            self.mismatch.handle_clock(before, clock);
        }
    }

    /// At the vehicle: sets how long the surface that holds it was silent.
    pub fn set_silence(&mut self, silence: Option<Duration>) {
        self.callers.silence = silence;
    }

    /// At the vehicle: the session of the surface that the next hello refuses.
    pub fn refused_session(&self) -> Option<SessionId> {
        self.callers.refused.map(|(run, _)| run.session)
    }

    /// At the vehicle, without a key: another surface than the one that holds it, which has just called in a run that has ended here.
    pub fn poll_retired_caller(&mut self) -> Option<Introduction> {
        self.callers.retired.take()
    }

    /// At the vehicle: the introduction of later hellos says that it has no memory of orders, or that it has.
    pub fn set_memory(&mut self, has_memory: bool) {
        self.introduction.has_no_memory = !has_memory;
    }

    /// At the vehicle: the introduction of the surface that the next hello answers.
    pub fn caller(&self) -> Option<&Introduction> {
        self.handshake.offered().or(self.handshake.run()).map(|run| &run.introduction)
    }

    /// At the surface: the introduction of later hellos has the vehicle leave another surface, or not.
    pub fn set_takes_over(&mut self, takes_over: bool) {
        self.introduction.takes_over = takes_over;
    }

    /// At the surface: whether hellos have the vehicle leave another surface.
    pub fn takes_over(&self) -> bool {
        self.introduction.takes_over
    }

    /// The keys of the link.
    pub(super) fn authenticity(&self) -> Option<&LinkAuthenticity> {
        self.authenticity.as_ref()
    }

    /// Whether orders are authenticated: this end has a key.
    pub fn is_authentic(&self) -> bool {
        self.authenticity.is_some()
    }

    /// A setting in which the peer differs: until a frame of it is accepted, or with accepted frames that are longer than ours.
    pub fn mismatch(&self) -> Option<Mismatch> {
        self.mismatch.current()
    }

    /// A frame of the peer of so many bytes was accepted; those of this end have `own`.
    pub fn note_length(&mut self, bytes: usize, own: usize) {
        self.mismatch.note_length(bytes, own);
    }

    /// At a vehicle: a frame of the surface to another vehicle is heard.
    pub fn note_call_of(&mut self, other: Address, now: Instant) {
        self.mismatch.note_call_of(other, now);
    }

    /// At a vehicle: a frame of the surface to this one, or to every vehicle, is heard.
    pub fn note_called(&mut self) {
        self.mismatch.handle_called();
    }

    /// A frame from our own address is heard, while we send none.
    pub fn note_own_address(&mut self) {
        self.mismatch.note_own_address();
    }

    /// A setting in which the peer differs, once after it was found.
    pub fn poll_mismatch(&mut self) -> Option<Mismatch> {
        self.mismatch.poll()
    }

    /// The address of the other end.
    pub fn peer(&self) -> Address {
        self.peer
    }

    /// Whether a frame names the peer's current run as its own.
    pub(super) fn is_of_current_run(&self, header: &Header) -> bool {
        self.handshake.run().is_some_and(|run| header.session == Some(run.peer.session))
    }

    /// Whether there is a current run of the peer.
    pub fn has_run(&self) -> bool {
        self.handshake.run().is_some() && !self.handshake.is_leaving()
    }

    /// Whether there is a run of the peer, or a hello of one.
    pub fn has_contact(&self) -> bool {
        self.handshake.run().is_some() || self.handshake.offered().is_some()
    }

    /// At the surface: whether the vehicle has offered another run than the current one, so that a proof is to be sent.
    pub fn has_offer(&self) -> bool {
        self.us == Address::SURFACE && self.handshake.provable().is_some()
    }

    /// Whether the hello of an offered run has come in since the last proof.
    pub fn owes_proof(&self) -> bool {
        self.handshake.owes_proof()
    }

    /// The number of proofs that were written in all offered runs.
    pub fn proofs(&self) -> u64 {
        self.handshake.proofs()
    }

    /// Whether a numbered frame has shown that the peer uses the current run.
    pub fn is_proven(&self) -> bool {
        self.highest() > 0
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
        self.strays.count >= Self::STRAYS
    }

    /// Whether a frame has come in since the last accepted one that the peer has sent in a run that has ended here.
    pub(super) fn hears_ended_run(&self) -> bool {
        self.strays.of_ended_run
    }

    /// The number of frames since the last accepted one that are a sign of other runs.
    pub(super) fn strays(&self) -> u32 {
        self.strays.count
    }

    /// The highest frame number received, 0 before the first.
    pub fn highest(&self) -> FrameNumber {
        self.handshake.run().map_or(0, |r| r.window.highest())
    }

    /// Received frames that no acknowledgement statement of ours covers yet.
    pub fn unstated(&self) -> u64 {
        self.handshake.run().map_or(0, |r| r.window.unstated())
    }

    /// Whether no frame shows yet that the peer has received our last acknowledgement statement.
    pub fn is_unconfirmed(&self) -> bool {
        self.handshake.run().is_some_and(|r| r.window.is_unconfirmed())
    }

    /// Bytes of the acknowledgement statement on all received frames.
    pub fn statement_bytes(&self) -> usize {
        self.handshake.run().map_or(0, |r| r.window.statement_bytes())
    }

    /// At the vehicle: whether a turn byte has room for the acknowledgement statement on all received frames.
    pub fn fits_turn_byte(&self) -> bool {
        self.handshake.run().is_none_or(|r| r.window.fits_turn_byte())
    }

    /// The bytes of the seal of our numbered frames.
    pub fn seal_bytes(&self) -> usize {
        Seal::bytes(self.is_keyed(self.direction_out()), FrameKind::Numbered)
    }

    /// The most bytes of a hello of ours.
    pub fn hello_bytes(&self) -> usize {
        const HEADER_AND_TURN: usize = 9;
        const CHUNK_HEAD: usize = 2;
        let seal = if self.authenticity.is_some() { 8 + TAG_BYTES } else { Seal::bytes(false, FrameKind::Hello) };
        HEADER_AND_TURN + CHUNK_HEAD + self.introduction.encode(Introduction::MAX_BYTES).len() + seal
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

    /// Whether the next frame must be a hello.
    pub fn must_send_hello(&self) -> bool {
        self.owes_hello || self.handshake.run().is_none()
    }

    /// At the vehicle: sends the hello of an offered run again.
    pub fn repeat_hello(&mut self) {
        self.owes_hello |= self.handshake.offered().is_some();
    }

    /// At the vehicle: leaves the last hello of the surface without an answer.
    pub fn withhold_hello(&mut self) {
        self.owes_hello = self.handshake.is_leaving();
        self.callers.refused = None;
    }

    /// The introduction in the next hello: at a vehicle that refuses a surface, it names the one that holds it.
    fn next_introduction(&self) -> Introduction {
        let holder = self.handshake.run().map(|run| run.introduction).filter(|_| self.callers.refused.is_some());
        match holder {
            Some(Introduction { series, name, .. }) => {
                let silence_s = self.callers.silence.map_or(248, |silence| silence.as_secs().min(248) as u8);
                Introduction { series, name, refuses: true, silence_s, ..self.introduction }
            }
            None => self.introduction,
        }
    }

    /// Starts the next frame, with acknowledgement as far as there is room for it. It becomes a hello if `purpose` demands it
    /// or the handshake is not complete.
    pub fn begin_frame(
        &mut self,
        size: usize,
        room: AckRoom,
        turn: Option<u8>,
        stamp: Option<Stamp>,
        purpose: FramePurpose,
    ) -> FrameBuilder {
        let hello = purpose.is_hello() || self.must_send_hello();
        let offered = self.handshake.offered().filter(|_| hello && self.callers.refused.is_none());
        let own = offered.map_or(self.handshake.own(), |r| r.own);
        let direction = self.direction_out();
        let keyed = if hello { self.authenticity.is_some() } else { self.is_keyed(direction) };
        let run = self.handshake.run_for(purpose).filter(|_| !hello);
        let (number, base) = run.as_ref().map_or((0, 1), |r| (r.flight.next_number(), r.flight.base_distance()));
        let header = Header {
            session: hello.then_some(own.session),
            turn,
            stamp,
            nonce: (hello && keyed).then_some(own.nonce),
            ack: run.and_then(|r| r.window.statement(room.bytes, room.in_turn)),
            keyed,
            ..Header::numbered(self.us, self.peer, number, base)
        };
        let mut builder = FrameBuilder::new(&header, size);
        if hello {
            const EXTENDED: usize = 1;
            let room = room_for_payload(builder.room()).saturating_sub(EXTENDED);
            builder.push(ChunkKind::Introduction, &self.next_introduction().encode(room));
        }
        builder
    }

    /// Closes a frame and keeps its content until its fate is known.
    pub fn finish_frame(&mut self, builder: FrameBuilder, carried: T, purpose: FramePurpose, short: bool) -> Vec<u8> {
        self.stats.frames_sent += 1;
        let direction = self.direction_out();
        if purpose.is_hello() || self.must_send_hello() {
            // The current run may be in use still: the hello of the surface may be a replay.
            self.owes_hello &= self.handshake.is_leaving();
            let is_surface = self.us == Address::SURFACE;
            let named = self.handshake.offered().or(self.handshake.run()).filter(|_| !is_surface);
            let to = self.callers.refused.take().or(named.map(|r| (r.peer, r.generation)));
            let (session, nonce) = to.map_or((0, 0), |(p, _)| (p.session.get(), p.nonce));
            let generation = if is_surface { self.next_voice() } else { to.map(|(_, used)| used).unwrap_or_default() };
            return match &self.authenticity {
                Some(a) => builder.finish(&Seal::Hello(a.key(generation), self.mission, session, nonce), short),
                None => builder.finish(&Seal::Crc(self.mission, session), short),
            };
        }
        let (mission, keyed) = (self.mission, self.is_keyed(direction));
        let Some(run) = self.handshake.run_for(purpose) else { return Vec::new() };
        let number = run.flight.next_number();
        run.flight.push(carried);
        let bytes = builder.finish(&run.seal(mission, direction, keyed, number), short);
        if purpose == FramePurpose::Proof {
            self.handshake.note_proof();
        }
        bytes
    }

    /// Begins a new run toward the peer, because the states of the two ends do not agree.
    pub fn renew(&mut self) {
        self.stats.resyncs += 1;
        self.strays = Strays::default();
        if self.us == Address::SURFACE {
            self.handshake.renew_surface();
        } else {
            let generation = self.handshake.run().map_or(Generation::Present, |run| run.generation);
            self.offer_run(generation);
        }
    }

    /// At the vehicle: offers the surface a new run under this key.
    fn offer_run(&mut self, generation: Generation) {
        let key = self.run_key(generation);
        self.handshake.renew_vehicle(key);
        self.owes_hello = self.handshake.is_leaving();
    }

    /// Derives the key of a run of ours with a run of the peer.
    fn run_key(&self, generation: Generation) -> impl Fn(Identity, Identity) -> RunKey + use<T> {
        let (authenticity, mission, us, peer) = (self.authenticity.clone(), self.mission, self.us, self.peer);
        move |own, other| {
            let (surface, vehicle) = if us == Address::SURFACE { (own, other) } else { (other, own) };
            let number = if us == Address::SURFACE { peer.number() } else { us.number() };
            let session = authenticity
                .as_ref()
                .map(|a| a.key(generation).session(mission.0, number, surface.nonce, vehicle.nonce, a.encrypt));
            RunKey { session, generation }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::DropReason;
    use crate::seal::{HeldKey, MissionKey};
    use crate::wire::Envelope;

    fn introduction() -> Introduction {
        Introduction { series: Some(Series::from_random(1)), ..Introduction::default() }
    }

    fn keyed(encrypt: bool) -> Option<Authenticity> {
        Some(Authenticity::new(HeldKey::Mission(MissionKey::from_bytes([9; 16])), true, encrypt))
    }

    const ROOM: AckRoom = AckRoom { bytes: 20, in_turn: false };

    fn end_of_surface(authenticity: Option<Authenticity>, seed: u64) -> LinkPair<u64> {
        let auv = Address::vehicle(3).unwrap();
        LinkPair::new(MissionId(1), Address::SURFACE, auv, authenticity, introduction(), seed)
    }

    fn end_of_vehicle(authenticity: Option<Authenticity>, seed: u64) -> LinkPair<u64> {
        let auv = Address::vehicle(3).unwrap();
        LinkPair::new(MissionId(1), auv, Address::SURFACE, authenticity, introduction(), seed)
    }

    fn carry(
        from: &mut LinkPair<u64>,
        to: &mut LinkPair<u64>,
        content: u64,
        purpose: FramePurpose,
    ) -> Vec<(u64, bool)> {
        let builder = from.begin_frame(64, ROOM, Some(4), None, purpose);
        let bytes = from.finish_frame(builder, content, purpose, true);
        let us = to.us;
        let envelope = Envelope::decode(&bytes, |a| a == us).unwrap();
        let inbound = to.handle_frame(&envelope, |_, _| true).unwrap();
        inbound.fates
    }

    #[test]
    fn tags_verify_across_every_wrap_of_the_frame_counter() {
        let (mut surface, mut vehicle) = (end_of_surface(keyed(true), 1), end_of_vehicle(keyed(true), 2));
        carry(&mut surface, &mut vehicle, 0, FramePurpose::Hello);
        carry(&mut vehicle, &mut surface, 0, FramePurpose::Hello);
        carry(&mut surface, &mut vehicle, 0, FramePurpose::Content);
        let mut delivered = 0;
        for i in 0..140_000 {
            carry(&mut vehicle, &mut surface, i, FramePurpose::Content);
            if i % 500 == 0 {
                for (content, held) in carry(&mut surface, &mut vehicle, 0, FramePurpose::Content) {
                    assert!(held && content == delivered);
                    delivered += 1;
                }
            }
        }
        assert!(delivered > 139_000, "{delivered}");
    }

    /// Without a key, a stranger answers the surface's hello before the vehicle does, and acknowledges the vehicle's frames.
    #[test]
    fn a_vehicle_names_its_run_where_a_forged_one_stands() {
        let (mut surface, mut vehicle) = (end_of_surface(None, 1), end_of_vehicle(None, 2));
        // With the seed of the surface, a stranger has its runs.
        let (mut false_surface, mut false_vehicle) = (end_of_surface(None, 1), end_of_vehicle(None, 3));
        carry(&mut surface, &mut false_vehicle, 0, FramePurpose::Hello);
        carry(&mut false_vehicle, &mut surface, 0, FramePurpose::Hello);
        carry(&mut false_surface, &mut vehicle, 0, FramePurpose::Hello);
        carry(&mut vehicle, &mut false_surface, 0, FramePurpose::Hello);
        carry(&mut false_surface, &mut vehicle, 0, FramePurpose::Content);
        carry(&mut vehicle, &mut false_surface, 0, FramePurpose::Content);
        assert_eq!(carry(&mut false_surface, &mut vehicle, 0, FramePurpose::Content).len(), 1);
        for _ in 0..LinkPair::<u64>::KNOWN_HELLOS {
            assert!(!vehicle.must_send_hello());
            carry(&mut surface, &mut vehicle, 0, FramePurpose::Hello);
        }
        assert!(vehicle.must_send_hello());
        carry(&mut vehicle, &mut surface, 0, FramePurpose::Hello);
        assert!(surface.has_offer());
        // The surface has never acknowledged what the vehicle builds on, so it begins a new run.
        let bytes = sent(&mut vehicle, FramePurpose::Content);
        let envelope = Envelope::decode(&bytes, |a| a == Address::SURFACE).unwrap();
        assert!(surface.handle_frame(&envelope, |_, _| true).unwrap().lacks_base);
    }

    fn sent(from: &mut LinkPair<u64>, purpose: FramePurpose) -> Vec<u8> {
        let builder = from.begin_frame(64, ROOM, None, None, purpose);
        from.finish_frame(builder, 0, purpose, true)
    }

    fn received(to: &mut LinkPair<u64>, bytes: &[u8]) -> Result<(), DropReason> {
        let us = to.us;
        let envelope = Envelope::decode(bytes, |a| a == us).unwrap();
        to.handle_frame(&envelope, |_, _| true).map(drop)
    }

    /// The handshake, and a numbered frame of each end; returns the hello of the surface.
    fn meet(surface: &mut LinkPair<u64>, vehicle: &mut LinkPair<u64>) -> Vec<u8> {
        let hello = sent(surface, FramePurpose::Hello);
        received(vehicle, &hello).unwrap();
        received(surface, &sent(vehicle, FramePurpose::Hello)).unwrap();
        received(vehicle, &sent(surface, FramePurpose::Content)).unwrap();
        received(surface, &sent(vehicle, FramePurpose::Content)).unwrap();
        hello
    }

    #[test]
    fn a_late_hello_does_not_displace_the_run_in_use() {
        let mut surface = end_of_surface(keyed(false), 1);
        let mut before = end_of_vehicle(keyed(false), 2);
        let replayed = sent(&mut end_of_surface(keyed(false), 4), FramePurpose::Hello);
        let hello = meet(&mut surface, &mut before);

        // The vehicle restarts. Its first answer comes late; a replayed hello makes it forget the run of that answer.
        let mut vehicle = end_of_vehicle(keyed(false), 3);
        received(&mut vehicle, &hello).unwrap();
        let late = sent(&mut vehicle, FramePurpose::Hello);
        received(&mut vehicle, &replayed).unwrap();
        received(&mut vehicle, &hello).unwrap();
        received(&mut surface, &sent(&mut vehicle, FramePurpose::Hello)).unwrap();
        received(&mut vehicle, &sent(&mut surface, FramePurpose::Proof)).unwrap();
        received(&mut surface, &late).unwrap();
        received(&mut surface, &sent(&mut vehicle, FramePurpose::Content)).unwrap();
        assert!(surface.is_proven() && surface.highest() == 1);
    }

    #[test]
    fn a_late_frame_of_the_former_run_does_not_end_the_taken_run() {
        let (mut surface, mut before) = (end_of_surface(keyed(false), 1), end_of_vehicle(keyed(false), 2));
        let hello = meet(&mut surface, &mut before);
        let late = sent(&mut before, FramePurpose::Content);

        // The vehicle restarts and takes the proof. A frame of its former run comes in before its first one.
        let mut vehicle = end_of_vehicle(keyed(false), 3);
        received(&mut vehicle, &hello).unwrap();
        received(&mut surface, &sent(&mut vehicle, FramePurpose::Hello)).unwrap();
        received(&mut vehicle, &sent(&mut surface, FramePurpose::Proof)).unwrap();
        received(&mut surface, &late).unwrap();
        received(&mut surface, &sent(&mut vehicle, FramePurpose::Content)).unwrap();
        assert!(surface.is_proven() && surface.highest() == 1);
        received(&mut vehicle, &sent(&mut surface, FramePurpose::Content)).unwrap();
    }

    #[test]
    fn a_late_frame_of_an_offered_run_does_not_end_a_later_offer() {
        let mut surface = end_of_surface(keyed(false), 1);
        let hello = sent(&mut surface, FramePurpose::Hello);
        let mut late = Vec::new();
        for (seed, purpose) in [(2, FramePurpose::Content), (3, FramePurpose::Proof), (4, FramePurpose::Proof)] {
            let mut vehicle = end_of_vehicle(keyed(false), seed);
            received(&mut vehicle, &hello).unwrap();
            received(&mut surface, &sent(&mut vehicle, FramePurpose::Hello)).unwrap();
            received(&mut vehicle, &sent(&mut surface, purpose)).unwrap();
            match seed {
                3 => late = sent(&mut vehicle, FramePurpose::Content),
                4 => received(&mut surface, &late).unwrap(),
                _ => {}
            }
            if seed != 3 {
                received(&mut surface, &sent(&mut vehicle, FramePurpose::Content)).unwrap();
                received(&mut vehicle, &sent(&mut surface, FramePurpose::Content)).unwrap();
            }
        }
    }

    #[test]
    fn an_acknowledgement_in_the_current_run_ends_earlier_offers() {
        let (mut surface, mut vehicle) = (end_of_surface(None, 1), end_of_vehicle(None, 2));
        let hello = sent(&mut surface, FramePurpose::Hello);
        received(&mut vehicle, &hello).unwrap();
        received(&mut surface, &sent(&mut vehicle, FramePurpose::Hello)).unwrap();
        received(&mut vehicle, &sent(&mut surface, FramePurpose::Content)).unwrap();
        let mut forger = end_of_vehicle(None, 3);
        received(&mut forger, &hello).unwrap();
        received(&mut surface, &sent(&mut forger, FramePurpose::Hello)).unwrap();
        received(&mut surface, &sent(&mut vehicle, FramePurpose::Content)).unwrap();
        assert!(surface.has_offer(), "the frame may have been sent before the offer");
        received(&mut vehicle, &sent(&mut surface, FramePurpose::Content)).unwrap();
        received(&mut surface, &sent(&mut vehicle, FramePurpose::Content)).unwrap();
        assert!(!surface.has_offer());
    }

    #[test]
    fn a_forged_hello_of_another_version_leaves_the_true_series() {
        for is_first in [true, false] {
            let (mut surface, mut vehicle) = (end_of_surface(None, 1), end_of_vehicle(None, 2));
            let hello = sent(&mut surface, FramePurpose::Hello);
            // Its first three bits are the version, and its last three bytes the CRC over mission, session and frame.
            let mut other = hello[..hello.len() - 3].to_vec();
            other[0] = 7 << 5 | other[0] & 31;
            let crc = crc::Crc::<u32>::new(&crc::CRC_24_OPENPGP);
            let sealed = [&MissionId(1).0.to_be_bytes()[..], &[0, 0], &other].concat();
            other.extend_from_slice(&crc.checksum(&sealed).to_be_bytes()[1..]);
            let mut hellos = [other, hello];
            if !is_first {
                hellos.reverse();
            }
            hellos.iter().for_each(|bytes| received(&mut vehicle, bytes).unwrap());
            received(&mut surface, &sent(&mut vehicle, FramePurpose::Hello)).unwrap();
            received(&mut vehicle, &sent(&mut surface, FramePurpose::Content)).unwrap();
            assert_eq!(vehicle.peer_introduction().unwrap().series, introduction().series);
        }
    }
}
