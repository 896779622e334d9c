//! Without a key anybody can write frames that are accepted. The link recovers within a minute after the last one.

use crate::pair::{CALM, LinkedEnds, LossyChannel, Setup, auv, patchy, utility};
use scenecast_protocol::directive::{Budget, Constraints, OrderStatus, Series, Slot, SlotId, VersionedSlot};
use scenecast_protocol::link::InForce;
use scenecast_protocol::mac::Access;
use scenecast_protocol::map_codec::Codec;
use scenecast_protocol::schedule::{BackgroundOrder, Shares};
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::{
    AckForm, AckStatement, Address, ChunkKind, Envelope, FrameBuilder, Header, Introduction, MissionId, Seal, SessionId,
};
use std::collections::{BTreeSet, VecDeque};
use std::time::Duration;

const MISSION: MissionId = MissionId(7);
/// The time in which nearly every attacked link recovers, and the one in which each does.
const USUAL_RECOVERY: Duration = Duration::from_secs(60);
const MAX_RECOVERY: Duration = Duration::from_secs(600);

const CHANNEL: LossyChannel = LossyChannel { propagation: Duration::from_millis(300), ..CALM };

/// A stranger who hears every frame and can write a CRC.
struct Stranger<'a> {
    pair: &'a mut LinkedEnds,
    random: u64,
}

impl Stranger<'_> {
    fn draw(&mut self, below: u64) -> u64 {
        self.random = self.random.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.random >> 33) % below
    }

    /// The session of the last run of an end.
    fn session(&self, of: Address) -> Option<SessionId> {
        self.pair.wiretap.session(of)
    }

    /// Closes a numbered frame with the CRC of the runs that the ends are in.
    fn close(&self, builder: FrameBuilder, from: Address, number: u64) -> Option<Vec<u8>> {
        Some(builder.finish(&self.pair.wiretap.crc(MISSION, from, number)?, true))
    }

    /// The session in the last hello of the vehicle, if it is among these frames.
    fn hello_of_vehicle(overheard: &VecDeque<Vec<u8>>) -> Option<SessionId> {
        let headers = overheard.iter().filter_map(|bytes| Envelope::decode(bytes, |_| true).ok()).map(|e| e.header);
        headers.filter(|h| h.from == auv()).find_map(|h| h.session)
    }

    /// Writes one frame to one of the ends.
    fn speak(&mut self) {
        let to_vehicle = self.draw(2) == 0;
        let (from, to) = if to_vehicle { (Address::SURFACE, auv()) } else { (auv(), Address::SURFACE) };
        let (Some(sender), Some(receiver)) = (self.session(from), self.session(to)) else { return };
        let bytes = match self.draw(7) {
            3 if to_vehicle => self.order(from, to),
            0 => self.replay(),
            1 => self.hello(from, to, sender, receiver),
            2 => self.invented(from, to),
            _ => self.changed(from, to),
        };
        let now = self.pair.now;
        let Some(bytes) = bytes else { return };
        match to_vehicle {
            true => self.pair.vehicle.handle_frame(&bytes, now),
            false => self.pair.surface.handle_frame(&bytes, now),
        }
    }

    fn replay(&mut self) -> Option<Vec<u8>> {
        let pick = self.draw(self.pair.overheard.len().max(1) as u64) as usize;
        self.pair.overheard.get(pick).cloned()
    }

    /// A hello of a run that exists or not.
    fn hello(&mut self, from: Address, to: Address, sender: SessionId, receiver: SessionId) -> Option<Vec<u8>> {
        let session = if self.draw(2) == 0 { sender } else { SessionId::from_random(self.draw(1 << 16) as u16) };
        let series = (from == Address::SURFACE).then(|| Series::from_random(self.draw(1 << 31)));
        let header = Header { session: Some(session), ..self.header(from, to).0 };
        let mut builder = FrameBuilder::new(&header, 64);
        builder.push(
            ChunkKind::Introduction,
            &Introduction { series, ..Introduction::default() }.encode(Introduction::MAX_BYTES),
        );
        let sealed_to = if from == Address::SURFACE { 0 } else { receiver.get() };
        Some(builder.finish(&Seal::Crc(MISSION, sealed_to), true))
    }

    /// An order under any version.
    fn order(&mut self, from: Address, to: Address) -> Option<Vec<u8>> {
        let (header, number) = self.header(from, to);
        let slot = VersionedSlot::encode(self.draw(1 << 16) as u16, &utility(self.draw(50) as i8));
        let mut builder = FrameBuilder::new(&header, 64);
        builder.push(ChunkKind::Slot, &slot);
        self.close(builder, from, number)
    }

    /// A frame with arbitrary chunks.
    fn invented(&mut self, from: Address, to: Address) -> Option<Vec<u8>> {
        let (header, number) = self.header(from, to);
        let mut builder = FrameBuilder::new(&header, 64);
        for _ in 0..self.draw(3) {
            let kinds = [ChunkKind::Map, ChunkKind::Pose, ChunkKind::Slot, ChunkKind::Object, ChunkKind::Report];
            let kind = kinds[self.draw(5) as usize];
            let bytes: Vec<u8> = (0..self.draw(24)).map(|_| self.draw(256) as u8).collect();
            builder.push(kind, &bytes);
        }
        self.close(builder, from, number)
    }

    /// An overheard frame with another number, base, statement or content.
    fn changed(&mut self, from: Address, to: Address) -> Option<Vec<u8>> {
        let heard: Vec<Vec<u8>> = self.pair.overheard.iter().take(60).cloned().collect();
        let pick = self.draw(heard.len().max(1) as u64) as usize;
        let envelope = Envelope::decode(heard.get(pick)?, |_| true).ok().filter(|e| e.header.from == from)?;
        let frame = envelope.open(&self.pair.wiretap.crc_of(MISSION, &envelope.header)?)?;
        let (mut header, mut number) = (Header { to, ..frame.header.clone() }, frame.number);
        match self.draw(5) {
            0 => {
                number += self.draw(64);
                header.number = number as u16;
            }
            1 => header.base = 1 + self.draw(100) as u16,
            2 => {
                let (horizon, lost) = (self.draw(4096), vec![self.draw(8) as u16]);
                let form = if self.draw(2) == 0 { AckForm::Near } else { AckForm::Far };
                header.ack = Some(AckStatement::new(horizon, lost, form));
            }
            3 => header.turn = Some(self.draw(256) as u8),
            _ => {}
        }
        let mut builder = FrameBuilder::new(&header, 64);
        for chunk in frame.chunks() {
            let mut payload = chunk.payload.to_vec();
            if self.draw(3) == 0 && !payload.is_empty() {
                let at = self.draw(payload.len() as u64) as usize;
                payload[at] ^= 1 << self.draw(8);
            }
            builder.push(chunk.kind, &payload);
        }
        builder.set_remaining(header.remaining);
        self.close(builder, from, number)
    }

    /// The header of a frame that may be the next one of an end, and its number.
    fn header(&mut self, from: Address, to: Address) -> (Header, u64) {
        let number = self.pair.wiretap.number(from) + self.draw(4);
        let base = 1 + self.draw(4) as u16;
        let turn = (self.draw(2) == 0).then(|| self.draw(256) as u8);
        let header = Header { turn, ..Header::numbered(from, to, number, base) };
        (header, number)
    }
}

