//! A third party that hears both ends: it learns their runs and the numbers of their frames, and so verifies and reads each frame.

use super::chunk::ChunkKind;
use super::fields::{Address, MissionId, SessionId};
use super::frame::{Envelope, Frame, Seal};
use super::header::Header;
use super::introduction::Introduction;
use super::{FrameError, WIRE_VERSION};
use crate::seal::{Direction, HeldKey, LinkKey, SessionKey};
use std::collections::{BTreeMap, VecDeque};

/// The most runs that are remembered of surfaces for each receiver of their hellos, and of pairs of each vehicle.
const MAX_RUNS: usize = 16;

/// Hears the frames of a surface and of its vehicles; it sends nothing.
#[derive(Debug)]
pub struct Listener {
    mission: MissionId,
    keys: Vec<HeldKey>,
    /// By receiver, the runs in the hellos and calls of surfaces, the latest first.
    surfaces: BTreeMap<Address, VecDeque<Run>>,
    /// The pairs of runs of each vehicle, that of its last frame first.
    pairs: BTreeMap<Address, VecDeque<Pair>>,
}

/// A frame as it was heard.
#[derive(Debug)]
pub struct Heard<'a> {
    /// The frame before it was verified.
    pub envelope: Envelope<'a>,
    /// The frame, if its tag or CRC is right.
    pub frame: Option<Frame<'a>>,
    /// Whether what verifies it was known: the runs of both ends, and the key of a frame with a tag. If so, a frame that is not
    /// verified is damaged, forged, or of a run whose hellos were not heard.
    pub could_verify: bool,
}

/// A run; the default is that of an end whose run is not known.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct Run {
    session: u16,
    nonce: u64,
}

#[derive(Debug)]
struct Pair {
    surface: Run,
    vehicle: Run,
    /// The highest numbers of the surface and of the vehicle.
    highest: [u64; 2],
    /// By key, without and with encryption.
    sessions: Vec<SessionKey>,
}

impl Listener {
    /// Hears a mission. Frames with a tag need the key of the mission or of the vehicle.
    pub fn new(mission: MissionId, keys: Vec<HeldKey>) -> Self {
        Self { mission, keys, surfaces: BTreeMap::new(), pairs: BTreeMap::new() }
    }

