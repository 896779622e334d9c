//! The vehicles that the surface knows, the calls by which it looks for others, and the choice of the next one to contact.

use super::peer::VehiclePeer;
use crate::link::run::{Authenticity, Generation, Identities, Identity};
use crate::link::{Transmit, TransmitKind};
use crate::mac::{ModemProfile, quarter_seconds};
use crate::map::StateReplica;
use crate::time::Instant;
use crate::wire::{Address, Envelope, FrameBuilder, Header, MissionId, Seal, UtcHours};
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

/// The known vehicles; the surface exchanges turns with one of them at a time.
#[derive(Debug)]
pub(super) struct Fleet<R> {
    peers: BTreeMap<Address, VehiclePeer<R>>,
    /// The vehicle that has or had the last turn.
    current: Option<Address>,
}

impl<R: StateReplica> Fleet<R> {
    /// No further vehicle is looked for beyond this number.
    const MAX_FOUND: usize = 14;

    pub(super) fn new() -> Self {
        Self { peers: BTreeMap::new(), current: None }
    }

    pub(super) fn insert(&mut self, vehicle: Address, peer: VehiclePeer<R>) {
        self.peers.insert(vehicle, peer);
    }

    pub(super) fn get(&self, vehicle: Address) -> Option<&VehiclePeer<R>> {
        self.peers.get(&vehicle)
    }

    pub(super) fn get_mut(&mut self, vehicle: Address) -> Option<&mut VehiclePeer<R>> {
        self.peers.get_mut(&vehicle)
    }

    pub(super) fn first_mut(&mut self) -> Option<&mut VehiclePeer<R>> {
        self.peers.values_mut().next()
    }

    pub(super) fn set_clock(&mut self, clock: UtcHours) {
        self.peers.values_mut().for_each(|peer| peer.set_clock(clock));
    }

    pub(super) fn addresses(&self) -> impl Iterator<Item = Address> + '_ {
        self.peers.keys().copied()
    }

    /// Whether discovery may still add a vehicle.
    pub(super) fn has_room(&self) -> bool {
        self.peers.len() < Self::MAX_FOUND
    }

    pub(super) fn is_current(&self, vehicle: Address) -> bool {
        self.current == Some(vehicle)
    }

    pub(super) fn set_current(&mut self, vehicle: Address) {
        self.current = Some(vehicle);
    }

    pub(super) fn current_mut(&mut self) -> Option<&mut VehiclePeer<R>> {
        self.current.and_then(|a| self.peers.get_mut(&a))
    }

    /// The vehicle whose turn occupies the medium.
    fn engaged(&self, now: Instant) -> Option<&VehiclePeer<R>> {
        self.current.and_then(|a| self.peers.get(&a)).filter(|p| p.master.is_engaged(now))
    }

    /// Whether the turn of a vehicle still occupies the medium at `now`.
    pub(super) fn is_medium_taken(&self, now: Instant) -> bool {
        self.engaged(now).is_some_and(|p| !p.master.may_speak(false, now))
    }

    /// Vehicles that answer their grants.
    pub(super) fn active(&self) -> usize {
        self.peers.values().filter(|p| p.master.unanswered() < 3).count()
    }

    /// Withdraws orders that grow old and have not arrived in time; returns their vehicles.
    pub(super) fn withdraw_late_orders(&mut self, now: Instant) -> impl Iterator<Item = Address> {
        self.peers.iter_mut().filter_map(move |(&vehicle, peer)| peer.withdraw_late(now).then_some(vehicle))
    }

    /// The vehicle to grant a turn to at `now`: of those that are due, the one that waited longest.
    pub(super) fn choose(&self, now: Instant) -> Option<Address> {
        if self.is_medium_taken(now) {
            return None;
        }
        let is_alone = self.peers.len() == 1;
        self.longest_waiting(|p| {
            let is_quiet = p.quiet_until().is_some_and(|until| now < until);
            !is_quiet && p.master.may_speak(p.has_slots_to_send(), now) && (is_alone || now >= p.master.retry_at())
        })
    }

    /// The vehicle that waited longest of those to which a frame should go without a turn.
    pub(super) fn choose_without_turn(&self, now: Instant) -> Option<Address> {
        self.longest_waiting(|p| p.has_reason_to_transmit(now))
    }

    fn longest_waiting(&self, is_due: impl Fn(&VehiclePeer<R>) -> bool) -> Option<Address> {
        self.peers
            .values()
            .filter(|p| is_due(p))
            .min_by_key(|p| (p.master.begun(), p.address()))
            .map(VehiclePeer::address)
    }

    /// When the next turn may be granted; `discovery` is when the next discovery call is due.
    pub(super) fn next_turn(&self, discovery: Option<Instant>, now: Instant) -> Option<Instant> {
        if let Some(peer) = self.engaged(now) {
            return peer.master.end_of_turn();
        }
        let is_alone = self.peers.len() == 1;
        let due = |p: &VehiclePeer<R>| {
            let at = p.master.next_wakeup(p.has_slots_to_send())?.max(p.quiet_until().unwrap_or(Instant::ZERO));
            Some(if is_alone { at } else { at.max(p.master.retry_at()) })
        };
        self.peers.values().filter_map(due).chain(discovery).min()
    }

    /// When a frame is next due that goes out without a turn.
    pub(super) fn next_without_turn(&self) -> Option<Instant> {
        self.peers.values().filter_map(VehiclePeer::next_reason).min()
    }
}

/// Transmits a discovery call from time to time. Each vehicle that is not in contact answers at a random time.
#[derive(Debug)]
pub(super) struct Discovery {
    /// The longest time between two calls; `None` disables them.
    every: Option<Duration>,
    pause: Duration,
    next: Instant,
    open: Option<(Identity, Instant)>,
    /// Vehicles that could not verify a call.
    complaints: BTreeSet<Address>,
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
        let (open, complaints) = (None, BTreeSet::new());
        Self { every, pause, next, open, complaints, reach, identities, generation: Generation::Present }
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
        Transmit { to: Address::EVERYBODY, bytes, kind: TransmitKind::DiscoveryCall, contents: BTreeMap::new() }
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

    /// Whether a vehicle says for the first time that it could not verify the last call.
    pub(super) fn is_new_complaint(&mut self, envelope: &Envelope<'_>) -> bool {
        self.open.is_some_and(|(call, _)| envelope.is_complaint(call.session.get()))
            && self.complaints.insert(envelope.header.from)
    }

    /// The length of a call in bytes.
    pub(super) const fn bytes(keyed: bool) -> usize {
        if keyed { 9 + 8 + 8 } else { 9 + 3 }
    }
}
