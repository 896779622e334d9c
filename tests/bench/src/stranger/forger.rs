//! The frames of the stranger, made from those that he overheard.

use super::account::AttackKind;
use super::wiretap::Wiretap;
use crate::link_ends::{FRAME_BYTES, MISSION, auv};
use scenecast_protocol::directive::{Constraints, SLOTS, Series, Slot, SlotReport, SlotState, Utility, VersionedSlot};
use scenecast_protocol::map::{Cell, LabelGrid};
use scenecast_protocol::map_codec::{Codec, encode};
use scenecast_protocol::wire::{
    AckForm, AckStatement, Address, ChunkKind, Envelope, FrameBuilder, Header, Introduction, Seal, SessionId,
    VehicleStatus,
};
use sim_channel::RandomStream;
use std::collections::VecDeque;

/// The label of forged cells and in forged orders; neither end uses it.
const FORGED_LABEL: u8 = 9;

/// What the stranger knows: the frames that he overheard, and the runs of both ends.
pub(super) struct Forger {
    rng: RandomStream,
    present: VecDeque<Vec<u8>>,
    earlier: VecDeque<Vec<u8>>,
    wiretap: Wiretap,
}

/// A frame of the stranger.
pub(super) struct ForgedFrame {
    pub(super) kind: AttackKind,
    pub(super) to_vehicle: bool,
    pub(super) bytes: Vec<u8>,
}

/// The ends of a forged frame.
#[derive(Clone, Copy)]
struct Route {
    from: Address,
    to: Address,
}

impl Route {
    fn to_vehicle(is_to_vehicle: bool) -> Self {
        let (from, to) = if is_to_vehicle { (Address::SURFACE, auv()) } else { (auv(), Address::SURFACE) };
        Self { from, to }
    }
}

impl Forger {
    const PRESENT: usize = 600;
    const EARLIER: usize = 3000;

    pub(super) fn new(rng: RandomStream) -> Self {
        Self { rng, present: VecDeque::new(), earlier: VecDeque::new(), wiretap: Wiretap::default() }
    }

    /// Listens to the transmissions of both ends.
    pub(super) fn overhear(&mut self, frames: impl IntoIterator<Item = Vec<u8>>) {
        for bytes in frames {
            self.wiretap.hear(&bytes);
            self.present.push_back(bytes);
            if self.present.len() > Self::PRESENT {
                self.present.pop_front();
            }
        }
    }

    /// An end has begun a new run: the frames up to now are those of earlier runs.
    pub(super) fn end_run(&mut self) {
        let keep = self.present.len().min(150);
        let skip = self.present.len() - keep;
        self.earlier.extend(self.present.drain(..).skip(skip));
        let excess = self.earlier.len().saturating_sub(Self::EARLIER);
        self.earlier.drain(..excess);
    }

    /// The next frame of one of these kinds; `shown` is the operator's map. A kind for which
    /// the stranger knows too little becomes noise.
    pub(super) fn forge(&mut self, kinds: &[AttackKind], shown: Option<&LabelGrid>) -> ForgedFrame {
        let kind = kinds[self.below(kinds.len())];
        let to_vehicle = match kind {
            AttackKind::Order | AttackKind::Call => true,
            AttackKind::Map | AttackKind::Report => false,
            _ => self.below(2) == 0,
        };
        let made = match kind {
            AttackKind::Noise => None,
            AttackKind::Flipped => self.flipped(to_vehicle),
            AttackKind::Replayed | AttackKind::Relayed => self.overheard(to_vehicle),
            AttackKind::Earlier => pick(&mut self.rng, &self.earlier).cloned(),
            AttackKind::Malformed => self.malformed(to_vehicle),
            AttackKind::Tagged => self.tagged(to_vehicle),
            AttackKind::Hello => self.hello(to_vehicle),
            AttackKind::Call => Some(self.call()),
            AttackKind::Order => self.order(),
            AttackKind::Undecodable => self.undecodable(to_vehicle),
            AttackKind::Map => shown.and_then(|shown| self.map(shown)),
            AttackKind::Report => self.report(),
            AttackKind::Acknowledgement => self.acknowledgement(to_vehicle),
        };
        match made {
            Some(bytes) => ForgedFrame { kind, to_vehicle, bytes },
            None => ForgedFrame { kind: AttackKind::Noise, to_vehicle, bytes: self.noise() },
        }
    }

    fn below(&mut self, bound: usize) -> usize {
        self.rng.below(bound)
    }

    fn noise(&mut self) -> Vec<u8> {
        let length = self.below(FRAME_BYTES + 1);
        (0..length).map(|_| self.below(256) as u8).collect()
    }

