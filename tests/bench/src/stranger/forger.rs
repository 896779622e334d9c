//! The frames of the stranger, made from those that he overheard.

use super::account::AttackKind;
use crate::link_ends::{FRAME_BYTES, MISSION, auv};
use scenecast_protocol::directive::{Constraints, SLOTS, Series, Slot, SlotReport, SlotState, Utility, VersionedSlot};
use scenecast_protocol::map::{Cell, LabelGrid};
use scenecast_protocol::map_codec::{Codec, encode};
use scenecast_protocol::wire::{
    AckStatement, Address, ChunkKind, Envelope, FrameBuilder, FrameKind, Header, Introduction, Seal, SessionId,
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
    /// The last header of the surface and of the vehicle.
    last: [Option<Header>; 2],
}

/// A frame of the stranger.
pub(super) struct ForgedFrame {
    pub(super) kind: AttackKind,
    pub(super) to_vehicle: bool,
    pub(super) bytes: Vec<u8>,
}

/// The ends of a forged frame: both addresses, and the session that it is sealed to.
#[derive(Clone, Copy)]
struct Route {
    from: Address,
    to: Address,
    /// The session of the pretended sender.
    session: SessionId,
    /// The session of the receiver, 0 if the stranger has not heard it.
    sealed_to: u16,
}

impl Forger {
    const PRESENT: usize = 600;
    const EARLIER: usize = 3000;

    pub(super) fn new(rng: RandomStream) -> Self {
        Self { rng, present: VecDeque::new(), earlier: VecDeque::new(), last: [None, None] }
    }

