//! Discovery calls, by which the surface looks for unknown vehicles.

use crate::link::run::{Authenticity, Generation, Identities, Identity};
use crate::link::{Transmit, TransmitKind};
use crate::mac::{ModemProfile, quarter_seconds};
use crate::time::Instant;
use crate::wire::{Address, Envelope, FrameBuilder, Header, MissionId, Seal};
use std::time::Duration;

/// Transmits a discovery call from time to time. Each vehicle that is not in contact answers at a random time.
#[derive(Debug)]
pub(super) struct Discovery {
    /// The longest time between two calls; `None` disables them.
    every: Option<Duration>,
    pause: Duration,
    next: Instant,
    open: Option<(Identity, Instant)>,
    /// The longest one-way propagation time.
    reach: Duration,
    identities: Identities,
    /// The generation of the key of the next call.
    generation: Generation,
}

impl Discovery {
    /// Pause before the second call while no vehicle is known.
    const FIRST_PAUSE: Duration = Duration::from_secs(5);
    /// The time from which called vehicles choose when to answer.
    const ANSWERS: Duration = Duration::from_secs(2);

    pub(super) fn new(
        every: Option<Duration>,
        anybody_known: bool,
        reach: Duration,
        identities: Identities,
        now: Instant,
    ) -> Self {
        let pause = if anybody_known { every.unwrap_or_default() } else { Self::FIRST_PAUSE };
        let next = if anybody_known { now + pause } else { now };
        Self { every, pause, next, open: None, reach, identities, generation: Generation::Present }
    }

    /// When the next call is due, or when the time for answers ends.
    pub(super) fn next_wakeup(&self, now: Instant) -> Option<Instant> {
        self.every?;
        Some(self.listens_until(now).unwrap_or(self.next))
    }

    /// The end of the time in which the medium is left to answers.
    pub(super) fn listens_until(&self, now: Instant) -> Option<Instant> {
        self.open.map(|(_, until)| until).filter(|&until| now < until)
    }

    pub(super) fn is_due(&self, now: Instant) -> bool {
        self.every.is_some() && now >= self.next && self.listens_until(now).is_none()
    }

    /// Moves the next call to `at`, because the budget does not allow it before.
    pub(super) fn postpone(&mut self, at: Instant) {
        self.next = self.next.max(at);
    }

    /// The frame of a call, with which the time for answers begins.
    pub(super) fn write(
        &mut self,
        mission: MissionId,
        modem: &ModemProfile,
        authenticity: Option<&Authenticity>,
        now: Instant,
    ) -> Transmit {
        let own = self.identities.draw();
        let header = Header {
            turn: Some(quarter_seconds(Self::ANSWERS, 255)),
            nonce: authenticity.map(|_| own.nonce),
            keyed: authenticity.is_some(),
            ..Header::hello(Address::SURFACE, Address::EVERYBODY, own.session)
        };
        let builder = FrameBuilder::new(&header, modem.frame_bytes);
        let calls = authenticity.and_then(|a| a.calls(self.generation).or_else(|| a.calls(Generation::Present)));
        // Each vehicle holds one of the two keys, or both.
        self.generation = self.generation.other();
        let bytes = match calls {
            Some(key) => builder.finish(&Seal::Hello(&key, mission, 0, 0), true),
            None => builder.finish(&Seal::Crc(mission, 0), true),
        };
        let answers = (self.reach + modem.turn_around) * 2 + Self::ANSWERS + modem.airtime(bytes.len()) * 2;
        let until = now + answers;
        self.open = Some((own, until));
        self.next = until + self.pause;
        self.pause = (self.pause * 2).min(self.every.unwrap_or_default()).max(Self::FIRST_PAUSE);
        Transmit { to: Address::EVERYBODY, bytes, kind: TransmitKind::DiscoveryCall }
    }

    /// Whether a hello answers the last call.
    pub(super) fn is_answered_by(
        &self,
        envelope: &Envelope<'_>,
        mission: MissionId,
        authenticity: Option<&Authenticity>,
        now: Instant,
    ) -> bool {
        let Some((call, until)) = self.open.filter(|_| envelope.header.kind().is_hello()) else { return false };
        let session = call.session.get();
        let sound = match authenticity {
            Some(a) => a.link(envelope.header.from).open_hello(envelope, mission, session, call.nonce).is_some(),
            None => envelope.open(&Seal::Crc(mission, session)).is_some(),
        };
        sound && now < until + Duration::from_secs(10)
    }

    /// The length of a call in bytes.
    pub(super) const fn bytes(keyed: bool) -> usize {
        if keyed { 9 + 8 + 8 } else { 9 + 3 }
    }
}