    /// An overheard frame to this end.
    fn overheard(&mut self, to_vehicle: bool) -> Option<Vec<u8>> {
        let is_to =
            |bytes: &&Vec<u8>| Envelope::decode(bytes, |_| true).is_ok_and(|e| e.header.to.is_vehicle() == to_vehicle);
        let frames: Vec<&Vec<u8>> = self.present.iter().filter(is_to).collect();
        (!frames.is_empty()).then(|| frames[self.rng.below(frames.len())].clone())
    }

    fn flipped(&mut self, to_vehicle: bool) -> Option<Vec<u8>> {
        let mut bytes = self.overheard(to_vehicle)?;
        for _ in 0..=self.below(3) {
            let bit = self.below(bytes.len() * 8);
            bytes[bit / 8] ^= 1 << (bit % 8);
        }
        Some(bytes)
    }

    /// An overheard frame, cut or changed anywhere, its header included, that ends in the CRC of the present runs.
    fn malformed(&mut self, to_vehicle: bool) -> Option<Vec<u8>> {
        let mut bytes = self.overheard(to_vehicle)?;
        let envelope = Envelope::decode(&bytes, |_| true).ok()?;
        let seal = Seal::bytes(envelope.header.keyed, envelope.header.kind());
        bytes.truncate(bytes.len() - seal);
        // Without the bit for a tag the end expects a CRC.
        bytes[0] &= !1;
        let at = self.below(bytes.len());
        match self.below(4) {
            0 => bytes.truncate(at.max(2)),
            1 => bytes[at] ^= 1 << self.rng.below(8),
            2 => bytes[0] ^= 1 << (5 + self.rng.below(3)),
            _ => bytes.extend((0..self.rng.below(8)).map(|_| self.rng.below(256) as u8).collect::<Vec<_>>()),
        }
        bytes.truncate(FRAME_BYTES - 4);
        let crc = self.crc_of(&bytes, to_vehicle)?;
        bytes.extend(crc);
        Some(bytes)
    }

    /// The CRC of any bytes as a frame of the present runs.
    fn crc_of(&mut self, bytes: &[u8], to_vehicle: bool) -> Option<Vec<u8>> {
        let padded = [bytes, &[0; 8]].concat();
        let Route { from, .. } = Route::to_vehicle(to_vehicle);
        let number = self.wiretap.number(from);
        let header = Envelope::decode(&padded, |_| true).ok().map(|e| e.header);
        let seal = match header {
            Some(header) if header.kind().is_hello() => self.hello_seal(to_vehicle),
            Some(header) => self.wiretap.crc_of(MISSION, &header)?,
            None => self.wiretap.crc(MISSION, from, number)?,
        };
        seal.crc(&[bytes]).map(Iterator::collect)
    }

