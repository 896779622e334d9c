//! How often the vehicle answers hellos, which may be replays, and when it answers a discovery call.

use super::VehicleConfig;
use crate::link::run::{Generation, LinkAuthenticity};
use crate::mac::{Access, Grant};
use crate::time::Instant;
use crate::wire::{Address, Envelope, FrameBuilder, Header, MissionId, Seal, SessionId};
use std::time::Duration;

/// A few answers at once, and one every three seconds in the long run.
#[derive(Debug)]
pub(super) struct HelloLimit {
    /// Answers that are allowed at once.
    left: u32,
    /// When the last one was added.
    since: Instant,
    /// When the last hello was admitted, and its sender's session.
    admitted: Option<(Instant, SessionId)>,
    /// How often a hello is still repeated while the surface does not use the offered run.
    repeats: u32,
    /// When it is repeated next.
    next_repeat: Option<Instant>,
    repeat_interval: Duration,
}

impl HelloLimit {
    const MAX_ANSWERS: u32 = 8;
    const INTERVAL: Duration = Duration::from_secs(3);
    /// Hellos of one session within this time are copies of one.
    const COPIES: Duration = Duration::from_millis(1500);
    const REPEATS: u32 = 3;
    const REPEAT_INTERVAL: Duration = Duration::from_secs(10);
    /// The same over a medium that carries both directions at once, beyond the time of copies.
    const FULL_DUPLEX_INTERVAL: Duration = Duration::from_secs(2);

    pub(super) fn new(access: Access, now: Instant) -> Self {
        let repeat_interval =
            if access == Access::FullDuplex { Self::FULL_DUPLEX_INTERVAL } else { Self::REPEAT_INTERVAL };
        Self { left: Self::MAX_ANSWERS, since: now, admitted: None, repeats: 0, next_repeat: None, repeat_interval }
    }

    /// Time after which an answer is repeated that the surface has not used.
    pub(super) fn repeat_interval(&self) -> Duration {
        self.repeat_interval
    }

    /// Whether a hello of a session that came in may be answered.
    pub(super) fn admit(&mut self, session: SessionId, now: Instant) -> bool {
        if self.admitted.is_some_and(|(at, of)| of == session && now.since(at) < Self::COPIES) {
            return false;
        }
        let added = now.since(self.since).as_secs() / Self::INTERVAL.as_secs();
        if added > 0 {
            self.left = u64::from(self.left).saturating_add(added).min(u64::from(Self::MAX_ANSWERS)) as u32;
            self.since = now;
        }
        let is_admitted = self.left > 0;
        if is_admitted {
            self.left -= 1;
            self.admitted = Some((now, session));
        }
        is_admitted
    }

    /// An admitted hello named another run than the current one: the answer is repeated.
    pub(super) fn handle_offer(&mut self) {
        self.repeats = Self::REPEATS;
    }

    /// An admitted hello named the current run: a repeated answer to another run must not displace its answer.
    pub(super) fn handle_known(&mut self, now: Instant) {
        self.next_repeat = self.next_repeat.map(|at| at.max(now + self.repeat_interval));
    }

    /// The surface uses the current run, so a hello that names another one is not repeated.
    pub(super) fn handle_numbered(&mut self) {
        (self.repeats, self.next_repeat) = (0, None);
    }

    /// An answer was written; it is due again after the interval, if repetitions are left.
    pub(super) fn note_answer(&mut self, now: Instant) {
        self.next_repeat = (self.repeats > 0).then(|| now + self.repeat_interval);
    }

    /// When the last answer is to be repeated, whatever else goes out meanwhile.
    pub(super) fn next_repeat(&self) -> Option<Instant> {
        self.next_repeat
    }

    /// Whether the last answer is repeated now.
    pub(super) fn repeat(&mut self, now: Instant) -> bool {
        let is_due = self.next_repeat.is_some_and(|at| now >= at);
        if is_due {
            self.repeats -= 1;
            self.next_repeat = None;
        }
        is_due
    }
}

/// A hello without content that is owed: the answer to a discovery call, or a complaint.
#[derive(Debug)]
pub(super) struct ShortReply {
    pending: Option<(SessionId, Purpose)>,
    /// Hellos and calls that do not verify, since a frame verified.
    unverified: u32,
    /// When the last complaint was owed.
    complained: Option<Instant>,
    /// State of the generator that draws the time of the answer to a call.
    random: u64,
}

/// The purpose of a short hello to the session that it names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Purpose {
    /// It answers a call with this nonce under the key of this generation.
    Answer(u64, Generation),
    /// It says that hellos or calls do not verify here.
    Complaint,
}

impl ShortReply {
    /// Hellos and calls that do not verify before the first complaint. Each may be damaged, or meant for another vehicle.
    const MIN_UNVERIFIED: u32 = 3;
    const COMPLAINT_INTERVAL: Duration = Duration::from_secs(30);

    pub(super) fn new(seed: u64) -> Self {
        Self { pending: None, unverified: 0, complained: None, random: seed ^ 0x0CA1_15EA }
    }