    /// Reads the next frame on air. Fails on bytes that are no frame.
    pub fn hear<'a>(&mut self, bytes: &'a [u8]) -> Result<Heard<'a>, FrameError> {
        let envelope = Envelope::decode(bytes, |_| true)?;
        let (frame, could_verify) = match (envelope.header.session, envelope.header.from.is_vehicle()) {
            (Some(session), true) => self.hello_of_vehicle(&envelope, session),
            (Some(session), false) => self.hello_of_surface(&envelope, session),
            (None, _) => self.numbered(&envelope),
        };
        Ok(Heard { envelope, frame, could_verify })
    }

    /// A hello or a call, sealed to nobody.
    fn hello_of_surface<'a>(&mut self, envelope: &Envelope<'a>, session: SessionId) -> (Option<Frame<'a>>, bool) {
        let header = &envelope.header;
        let keys = self.link_keys(header, header.to);
        let frame = self.open_hello(envelope, &keys, Run::default());
        if frame.is_some() {
            let run = Run::of(header, session);
            let runs = self.surfaces.entry(header.to).or_default();
            runs.retain(|&known| known != run);
            runs.push_front(run);
            runs.truncate(MAX_RUNS);
        }
        (frame, !keys.is_empty())
    }

    /// A hello that is sealed to a surface's run, or an answer to a call.
    fn hello_of_vehicle<'a>(&mut self, envelope: &Envelope<'a>, session: SessionId) -> (Option<Frame<'a>>, bool) {
        let header = &envelope.header;
        let keys = self.link_keys(header, header.from);
        let called = [header.from, Address::EVERYBODY].into_iter().filter_map(|to| self.surfaces.get(&to)).flatten();
        let known: Vec<Run> = called.copied().collect();
        let could_verify = !keys.is_empty() && !known.is_empty();
        // One that was not called by the surface is sealed to no run.
        let mut sealed_to = known.into_iter().chain([Run::default()]);
        let opened = sealed_to.find_map(|to| Some((to, self.open_hello(envelope, &keys, to)?)));
        let Some((surface, frame)) = opened else { return (None, could_verify) };
        let vehicle = Run::of(header, session);
        // The answer to a call has the run of the call, and a refusal offers none.
        let is_offer = vehicle != surface && surface != Run::default() && !refuses(&frame);
        if is_offer && envelope.version == WIRE_VERSION {
            self.add_pair(header, surface, vehicle);
        }
        (Some(frame), true)
    }

    fn open_hello<'a>(&self, envelope: &Envelope<'a>, keys: &[Option<LinkKey>], to: Run) -> Option<Frame<'a>> {
        keys.iter().find_map(|key| match key {
            Some(key) => envelope.open(&Seal::Hello(key, self.mission, to.session, to.nonce)),
            None => envelope.open(&Seal::Crc(self.mission, to.session)),
        })
    }

    /// The keys of a hello or call; one `None` where a CRC is checked.
    fn link_keys(&self, header: &Header, other_end: Address) -> Vec<Option<LinkKey>> {
        let of = |key: &HeldKey| match other_end.is_vehicle() {
            true => key.vehicle(other_end.number()).link().clone(),
            false => key.calls(),
        };
        if header.keyed { self.keys.iter().map(|key| Some(of(key))).collect() } else { vec![None] }
    }

    fn add_pair(&mut self, header: &Header, surface: Run, vehicle: Run) {
        let pairs = self.pairs.entry(header.from).or_default();
        if pairs.iter().any(|pair| (pair.surface, pair.vehicle) == (surface, vehicle)) {
            return;
        }
        let (mission, number) = (self.mission.0, header.from.number());
        let session = |key: &HeldKey, encrypt: bool| {
            key.vehicle(number).link().session(mission, number, surface.nonce, vehicle.nonce, encrypt)
        };
        let keys = self.keys.iter().filter(|_| header.keyed);
        let sessions = keys.flat_map(|key| [false, true].map(|encrypt| session(key, encrypt))).collect();
        pairs.push_front(Pair { surface, vehicle, highest: [0; 2], sessions });
        pairs.truncate(MAX_RUNS);
    }

    fn numbered<'a>(&mut self, envelope: &Envelope<'a>) -> (Option<Frame<'a>>, bool) {
        let header = &envelope.header;
        let vehicle = if header.from.is_vehicle() { header.from } else { header.to };
        let Some(pairs) = self.pairs.get_mut(&vehicle) else { return (None, false) };
        let could_verify = pairs.iter().any(|pair| !header.keyed || !pair.sessions.is_empty());
        let opened = pairs.iter_mut().enumerate().find_map(|(i, pair)| Some((i, pair.open(self.mission, envelope)?)));
        let Some((i, frame)) = opened else { return (None, could_verify) };
        if let Some(pair) = pairs.remove(i) {
            pairs.push_front(pair);
        }
        (Some(frame), true)
    }
}

/// Whether a vehicle's hello refuses the surface, because another one holds it.
fn refuses(frame: &Frame<'_>) -> bool {
    let introduction = frame.chunks().find(|chunk| chunk.kind == ChunkKind::Introduction);
    introduction.is_some_and(|chunk| Introduction::decode(chunk.payload).is_ok_and(|said| said.refuses))
}

impl Run {
    fn of(hello: &Header, session: SessionId) -> Self {
        Self { session: session.get(), nonce: hello.nonce.unwrap_or(0) }
    }
}