/// Whether the last order is applied, or the operator sees that another content is in force: a forged order whose version has
/// the same low 8 bits can stand in its place.
fn is_settled(pair: &LinkedEnds, order: i8) -> bool {
    let last = utility(order);
    let view = pair.surface.vehicle(auv()).unwrap();
    let is_decided = view.slots().any(|slot| slot.slot == last && slot.status == OrderStatus::Applied);
    let is_other = matches!(view.in_force(SlotId::Utility), InForce::Known(content) if *content != last);
    let is_other = is_decided && is_other;
    pair.applied.last() == Some(&last) || is_other
}

/// The time until the maps agree and the last order is settled, if that is before `until`.
fn recovery(pair: &mut LinkedEnds, order: i8, until: Instant) -> Option<Duration> {
    let from = pair.now;
    while pair.now < until {
        pair.run(pair.now + Duration::from_millis(500), false);
        if pair.is_converged() && is_settled(pair, order) {
            return Some(pair.now.since(from));
        }
    }
    None
}

/// The time until a link recovers after `seed` has chosen the attack.
fn attack(seed: u64) -> Option<Duration> {
    let access = [Access::Shared, Access::Shared, Access::ModemOwned { pool_frames: 8 }, Access::Polled];
    let setup = Setup { access: access[seed as usize % access.len()], ..Setup::new(64, 10_000, Codec::Context) };
    let mut pair = LinkedEnds::new(seed, setup, CHANNEL);
    pair.vehicle.set_map(patchy(12, 1).iter(), pair.now);
    pair.run(pair.now + Duration::from_secs(40), true);
    let mut stranger = Stranger { pair: &mut pair, random: seed ^ 0x5EED };
    let (frames, pause_ms) = (1 + stranger.draw(120), 20 + stranger.draw(2000));
    for step in 0..frames {
        stranger.speak();
        let pause = stranger.draw(pause_ms) + 1;
        let pair = &mut *stranger.pair;
        pair.run(pair.now + Duration::from_millis(pause), false);
        if step % 20 == 0 {
            pair.vehicle.set_map(patchy(12, 1 + step).iter(), pair.now);
        }
    }
    pair.surface.issue(auv(), utility(77), pair.now).unwrap();
    let until = pair.now + MAX_RECOVERY;
    recovery(&mut pair, 77, until)
}

