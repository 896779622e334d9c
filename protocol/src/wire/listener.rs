//! A third party that hears both ends: it learns their runs and the numbers of their frames, and so verifies and reads each frame.

use super::frame::{Envelope, Frame, FrameError, Seal};
use super::header::{Address, MissionId, SessionId};
use crate::seal::{Direction, HeldKey, LinkKey, SessionKey};
use std::collections::{BTreeMap, VecDeque};

/// The runs of surfaces that are remembered, and the pairs of runs of each vehicle.
const MAX_RUNS: usize = 16;

/// Hears the frames of a surface and of its vehicles; it sends nothing.
#[derive(Debug)]
pub struct Listener {
    mission: MissionId,
    keys: Vec<HeldKey>,
    /// The runs and the calls of surfaces, the latest last.
    surfaces: VecDeque<Run>,
    /// The pairs of runs of each vehicle, that of its last frame first.
    pairs: BTreeMap<Address, VecDeque<Pair>>,
}

/// A frame as it was heard.
#[derive(Debug)]
pub struct Heard<'a> {
    /// The frame before it was verified.
    pub envelope: Envelope<'a>,
    /// The frame, if it is authentic, or sound where it has no tag.
    pub frame: Option<Frame<'a>>,
    /// Whether what verifies it was known: the runs of both ends, and the key of a frame with a tag. If so, a frame that is not
    /// verified is damaged, forged, or of a run whose hellos were not heard.
    pub could_verify: bool,
}

/// A run, or none (0).
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
        Self { mission, keys, surfaces: VecDeque::new(), pairs: BTreeMap::new() }
    }

    /// Reads the next frame on air. Fails on bytes that are no frame.
    pub fn hear<'a>(&mut self, bytes: &'a [u8]) -> Result<Heard<'a>, FrameError> {
        let envelope = Envelope::decode(bytes, |_| true)?;
        let (frame, could_verify) =
            if envelope.header.kind().is_hello() { self.hello(&envelope) } else { self.numbered(&envelope) };
        Ok(Heard { envelope, frame, could_verify })
    }

    fn hello<'a>(&mut self, envelope: &Envelope<'a>) -> (Option<Frame<'a>>, bool) {
        let header = &envelope.header;
        let vehicle = if header.from.is_vehicle() { header.from } else { header.to };
        let keys = self.link_keys(header.keyed, vehicle);
        let known: Vec<Run> = match header.from.is_vehicle() {
            true => self.surfaces.iter().copied().collect(),
            false => self.pairs.get(&vehicle).into_iter().flatten().map(|pair| pair.vehicle).collect(),
        };
        let could_verify = !(keys.is_empty() || header.from.is_vehicle() && known.is_empty());
        for to in known.into_iter().chain([Run::default()]) {
            let seals = keys.iter().map(|key| match key {
                Some(key) => Seal::Hello(key, self.mission, to.session, to.nonce),
                None => Seal::Crc(self.mission, to.session),
            });
            if let Some(frame) = seals.into_iter().find_map(|seal| envelope.open(&seal)) {
                self.learn(&frame, to);
                return (Some(frame), true);
            }
        }
        (None, could_verify)
    }

    /// The keys of a hello or call; one `None` where a CRC is checked.
    fn link_keys(&self, keyed: bool, vehicle: Address) -> Vec<Option<LinkKey>> {
        let of = |key: &HeldKey| match vehicle.is_vehicle() {
            true => key.vehicle(vehicle.number()).link().clone(),
            false => key.calls(),
        };
        if keyed { self.keys.iter().map(|key| Some(of(key))).collect() } else { vec![None] }
    }

    /// Takes over the run of a hello that was sealed to `to`.
    fn learn(&mut self, frame: &Frame<'_>, to: Run) {
        let header = &frame.header;
        let run = Run { session: header.session.map_or(0, SessionId::get), nonce: header.nonce.unwrap_or(0) };
        if !header.from.is_vehicle() {
            self.surfaces.retain(|&known| known != run);
            self.surfaces.push_back(run);
            if self.surfaces.len() > MAX_RUNS {
                self.surfaces.pop_front();
            }
        } else if to.session != run.session {
            // The answer to a call has the session of the call and offers no run.
            self.add_pair(header.from, to, run, header.keyed);
        }
    }

    fn add_pair(&mut self, of: Address, surface: Run, vehicle: Run, keyed: bool) {
        let session = |key: &HeldKey, encrypt: bool| {
            let link = key.vehicle(of.number());
            link.link().session(self.mission.0, of.number(), surface.nonce, vehicle.nonce, encrypt)
        };
        let keys = self.keys.iter().filter(|_| keyed);
        let sessions = keys.flat_map(|key| [false, true].map(|encrypt| session(key, encrypt))).collect();
        let pairs = self.pairs.entry(of).or_default();
        if !pairs.iter().any(|pair| (pair.surface, pair.vehicle) == (surface, vehicle)) {
            pairs.push_front(Pair { surface, vehicle, highest: [0; 2], sessions });
            pairs.truncate(MAX_RUNS);
        }
    }

    fn numbered<'a>(&mut self, envelope: &Envelope<'a>) -> (Option<Frame<'a>>, bool) {
        let header = &envelope.header;
        let vehicle = if header.from.is_vehicle() { header.from } else { header.to };
        let Some(pairs) = self.pairs.get_mut(&vehicle) else { return (None, false) };
        let opened = pairs.iter_mut().enumerate().find_map(|(i, pair)| Some((i, pair.open(self.mission, envelope)?)));
        let could_verify = !header.keyed || pairs.iter().any(|pair| !pair.sessions.is_empty());
        if let Some((i, frame)) = opened {
            // A frame shows which pair is in use.
            let pair = pairs.remove(i);
            pairs.extend(pair);
            pairs.rotate_right(1);
            return (Some(frame), true);
        }
        (None, could_verify)
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
                let seal = |key| Seal::Session(key, direction, number);
                self.sessions.iter().find_map(|key| envelope.open(&seal(key)))
            } else {
                envelope.open(&Seal::Run { mission, to, from, number })
            }
        })?;
        *highest = (*highest).max(frame.number);
        Some(frame)
    }
}