    fn hello_seal(&self, to_vehicle: bool) -> Seal<'static> {
        let surface = self.wiretap.session(Address::SURFACE).map_or(0, SessionId::get);
        Seal::Crc(MISSION, if to_vehicle { 0 } else { surface })
    }

    fn tagged(&mut self, to_vehicle: bool) -> Option<Vec<u8>> {
        let mut bytes = self.overheard(to_vehicle)?;
        bytes[0] |= 1;
        let tag: Vec<u8> = (0..8).map(|_| self.below(256) as u8).collect();
        let end = bytes.len().saturating_sub(8);
        bytes.truncate(end);
        bytes.extend_from_slice(&tag);
        Some(bytes)
    }

    /// A numbered frame with the CRC of the present runs.
    fn numbered(&self, (header, number): (Header, u64), chunks: &[(ChunkKind, Vec<u8>)]) -> Option<Vec<u8>> {
        let mut builder = FrameBuilder::new(&header, FRAME_BYTES);
        for (kind, payload) in chunks {
            builder.push(*kind, payload);
        }
        Some(builder.finish(&self.wiretap.crc(MISSION, header.from, number)?, true))
    }

    /// The header of a numbered frame that may be the sender's next one, and its number.
    fn header(&mut self, route: Route) -> (Header, u64) {
        let number = self.wiretap.number(route.from) + self.below(4) as u64;
        let turn = (self.below(2) == 0).then(|| self.below(256) as u8);
        let base = 1 + self.below(4) as u16;
        let header = Header { turn, ..Header::numbered(route.from, route.to, number, base) };
        (header, number)
    }

    fn hello(&mut self, to_vehicle: bool) -> Option<Vec<u8>> {
        let route = Route::to_vehicle(to_vehicle);
        let known = self.wiretap.session(route.from)?;
        let session = if self.below(2) == 0 { known } else { SessionId::from_random(self.below(1 << 16) as u16) };
        let series = to_vehicle.then(|| Series::from_random(self.below(1 << 31) as u64));
        let header = Header { session: Some(session), ..self.header(route).0 };
        let mut builder = FrameBuilder::new(&header, FRAME_BYTES);
        builder.push(
            ChunkKind::Introduction,
            &Introduction { series, ..Introduction::default() }.encode(Introduction::MAX_BYTES),
        );
        Some(builder.finish(&self.hello_seal(to_vehicle), true))
    }

    fn call(&mut self) -> Vec<u8> {
        let session = SessionId::from_random(self.below(1 << 16) as u16);
        let route = Route { from: Address::SURFACE, to: Address::EVERYBODY };
        let (header, _) = self.header(route);
        let header = Header { session: Some(session), turn: Some(8), ..header };
        FrameBuilder::new(&header, FRAME_BYTES).finish(&Seal::Crc(MISSION, 0), true)
    }

    fn order(&mut self) -> Option<Vec<u8>> {
        let route = Route::to_vehicle(true);
        let slot = match self.below(3) {
            0 => Slot::Constraints(Constraints { hold: self.below(2) == 0, abort: self.below(4) == 0 }),
            _ => {
                let weights = [(FORGED_LABEL, self.below(100) as i8)].into_iter().collect();
                Slot::Utility(Utility { weights, ..Utility::default() })
            }
        };
        let payload = VersionedSlot::encode(self.below(1 << 16) as u16, &slot);
        let header = self.header(route);
        self.numbered(header, &[(ChunkKind::Slot, payload)])
    }

    fn undecodable(&mut self, to_vehicle: bool) -> Option<Vec<u8>> {
        const KINDS: [ChunkKind; 7] = [
            ChunkKind::Map,
            ChunkKind::Pose,
            ChunkKind::Slot,
            ChunkKind::Object,
            ChunkKind::Report,
            ChunkKind::Layer,
            ChunkKind::Introduction,
        ];
        let route = Route::to_vehicle(to_vehicle);
        let mut chunks = Vec::new();
        for _ in 0..=self.below(3) {
            let length = self.below(20);
            chunks.push((KINDS[self.below(KINDS.len())], (0..length).map(|_| self.below(256) as u8).collect()));
        }
        let header = self.header(route);
        self.numbered(header, &chunks)
    }

    /// A patch of forged cells, coded against the operator's map, which the stranger may have followed.
    fn map(&mut self, shown: &LabelGrid) -> Option<Vec<u8>> {
        let route = Route::to_vehicle(false);
        let corner = Cell::new(self.below(60) as i32 - 30, self.below(60) as i32 - 10);
        let mut target = shown.clone();
        for i in 0..12 {
            target.set(Cell::new(corner.x + i % 4, corner.y + i / 4), FORGED_LABEL);
        }
        let chunk = encode(Codec::Context, shown, &target, corner, 30, &|_| true)?;
        let (header, number) = self.header(route);
        self.numbered((Header { base: 1, ..header }, number), &[(ChunkKind::Map, chunk.bytes)])
    }

    fn report(&mut self) -> Option<Vec<u8>> {
        let route = Route::to_vehicle(false);
        let random = SlotReport { version_low: self.below(256) as u8, state: SlotState::Applied };
        let status = VehicleStatus {
            base_digest: self.below(1 << 16) as u16,
            labels: FORGED_LABEL,
            slots: [random; SLOTS],
            ..VehicleStatus::default()
        };
        let chunk = match self.below(2) {
            0 => (ChunkKind::Pose, status.encode_pose(30)),
            _ => (ChunkKind::Report, status.encode_report(40, 0)?.0),
        };
        let header = self.header(route);
        self.numbered(header, &[chunk])
    }

    fn acknowledgement(&mut self, to_vehicle: bool) -> Option<Vec<u8>> {
        let route = Route::to_vehicle(to_vehicle);
        let (mut header, number) = self.header(route);
        if self.below(3) == 0 {
            header.base = 1 + self.below(2000) as u16;
        } else {
            let (horizon, lost) = (self.below(4096) as u64, vec![self.below(8) as u16]);
            let form = if self.below(2) == 0 { AckForm::Near } else { AckForm::Far };
            header.ack = Some(AckStatement::new(horizon, lost, form));
        }
        self.numbered((header, number), &[])
    }
}

fn pick<'a>(rng: &mut RandomStream, frames: &'a VecDeque<Vec<u8>>) -> Option<&'a Vec<u8>> {
    if frames.is_empty() { None } else { frames.get(rng.below(frames.len())) }
}
