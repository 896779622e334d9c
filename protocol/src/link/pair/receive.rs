//! Received frames of one peer: hellos, numbered frames, and the reason for which a frame is dropped.

use super::{HOLDER_SILENCE, LinkPair, Strays};
use crate::link::handshake::HandshakeOutcome;
use crate::link::mismatch::Mismatch;
use crate::link::run::{Generation, Identity, LinkRun};
use crate::link::{DropReason, FrameNumber, WindowRefusal};
use crate::seal::Direction;
use crate::wire::{Address, ChunkKind, Chunks, Envelope, Frame, FrameKind, Header, Introduction, Seal, WIRE_VERSION};

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
    /// The introduction of a hello that offers no run: at the vehicle that of a surface which it refuses, at the surface that
    /// of a vehicle which refuses us.
    pub refusal: Option<Introduction>,
    frame: Frame<'a>,
}

impl<'a, T> Inbound<'a, T> {
    /// A frame of which only the header counts.
    fn empty(restarted: bool, frame: Frame<'a>) -> Self {
        let (fates, base, lacks_base, refusal) = (Vec::new(), 0, false, None);
        Self { restarted, fates, number: None, is_latest: true, base, lacks_base, refusal, frame }
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

impl<T> LinkPair<T> {
    /// Opens a frame of this peer. `decodes` tells whether the chunks of a frame with this base decode, or, without a base,
    /// those of the first frame of a run. A frame with a chunk that does not decode changes nothing. The error is the reason for
    /// which the frame was dropped and counted.
    pub fn handle_frame<'a>(
        &mut self,
        envelope: &Envelope<'a>,
        decodes: impl Fn(Option<FrameNumber>, Chunks<'_>) -> bool,
    ) -> Result<Inbound<'a, T>, DropReason> {
        self.note_called();
        let result = match envelope.header.kind() {
            FrameKind::Hello => self.read_hello(envelope),
            FrameKind::Numbered => self.read_numbered(envelope, decodes),
        };
        if result.is_ok() {
            self.rotation.handle_heard();
        }
        if let Err(reason) = &result {
            self.stats.drop(*reason);
        }
        result
    }

    fn read_hello<'a>(&mut self, envelope: &Envelope<'a>) -> Result<Inbound<'a, T>, DropReason> {
        let header = &envelope.header;
        let own = if self.us == Address::SURFACE { Some(self.handshake.own()) } else { None };
        let (session, nonce) = own.map_or((0, 0), |o| (o.session.get(), o.nonce));
        if own.is_some() && envelope.is_complaint(session) {
            self.mismatch.note(Mismatch::Unverified);
            return Err(DropReason::Checksum);
        }
        let opened = match &self.authenticity {
            Some(a) => a.open_hello(envelope, self.mission, session, nonce),
            None => envelope.open(&Seal::Crc(self.mission, session)).map(|frame| (Generation::Present, frame)),
        };
        let Some((generation, frame)) = opened else { return Err(self.refuse(envelope, session)) };
        self.mismatch.handle_true_hello();
        let introduction = if envelope.version == WIRE_VERSION {
            let introduction = introduction_of(&frame).filter(|i| own.is_some() || i.series.is_some());
            Some(introduction.ok_or(DropReason::Malformed)?)
        } else {
            self.mismatch.note(Mismatch::Version(envelope.version));
            if own.is_some() {
                return Err(DropReason::Version);
            }
            // The answer to it names our version.
            None
        };
        if own.is_some() {
            self.note_introduction(introduction);
            self.rotation.handle_voice(generation);
        }
        let session = header.session.ok_or(DropReason::Malformed)?;
        let peer = Identity { session, nonce: header.nonce.unwrap_or_default() };
        let refusal = introduction.filter(|caller| match own {
            Some(_) => caller.refuses,
            None => self.refuses(caller),
        });
        if refusal.is_some() {
            if own.is_none() {
                (self.callers.refused, self.owes_hello) = (Some((peer, generation)), true);
            }
            return Ok(Inbound { refusal, ..Inbound::empty(false, frame) });
        }
        let key = self.run_key(generation);
        let outcome = match own {
            Some(_) => self.handshake.handle_answer(peer, introduction.unwrap_or_default(), key),
            None => {
                // Without a key, a forged frame may have ended the run. If the hello is old indeed, it has no effect: no frame
                // of that run is sealed to the run that it is offered.
                let may_be_forged = self.authenticity.is_none();
                let accepts_ended = may_be_forged && self.callers.ended_hellos + 1 >= Self::ENDED_HELLOS;
                self.handshake.handle_call(peer, introduction, accepts_ended, may_be_forged, key)
            }
        };
        if outcome == HandshakeOutcome::Retired {
            self.callers.ended_hellos += 1;
            let other = introduction.filter(|caller| own.is_none() && self.handshake.other_holder(caller).is_some());
            if other.is_some() && self.authenticity.is_some() {
                // It takes over, in a run that has ended here: it learns that, and begins another one.
                (self.callers.refused, self.owes_hello) = (Some((peer, generation)), true);
                return Ok(Inbound { refusal: other, ..Inbound::empty(false, frame) });
            }
            self.callers.retired = other;
            // Where frames of the vehicle have no tag, a forged one may have proven a false run.
            self.strays.count += u32::from(own.is_some() && !self.is_keyed(self.direction_in()));
            return Err(DropReason::OldSession);
        }
        if own.is_none() {
            // A caller that is refused, or of an ended run, says nothing about the surface that holds the vehicle.
            self.note_introduction(introduction);
        }
        self.callers.ended_hellos = 0;
        let is_new = outcome == HandshakeOutcome::New;
        // Without a key, a surface that knows a forged run of the vehicle hears nothing but that: it learns the true one again.
        self.callers.known_hellos += u32::from(!is_new && own.is_none() && self.authenticity.is_none());
        let names_run = self.callers.known_hellos >= Self::KNOWN_HELLOS;
        if names_run {
            self.callers.known_hellos = 0;
            self.handshake.withdraw_offer();
        }
        self.owes_hello = own.is_none() && (is_new || names_run);
        let restarted = is_new && own.is_some();
        self.stats.peer_restarts += u64::from(restarted);
        if restarted || own.is_none() {
            self.strays = Strays::default();
        }
        Ok(Inbound::empty(restarted, frame))
    }

    fn read_numbered<'a>(
        &mut self,
        envelope: &Envelope<'a>,
        decodes: impl Fn(Option<FrameNumber>, Chunks<'_>) -> bool,
    ) -> Result<Inbound<'a, T>, DropReason> {
        let (mission, direction) = (self.mission, self.direction_in());
        let keyed = self.is_keyed(direction);
        let (offer, offered) = self.handshake.open_offered(envelope, mission, direction, keyed).unzip();
        let restarted = offered.is_some();
        let known = || self.handshake.run().and_then(|r| r.open(envelope, mission, direction, keyed));
        let Some(frame) = offered.or_else(known) else {
            // A frame of a run that a late hello has ended here has a valid seal.
            let is_sign = keyed == envelope.header.keyed && self.is_of_ended_run(envelope, direction, keyed);
            self.strays.count += u32::from(is_sign);
            self.strays.of_ended_run |= is_sign;
            return Err(if is_sign { DropReason::OldSession } else { self.refuse(envelope, 0) });
        };
        if !frame.chunks().are_sound() {
            return Err(DropReason::Malformed);
        }
        let is_decoded = if restarted { decodes(None, frame.chunks()) } else { self.decodes(&frame, decodes) };
        if !is_decoded {
            return Err(DropReason::Undecodable);
        }
        self.mismatch.handle_accepted();
        (self.callers.ended_hellos, self.callers.known_hellos) = (0, 0);
        if let Some(index) = offer {
            self.handshake.accept_offered(index);
            if self.us != Address::SURFACE {
                self.handle_proven_key();
            }
            self.stats.peer_restarts += 1;
        }
        // Another surface waits for the hello that it is owed, whatever the one that holds the vehicle sends meanwhile.
        let calling = self.handshake.offered().is_some_and(|r| self.handshake.other_holder(&r.introduction).is_some());
        self.owes_hello &= self.us != Address::SURFACE && (self.callers.refused.is_some() || calling);
        self.owes_hello |= self.handshake.is_leaving();
        if self.handshake.is_leaving() {
            self.strays = Strays::default();
            return Ok(Inbound::empty(restarted, frame));
        }
        let inbound = match self.take(frame, restarted) {
            Ok(inbound) => inbound,
            Err(reason) => {
                // Without a tag, a forged frame may have a number so high that all true ones come late.
                self.strays.count += u32::from(reason == DropReason::Late && !keyed);
                return Err(reason);
            }
        };
        self.strays = Strays::default();
        if self.us == Address::SURFACE && inbound.number.is_some() {
            self.handshake.handle_current();
        }
        Ok(inbound)
    }

    fn note_introduction(&mut self, peer: Option<Introduction>) {
        let own = &self.introduction;
        peer.iter().for_each(|peer| self.mismatch.note_introduction(peer, own));
    }

    /// At the vehicle: whether another surface holds it against this caller. Without a key, everybody could.
    fn refuses(&self, caller: &Introduction) -> bool {
        let is_held = self.callers.silence.is_some_and(|silence| silence < HOLDER_SILENCE);
        is_held && !caller.takes_over && self.is_authentic() && self.handshake.other_holder(caller).is_some()
    }

    /// Whether a run of the peer that has ended sent this frame, by a valid seal. A surface that has lost the vehicle to
    /// another one learns it from the next hello.
    fn is_of_ended_run(&mut self, envelope: &Envelope<'_>, direction: Direction, keyed: bool) -> bool {
        let own = self.handshake.own();
        let ended = self.handshake.ended_sender(envelope, self.mission, direction, keyed);
        // Without a key, a frame to an earlier run of ours may be of before.
        let ended = ended.filter(|ended| keyed || ended.own == own);
        let sender = ended.map(|ended| (ended.identity, ended.introduction));
        if let Some((identity, introduction)) = sender
            && self.us != Address::SURFACE
            && self.handshake.other_holder(&introduction).is_some()
        {
            let generation = self.handshake.run().map_or(Generation::Present, |run| run.generation);
            (self.callers.refused, self.owes_hello) = (Some((identity, generation)), true);
        }
        sender.is_some()
    }

    /// Whether the chunks of a frame decode, if the window would accept it.
    fn decodes(&self, frame: &Frame<'_>, decodes: impl Fn(Option<FrameNumber>, Chunks<'_>) -> bool) -> bool {
        let Some(run) = self.handshake.run() else { return true };
        match run.window.preview(frame.number, frame.header.base) {
            Ok(base) => decodes(Some(base), frame.chunks()),
            Err(_) => true,
        }
    }

    fn take<'a>(&mut self, frame: Frame<'a>, restarted: bool) -> Result<Inbound<'a, T>, DropReason> {
        let header = &frame.header;
        let Some(run) = self.handshake.run_mut() else { return Err(DropReason::UnknownSender) };
        let before = run.window.highest();
        let verdict = run.window.accept(frame.number, header.base);
        let accepted = verdict.is_ok().then_some(frame.number);
        let fates = header.ack.as_ref().map_or_else(Vec::new, |ack| run.flight.handle_statement(ack, accepted));
        for (_, delivered) in &fates {
            self.stats.judge(*delivered);
        }
        // A rejected frame has still reported fates of ours, so these are returned with it.
        let mut lacks_base = false;
        let number = match verdict {
            Ok(()) => {
                self.stats.take(before, frame.number);
                Some(frame.number)
            }
            Err(refusal) if fates.is_empty() && !restarted => return Err(refusal.into()),
            Err(refusal) => {
                lacks_base = refusal == WindowRefusal::NoBase;
                self.stats.drop(refusal.into());
                None
            }
        };
        let is_latest = number.is_some_and(|n| n > before);
        let base = run.window.base();
        Ok(Inbound { restarted, fates, number, is_latest, base, lacks_base, refusal: None, frame })
    }

    /// The most likely reason why a frame does not open; `session` is ours in a hello.
    fn refuse(&mut self, envelope: &Envelope<'_>, session: u16) -> DropReason {
        let is_hello = envelope.header.kind().is_hello();
        let expected = if is_hello { self.authenticity.is_some() } else { self.is_keyed(self.direction_in()) };
        match (expected, envelope.header.keyed) {
            (false, true) => {
                self.mismatch.note(Mismatch::Tag);
                DropReason::Keyed
            }
            (true, false) if self.is_plain(envelope, session) => {
                self.mismatch.note(Mismatch::NoTag);
                DropReason::Unauthenticated
            }
            _ => {
                // At the surface, hellos of the vehicle to another surface do not verify.
                match (envelope.header.session, self.us == Address::SURFACE) {
                    (Some(session), false) => self.mismatch.note_untrue_hello(session),
                    (None, true) => self.mismatch.note_foreign(),
                    _ => {}
                }
                DropReason::Checksum
            }
        }
    }

    /// Whether a frame has a CRC that is right, where a tag is expected.
    fn is_plain(&self, envelope: &Envelope<'_>, session: u16) -> bool {
        let opens = |run: &LinkRun<T>| run.open(envelope, self.mission, self.direction_in(), false).is_some();
        match envelope.header.kind() {
            FrameKind::Hello => envelope.open(&Seal::Crc(self.mission, session)).is_some(),
            FrameKind::Numbered => self.handshake.run().into_iter().chain(self.handshake.offered()).any(opens),
        }
    }
}

/// The introduction in a hello.
fn introduction_of(frame: &Frame<'_>) -> Option<Introduction> {
    let chunk = frame.chunks().find(|chunk| chunk.kind == ChunkKind::Introduction)?;
    Introduction::decode(chunk.payload).ok()
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