    /// Listens to the transmissions of both ends.
    pub(super) fn overhear(&mut self, frames: impl IntoIterator<Item = Vec<u8>>) {
        for bytes in frames {
            if let Ok(envelope) = Envelope::decode(&bytes, |_| true) {
                let by_vehicle = envelope.header.from.is_vehicle();
                self.last[usize::from(by_vehicle)] = Some(envelope.header);
            }
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
        // The second byte has both addresses: the sender's in its high half.
        let is_to = |bytes: &&Vec<u8>| bytes.get(1).is_some_and(|at| (at >> 4 == 0) == to_vehicle);
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
        let is_keyed = bytes.first()? & 1 != 0;
        bytes.truncate(bytes.len().saturating_sub(Seal::bytes(is_keyed, bytes.len())));
        // Without the bit for a tag the end expects a CRC.
        bytes[0] &= !1;
        let at = self.below(bytes.len());
        match self.below(4) {
            0 => bytes.truncate(at.max(2)),
            1 => bytes[at] ^= 1 << self.rng.below(8),
            2 => bytes[0] ^= 1 << (5 + self.rng.below(3)),
            _ => bytes.extend((0..self.rng.below(8)).map(|_| self.rng.below(256) as u8).collect::<Vec<_>>()),
        }
        bytes.truncate(FRAME_BYTES - 3);
        let is_hello = self.below(3) == 0;
        let sealed_to = match self.route(to_vehicle) {
            Some(route) if !is_hello => route.sealed_to,
            _ => 0,
        };
        let crc = crc24(&[&MISSION.0.to_be_bytes(), &sealed_to.to_be_bytes(), &bytes]);
        bytes.extend_from_slice(&crc.to_be_bytes()[1..]);
        Some(bytes)
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

    fn route(&self, to_vehicle: bool) -> Option<Route> {
        let [surface, vehicle] = [&self.last[0], &self.last[1]];
        let (from, to) = if to_vehicle { (Address::SURFACE, auv()) } else { (auv(), Address::SURFACE) };
        let (sender, receiver) = if to_vehicle { (surface, vehicle) } else { (vehicle, surface) };
        let sealed_to = receiver.as_ref().map_or(0, |header| header.session.get());
        Some(Route { from, to, session: sender.as_ref()?.session, sealed_to })
    }

    /// The header of a numbered frame that may be the sender's next one.
    fn header(&mut self, route: Route) -> Header {
        let last = self.last[usize::from(route.from.is_vehicle())].as_ref().map_or(0, |header| header.number);
        let number = last.wrapping_add(self.below(4) as u16);
        let turn = (self.below(2) == 0).then(|| self.below(256) as u8);
        Header {
            from: route.from,
            to: route.to,
            session: route.session,
            number,
            base: 1 + self.below(4) as u16,
            remaining: 0,
            turn,
            stamp: None,
            nonce: None,
            ack: None,
            kind: FrameKind::Numbered,
            keyed: false,
        }
    }

    fn hello(&mut self, to_vehicle: bool) -> Option<Vec<u8>> {
        let route = self.route(to_vehicle)?;
        let session =
            if self.below(2) == 0 { route.session } else { SessionId::from_random(self.below(1 << 16) as u16) };
        let series = to_vehicle.then(|| Series::from_random(self.below(1 << 31) as u64));
        let header = Header { session, number: 0, base: 1, kind: FrameKind::Hello, ..self.header(route) };
        let mut builder = FrameBuilder::new(&header, FRAME_BYTES);
        builder.push(
            ChunkKind::Introduction,
            &Introduction { series, ..Introduction::default() }.encode(Introduction::MAX_BYTES),
        );
        let sealed_to = if to_vehicle { 0 } else { route.sealed_to };
        Some(builder.finish(&Seal::Crc(MISSION, sealed_to), true))
    }

    fn call(&mut self) -> Vec<u8> {
        let session = SessionId::from_random(self.below(1 << 16) as u16);
        let route = Route { from: Address::SURFACE, to: Address::EVERYBODY, session, sealed_to: 0 };
        let header = Header { number: 0, base: 1, turn: Some(8), kind: FrameKind::Hello, ..self.header(route) };
        FrameBuilder::new(&header, FRAME_BYTES).finish(&Seal::Crc(MISSION, 0), true)
    }

    fn order(&mut self) -> Option<Vec<u8>> {
        let route = self.route(true)?;
        let slot = match self.below(3) {
            0 => Slot::Constraints(Constraints { hold: self.below(2) == 0, abort: self.below(4) == 0 }),
            _ => {
                let weights = [(FORGED_LABEL, self.below(100) as i8)].into_iter().collect();
                Slot::Utility(Utility { weights, ..Utility::default() })
            }
        };
        let payload = VersionedSlot::encode(self.below(1 << 16) as u16, &slot);
        let header = self.header(route);
        Some(numbered(header, route, &[(ChunkKind::Slot, payload)]))
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
        let route = self.route(to_vehicle)?;
        let mut chunks = Vec::new();
        for _ in 0..=self.below(3) {
            let length = self.below(20);
            chunks.push((KINDS[self.below(KINDS.len())], (0..length).map(|_| self.below(256) as u8).collect()));
        }
        let header = self.header(route);
        Some(numbered(header, route, &chunks))
    }

    /// A patch of forged cells, coded against the operator's map, which the stranger may have followed.
    fn map(&mut self, shown: &LabelGrid) -> Option<Vec<u8>> {
        let route = self.route(false)?;
        let corner = Cell::new(self.below(60) as i32 - 30, self.below(60) as i32 - 10);
        let mut target = shown.clone();
        for i in 0..12 {
            target.set(Cell::new(corner.x + i % 4, corner.y + i / 4), FORGED_LABEL);
        }
        let chunk = encode(Codec::Context, shown, &target, corner, 30, &|_| true)?;
        let header = Header { base: 1, ..self.header(route) };
        Some(numbered(header, route, &[(ChunkKind::Map, chunk.bytes)]))
    }

    fn report(&mut self) -> Option<Vec<u8>> {
        let route = self.route(false)?;
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
        Some(numbered(header, route, &[chunk]))
    }

    fn acknowledgement(&mut self, to_vehicle: bool) -> Option<Vec<u8>> {
        let route = self.route(to_vehicle)?;
        let mut header = self.header(route);
        if self.below(3) == 0 {
            header.base = 1 + self.below(2000) as u16;
        } else {
            let horizon_low = self.below(4096) as u16;
            header.ack = Some(AckStatement { horizon_low, lost: vec![self.below(8) as u16] });
        }
        Some(numbered(header, route, &[]))
    }
}

fn pick<'a>(rng: &mut RandomStream, frames: &'a VecDeque<Vec<u8>>) -> Option<&'a Vec<u8>> {
    if frames.is_empty() { None } else { frames.get(rng.below(frames.len())) }
}

fn numbered(header: Header, route: Route, chunks: &[(ChunkKind, Vec<u8>)]) -> Vec<u8> {
    let mut builder = FrameBuilder::new(&header, FRAME_BYTES);
    for (kind, payload) in chunks {
        builder.push(*kind, payload);
    }
    builder.finish(&Seal::Crc(MISSION, route.sealed_to), true)
}

/// CRC-24/OPENPGP (RFC 9580), which ends short frames.
fn crc24(parts: &[&[u8]]) -> u32 {
    let mut crc = 0x00B7_04CE;
    for &byte in parts.iter().copied().flatten() {
        crc ^= u32::from(byte) << 16;
        for _ in 0..8 {
            crc = if crc & 0x80_0000 == 0 { crc << 1 } else { crc << 1 ^ 0x0086_4CFB };
        }
        crc &= 0x00FF_FFFF;
    }
    crc
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_stranger_writes_a_valid_crc() {
        assert_eq!(crc24(&[b"123456789"]), 0x21_CF02);
    }
}