#[test]
fn a_link_recovers_from_forgeries_that_it_accepted() {
    let attacks = crate::cases(400);
    let times: Vec<Option<Duration>> = (0..attacks).map(attack).collect();
    let late: Vec<(usize, &Option<Duration>)> =
        times.iter().enumerate().filter(|(_, time)| time.is_none_or(|t| t > USUAL_RECOVERY)).collect();
    println!("{} of {attacks} links took longer than {USUAL_RECOVERY:?}: {late:?}", late.len());
    assert!(times.iter().all(Option::is_some), "not within {MAX_RECOVERY:?}: {late:?}");
    assert!(late.len() as u64 * 50 <= attacks, "longer than {USUAL_RECOVERY:?}: {late:?}");
}

/// Begins a run of the surface at the vehicle by a forged hello, and gives it an order of a series.
fn give_forged_order(pair: &mut LinkedEnds, series: Series, order: &[u8]) {
    let forged = SessionId::from_random(0x5A5A);
    let answer = greet(pair, forged, &Introduction { series: Some(series), ..Introduction::default() });
    let (header, _) = Stranger { pair, random: 1 }.header(Address::SURFACE, auv());
    let mut frame = FrameBuilder::new(&Header { number: 1, base: 1, ..header }, 64);
    assert!(frame.push(ChunkKind::Slot, order));
    let seal = Seal::Run { mission: MISSION, to: answer, from: forged, number: 1 };
    pair.vehicle.handle_frame(&frame.finish(&seal, true), pair.now);
}

/// Sends the vehicle the hello of another surface until it answers, which gives its run.
fn greet(pair: &mut LinkedEnds, session: SessionId, introduction: &Introduction) -> SessionId {
    let (header, _) = Stranger { pair, random: 1 }.header(Address::SURFACE, auv());
    let mut hello = FrameBuilder::new(&Header { session: Some(session), ..header }, 64);
    hello.push(ChunkKind::Introduction, &introduction.encode(Introduction::MAX_BYTES));
    let hello = hello.finish(&Seal::Crc(MISSION, 0), true);
    pair.overheard.clear();
    let give_up = pair.now + Duration::from_secs(1000);
    loop {
        if let Some(session) = Stranger::hello_of_vehicle(&pair.overheard) {
            return session;
        }
        assert!(pair.now < give_up, "no answer to the hello");
        pair.vehicle.handle_frame(&hello, pair.now);
        pair.run(pair.now + Duration::from_millis(100), false);
    }
}

#[test]
fn a_surface_that_reads_png_bodies_alone_is_sent_no_others() {
    for is_plain in [false, true] {
        let mut pair = LinkedEnds::new(4, Setup::new(64, 10_000, Codec::Context), CHANNEL);
        pair.vehicle.set_map(patchy(12, 1).iter(), pair.now);
        pair.mute = [true, false];
        let session = SessionId::from_random(0x5A5A);
        let series = Some(Series::from_random(1));
        let answer = greet(&mut pair, session, &Introduction { series, is_plain, ..Introduction::default() });
        let (header, _) = Stranger { pair: &mut pair, random: 1 }.header(Address::SURFACE, auv());
        let grant = Header { number: 1, base: 1, turn: Some(60), ..header };
        let seal = Seal::Run { mission: MISSION, to: answer, from: session, number: 1 };
        pair.vehicle.handle_frame(&FrameBuilder::new(&grant, 64).finish(&seal, true), pair.now);
        pair.run(pair.now + Duration::from_secs(15), false);
        let mut bodies = BTreeSet::new();
        for bytes in &pair.overheard {
            let Ok(envelope) = Envelope::decode(bytes, |to| to == Address::SURFACE) else { continue };
            let number = envelope.header.number_near(0);
            let seal = Seal::Run { mission: MISSION, to: session, from: answer, number };
            let Some(frame) = envelope.open(&seal) else { continue };
            bodies.extend(frame.chunks().filter(|c| c.kind == ChunkKind::Map).map(|c| c.payload[0] >> 7));
        }
        assert_eq!(bodies, BTreeSet::from([u8::from(!is_plain)]), "body 1 is context");
    }
}