    /// The generation of the key of a frame to everybody, if it is a discovery call of this mission.
    pub(super) fn called_by(
        authenticity: Option<&LinkAuthenticity>,
        mission: MissionId,
        envelope: &Envelope<'_>,
    ) -> Option<Generation> {
        let generation = match authenticity {
            Some(a) => a.open_call(envelope, mission),
            None => envelope.open(&Seal::Crc(mission, 0)).map(|_| Generation::Present),
        };
        generation.filter(|_| envelope.header.kind().is_hello())
    }

    /// Owes the answer to a call.
    pub(super) fn handle_call(&mut self, call: &Header, (session, generation): (SessionId, Generation)) {
        self.pending = Some((session, Purpose::Answer(call.nonce.unwrap_or_default(), generation)));
    }

    /// A hello or a call of this session does not verify; returns whether a complaint is owed now.
    pub(super) fn handle_unverified(&mut self, session: SessionId, now: Instant) -> bool {
        self.unverified += 1;
        let is_recent = self.complained.is_some_and(|at| now.since(at) < Self::COMPLAINT_INTERVAL);
        let complains = self.unverified >= Self::MIN_UNVERIFIED && !is_recent && self.pending.is_none();
        if complains {
            (self.pending, self.complained) = (Some((session, Purpose::Complaint)), Some(now));
        }
        complains
    }

    /// The turn in which a call is answered, at a random time in the window that the call names.
    pub(super) fn draw_turn(&mut self, config: &VehicleConfig, window: Option<u8>, now: Instant) -> Grant {
        let window = Duration::from_millis(250) * u32::from(window.unwrap_or_default());
        let share = (crate::link::run::next_random(&mut self.random) >> 40) as f64 / (1u64 << 24) as f64;
        let begins = now + config.modem.turn_around + window.mul_f64(share);
        Grant { begins, ends: begins + config.modem.frame_airtime() * 2 }
    }

    pub(super) fn is_pending(&self) -> bool {
        self.pending.is_some()
    }

    pub(super) fn handle_verified(&mut self) {
        self.unverified = 0;
    }

    /// A turn is granted to other frames.
    pub(super) fn cancel(&mut self) {
        self.pending = None;
    }

    /// The frame that is owed, if there is one.
    pub(super) fn take(&mut self, config: &VehicleConfig, authenticity: Option<&LinkAuthenticity>) -> Option<Vec<u8>> {
        let (session, purpose) = self.pending.take()?;
        let hello = Header::hello(config.address, Address::SURFACE, session);
        let (header, seal) = match (purpose, authenticity) {
            (Purpose::Complaint, _) => (hello, Seal::complaint(session.get())),
            (Purpose::Answer(..), None) => (hello, Seal::Crc(config.mission, session.get())),
            (Purpose::Answer(nonce, generation), Some(a)) => (
                Header { nonce: Some(nonce), keyed: true, ..hello },
                Seal::Hello(a.key(generation), config.mission, session.get(), nonce),
            ),
        };
        Some(FrameBuilder::new(&header, config.modem.frame_bytes).finish(&seal, true))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_storm_of_hellos_is_answered_once_in_three_seconds() {
        let begin = Instant::from_secs_f64(100.0);
        let mut limit = HelloLimit::new(Access::Shared, begin);
        let at = |ms: u64| begin + Duration::from_millis(ms);
        let admitted = (0..1000).filter(|&i| limit.admit(SessionId::from_random(1), at(i * 100))).count();
        assert_eq!(admitted, 8 + 33);
        assert!(limit.admit(SessionId::from_random(1), at(1_000_000)), "after a pause");
    }

    #[test]
    fn an_answer_is_repeated_three_times_until_a_numbered_frame() {
        let begin = Instant::from_secs_f64(100.0);
        let mut limit = HelloLimit::new(Access::Shared, begin);
        let repeats = |limit: &mut HelloLimit| {
            assert!(limit.admit(SessionId::from_random(1), begin));
            limit.handle_offer();
            limit.note_answer(begin);
            let times = (1..100).map(|s| begin + Duration::from_secs(s));
            times.filter(|&now| limit.repeat(now).then(|| limit.note_answer(now)).is_some()).count()
        };
        assert_eq!(repeats(&mut limit), 3);
        let mut limit = HelloLimit::new(Access::Shared, begin);
        assert!(limit.admit(SessionId::from_random(1), begin));
        limit.note_answer(begin);
        limit.handle_numbered();
        assert_eq!(limit.next_repeat(), None);
    }

    #[test]
    fn an_answer_to_another_run_never_displaces_a_current_answer() {
        let begin = Instant::from_secs_f64(100.0);
        let mut limit = HelloLimit::new(Access::Shared, begin);
        assert!(limit.admit(SessionId::from_random(1), begin));
        limit.handle_offer();
        limit.note_answer(begin);
        for seconds in [9, 12, 24, 36, 48, 60] {
            let now = begin + Duration::from_secs(seconds);
            assert!(limit.admit(SessionId::from_random(1), now));
            limit.handle_known(now);
            assert!(!limit.repeat(now), "after {seconds} s");
        }
    }
}