impl Pair {
    fn open<'a>(&mut self, mission: MissionId, envelope: &Envelope<'a>) -> Option<Frame<'a>> {
        let header = &envelope.header;
        let is_up = header.from.is_vehicle();
        let (from, to) = if is_up { (self.vehicle, self.surface) } else { (self.surface, self.vehicle) };
        let direction = if is_up { Direction::Up } else { Direction::Down };
        let [from, to] = [from, to].map(|run| SessionId::from_random(run.session));
        let highest = self.highest.get_mut(usize::from(is_up))?;
        let frame = [header.number_near(*highest)].into_iter().chain(header.numbers(*highest)).find_map(|number| {
            if header.keyed {
                self.sessions.iter().find_map(|key| envelope.open(&Seal::Session(key, direction, number)))
            } else {
                envelope.open(&Seal::Run { mission, to, from, number })
            }
        })?;
        *highest = (*highest).max(frame.number);
        Some(frame)
    }
}

#[cfg(test)]
mod tests {
    use super::super::frame::FrameBuilder;
    use super::*;

    const MISSION: MissionId = MissionId(7);

    fn auv() -> Address {
        Address::vehicle(1).unwrap()
    }

    /// A hello of a run, sealed to a run.
    fn hello(from: Address, to: Address, session: u16, sealed_to: u16, refuses: bool) -> Vec<u8> {
        let header = Header::hello(from, to, SessionId::from_random(session));
        let mut builder = FrameBuilder::new(&header, 64);
        let introduction = Introduction { refuses, ..Introduction::default() };
        assert!(builder.push(ChunkKind::Introduction, &introduction.encode(26)));
        builder.finish(&Seal::Crc(MISSION, sealed_to), true)
    }

    /// The first frame of the vehicle's run in a pair with the surface's run.
    fn first(surface: u16, vehicle: u16) -> Vec<u8> {
        let [to, from] = [surface, vehicle].map(SessionId::from_random);
        let header = Header::numbered(auv(), Address::SURFACE, 1, 1);
        FrameBuilder::new(&header, 64).finish(&Seal::Run { mission: MISSION, to, from, number: 1 }, true)
    }

    /// Whether each frame is verified, in turn.
    fn heard(frames: &[Vec<u8>]) -> Vec<bool> {
        let mut listener = Listener::new(MISSION, Vec::new());
        frames.iter().map(|bytes| listener.hear(bytes).unwrap().frame.is_some()).collect()
    }

    #[test]
    fn a_run_is_known_after_many_calls_and_hellos_to_others() {
        let other = Address::vehicle(2).unwrap();
        let calls = (100..140).map(|call| hello(Address::SURFACE, Address::EVERYBODY, call, 0, false));
        let others = (200..240).map(|run| hello(Address::SURFACE, other, run, 0, false));
        let mut frames = vec![hello(Address::SURFACE, auv(), 5, 0, false)];
        frames.extend(calls.chain(others));
        frames.extend([hello(auv(), Address::SURFACE, 9, 5, false), first(5, 9)]);
        assert!(heard(&frames).into_iter().all(|sound| sound));
    }

    #[test]
    fn a_refusal_offers_no_run() {
        let of = |refuses| {
            [hello(Address::SURFACE, auv(), 5, 0, false), hello(auv(), Address::SURFACE, 9, 5, refuses), first(5, 9)]
        };
        assert_eq!(heard(&of(false)), [true, true, true]);
        assert_eq!(heard(&of(true)), [true, true, false]);
    }

    #[test]
    fn a_frame_whose_hellos_were_not_heard_cannot_be_verified() {
        let mut listener = Listener::new(MISSION, Vec::new());
        let mut could_verify = |bytes: Vec<u8>| {
            let heard = listener.hear(&bytes).unwrap();
            (heard.frame.is_some(), heard.could_verify)
        };
        assert_eq!(could_verify(first(5, 9)), (false, false));
        assert_eq!(could_verify(hello(Address::SURFACE, auv(), 5, 0, false)), (true, true));
        assert_eq!(could_verify(hello(auv(), Address::SURFACE, 9, 5, false)), (true, true));
        assert_eq!(could_verify(first(5, 8)), (false, true));
    }
}