#[test]
fn an_order_gets_through_after_a_forged_series_ended_its_own() {
    for access in [Access::Shared, Access::ModemOwned { pool_frames: 8 }, Access::Polled, Access::FullDuplex] {
        let setup = Setup { access, ..Setup::new(64, 10_000, Codec::Context) };
        let mut pair = LinkedEnds::new(3, setup, CHANNEL);
        pair.surface.issue(auv(), utility(5), pair.now).unwrap();
        pair.run(pair.now + Duration::from_secs(40), false);
        assert_eq!(pair.applied, [utility(5)]);

        let forged = Series::from_random(1);
        give_forged_order(&mut pair, forged, &VersionedSlot::encode(1, &Slot::Constraints(Constraints::default())));
        assert_eq!(pair.vehicle.persistent_state().series(), Some(forged), "the forged series is in force");

        pair.surface.issue(auv(), utility(77), pair.now).unwrap();
        let until = pair.now + USUAL_RECOVERY;
        assert!(recovery(&mut pair, 77, until).is_some(), "{access:?}");
        assert_eq!(pair.applied.last(), Some(&utility(77)), "{access:?}");
    }
}

#[test]
fn an_order_gets_through_beside_a_forged_one_of_the_same_bits() {
    for access in [Access::Shared, Access::ModemOwned { pool_frames: 8 }, Access::Polled, Access::FullDuplex] {
        let setup = Setup { access, ..Setup::new(64, 10_000, Codec::Context) };
        let mut pair = LinkedEnds::new(5, setup, CHANNEL);
        pair.run(pair.now + Duration::from_secs(60), false);
        let series = pair.surface.vehicle(auv()).unwrap().series();
        // The operator's order will have version 1.
        give_forged_order(&mut pair, series, &VersionedSlot::encode(0x1701, &utility(-9)));
        pair.run(pair.now + Duration::from_millis(100), false);
        assert_eq!(pair.applied, [utility(-9)], "{access:?}");

        pair.surface.issue(auv(), utility(77), pair.now).unwrap();
        let until = pair.now + Duration::from_secs(120);
        let is_in_force = |pair: &LinkedEnds| pair.applied.last() == Some(&utility(77));
        while !is_in_force(&pair) {
            assert!(pair.now < until, "{access:?}: {:?}", pair.applied);
            pair.run(pair.now + Duration::from_secs(1), false);
        }
        let applied = pair.applied.len();
        pair.run(pair.now + Duration::from_secs(200), false);
        assert_eq!(pair.applied.len(), applied, "no order is sent again: {access:?}");
    }
}

#[test]
fn a_vehicle_that_keeps_its_own_content_is_sent_an_order_twice() {
    let mut pair = LinkedEnds::new(8, Setup::new(64, 10_000, Codec::Context), CHANNEL);
    pair.run(pair.now + Duration::from_secs(60), false);
    let series = pair.surface.vehicle(auv()).unwrap().series();
    let own = Budget { bits_per_s: 10_000, shares: Shares::default(), background: BackgroundOrder::default() };
    pair.surface.issue(auv(), Slot::Budget(Budget { bits_per_s: 9_000, ..own }), pair.now).unwrap();
    let mut all_series = BTreeSet::from([series]);
    for _ in 0..6000 {
        pair.run(pair.now + Duration::from_millis(100), false);
        if pair.vehicle.budget_bps() != own.bits_per_s {
            pair.put_in_force(Slot::Budget(own));
        }
        all_series.insert(pair.surface.vehicle(auv()).unwrap().series());
    }
    assert_eq!((pair.applied.len(), all_series.len()), (2, 2), "{:?}", pair.applied);
    let view = pair.surface.vehicle(auv()).unwrap();
    assert_eq!(
        view.in_force(SlotId::Budget),
        InForce::Known(&Slot::Budget(own)),
        "the surface shows the content in force"
    );
}
