//! The packets between Micromodem emulators, and those of each rate: their frames and airtime. The layout is this crate's own.
//!
//! ```text
//! byte 0  magic 0xCA   1 kind   2 source   3 destination   4 rate   5 flags (1: ack, 2: ascii)   6 frames
//!      7  header version (`psk.packet.mod_hdr_version`)    8 unique number
//!      9-10 CRC-16 of bytes 0..9
//! then for each frame: 2 bytes length, bytes, 2 bytes CRC-16 of the bytes
//! ```

use crate::modem::emulator::board::crc16;
use std::time::Duration;

#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Packet {
    pub kind: PacketKind,
    pub src: u8,
    pub dst: u8,
    pub rate: u8,
    pub ack: bool,
    pub ascii: bool,
    /// Number of frames: requested, in a cycle init; contained, in other packets.
    pub frame_count: u8,
    pub header_version: u8,
    pub number: u8,
    /// `None` for a damaged frame.
    pub frames: Vec<Option<Vec<u8>>>,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum PacketKind {
    /// Minipacket before an FSK packet, or a request for an uplink.
    CycleInit,
    Data,
    /// One frame with the numbers of the frames received.
    Ack,
    /// Flexible data; the first frame is the minipacket.
    Flexible,
    Ping,
    PingReply,
    /// One frame with 13 bits of user data.
    User,
}

const KINDS: [PacketKind; 7] = [
    PacketKind::CycleInit,
    PacketKind::Data,
    PacketKind::Ack,
    PacketKind::Flexible,
    PacketKind::Ping,
    PacketKind::PingReply,
    PacketKind::User,
];
const MAGIC: u8 = 0xCA;
const HEADER_BYTES: usize = 11;

impl Packet {
    pub(super) fn new(kind: PacketKind, src: u8, dst: u8) -> Self {
        Self {
            kind,
            src,
            dst,
            rate: 0,
            ack: false,
            ascii: false,
            frame_count: 0,
            header_version: 0,
            number: 0,
            frames: Vec::new(),
        }
    }

    pub(super) fn is_psk(&self) -> bool {
        match self.kind {
            PacketKind::Data | PacketKind::Ack => self.rate > 0,
            PacketKind::Flexible => true,
            PacketKind::CycleInit | PacketKind::Ping | PacketKind::PingReply | PacketKind::User => false,
        }
    }

    pub(super) fn bytes(&self) -> usize {
        self.frames.iter().flatten().map(Vec::len).sum()
    }

    pub(super) fn encode(&self) -> Vec<u8> {
        let kind = KINDS.iter().position(|kind| *kind == self.kind).unwrap_or_default() as u8;
        let flags = u8::from(self.ack) | u8::from(self.ascii) << 1;
        let mut out = vec![MAGIC, kind, self.src, self.dst, self.rate, flags, self.frame_count];
        out.extend([self.header_version, self.number]);
        out.extend(crc16(&out).to_be_bytes());
        for frame in self.frames.iter().flatten() {
            out.extend((frame.len() as u16).to_be_bytes());
            out.extend(frame);
            out.extend(crc16(frame).to_be_bytes());
        }
        out
    }

    /// `None` if the header is damaged; frames behind a damaged length are missing.
    pub(super) fn decode(bytes: &[u8]) -> Option<Self> {
        let (header, mut rest) = bytes.split_at_checked(HEADER_BYTES)?;
        let (checked, crc) = header.split_at_checked(HEADER_BYTES - 2)?;
        let [MAGIC, kind, src, dst, rate, flags, frame_count, header_version, number] = checked else { return None };
        if crc != crc16(checked).to_be_bytes() {
            return None;
        }
        let mut frames = Vec::new();
        while let [l1, l0, after @ ..] = rest {
            let length = usize::from(u16::from_be_bytes([*l1, *l0]));
            let Some((frame, after)) = after.split_at_checked(length) else { break };
            let Some((crc, after)) = after.split_at_checked(2) else { break };
            frames.push((crc == crc16(frame).to_be_bytes()).then(|| frame.to_vec()));
            rest = after;
        }
        Some(Self {
            kind: *KINDS.get(usize::from(*kind))?,
            src: *src,
            dst: *dst,
            rate: *rate,
            ack: flags & 1 != 0,
            ascii: flags & 2 != 0,
            frame_count: *frame_count,
            header_version: *header_version,
            number: *number,
            frames,
        })
    }
}

/// Frames and airtime of a packet at one rate, in a band of 5 kHz.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct PacketRate {
    pub number: u8,
    pub max_frames: u8,
    pub frame_bytes: usize,
    /// Airtime of a packet with all its frames, ms.
    full_ms: u64,
}

const fn rate(number: u8, max_frames: u8, frame_bytes: usize, full_ms: u64) -> PacketRate {
    PacketRate { number, max_frames, frame_bytes, full_ms }
}

const RATES: [PacketRate; 7] = [
    rate(0, 1, 32, 3200),
    rate(1, 3, 64, 3100),
    rate(2, 3, 64, 3100),
    rate(3, 2, 256, 3400),
    rate(4, 2, 256, 3150),
    rate(5, 8, 256, 3050),
    rate(6, 6, 32, 3250),
];

/// Probe and header of a PSK packet, ms.
const PSK_START_MS: u64 = 250;
/// A cycle-init, ping or user minipacket, FH-FSK.
pub(super) const FSK_MINI: Duration = Duration::from_millis(900);
/// An acknowledgement after a PSK packet.
pub(super) const PSK_MINI: Duration = Duration::from_millis(500);

impl PacketRate {
    /// `None` for a number above 6.
    pub(super) fn of(number: u8) -> Option<Self> {
        RATES.get(usize::from(number)).copied()
    }

    pub(super) fn is_fsk(&self) -> bool {
        self.number == 0
    }

    /// Airtime of a packet of `frames` frames; a frame takes the same time however full it is.
    pub(super) fn airtime(&self, frames: u8) -> Duration {
        let start = if self.is_fsk() { 0 } else { PSK_START_MS };
        let per_frame = (self.full_ms - start) / u64::from(self.max_frames);
        Duration::from_millis(start + per_frame * u64::from(frames))
    }

    /// Packet type in the statistics: 1 FSK, 3 PSK.
    pub(super) fn packet_type(&self) -> u8 {
        if self.is_fsk() { 1 } else { 3 }
    }
}

/// Bytes that fit into the minipacket of a flexible data packet, at its rates 1, 3 and 5.
pub(super) fn flexible_mini_bytes(rate: u8) -> Option<usize> {
    match rate {
        1 => Some(64),
        3 => Some(60),
        5 => Some(55),
        _ => None,
    }
}

/// Maximal bytes of a flexible data packet beyond its minipacket, and the bytes of each frame there.
pub(super) fn flexible_data(rate: u8) -> (usize, usize) {
    match rate {
        1 => (192, 64),
        3 => (100, 100),
        _ => (2048, 256),
    }
}

/// Airtime of a flexible data packet: start, and minipacket and data in proportion to their length.
pub(super) fn flexible_airtime(rate: u8, mini: usize, data: usize) -> Duration {
    let bits_per_second = match rate {
        1 => 500,
        3 => 1200,
        _ => 5300,
    };
    Duration::from_millis(PSK_START_MS + (mini + data) as u64 * 8000 / bits_per_second)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn packet() -> Packet {
        let frames = vec![Some(vec![1, 2, 3]), Some(vec![]), Some(vec![9; 64])];
        Packet {
            rate: 5,
            ack: true,
            frame_count: 3,
            header_version: 1,
            number: 7,
            frames,
            ..Packet::new(PacketKind::Data, 1, 2)
        }
    }

    #[test]
    fn every_kind_comes_back() {
        for kind in KINDS {
            let packet = Packet { kind, ..packet() };
            assert_eq!(Packet::decode(&packet.encode()), Some(packet));
        }
    }

    #[test]
    fn damage_is_found_frame_by_frame() {
        let mut bytes = packet().encode();
        bytes[HEADER_BYTES + 2] ^= 1;
        let damaged = Packet::decode(&bytes).expect("header");
        assert_eq!(damaged.frames[0], None);
        assert_eq!(damaged.frames[1..], packet().frames[1..]);
        bytes[4] ^= 1;
        assert_eq!(Packet::decode(&bytes), None);
    }

    #[test]
    fn truncated_packets_are_survived() {
        let bytes = packet().encode();
        for len in 0..bytes.len() {
            assert!(Packet::decode(&bytes[..len]).is_none_or(|packet| packet.frames.len() < 3));
        }
    }

    #[test]
    fn frames_are_those_of_the_table() {
        let frames: Vec<_> =
            (0..7).filter_map(PacketRate::of).map(|rate| (rate.max_frames, rate.frame_bytes)).collect();
        assert_eq!(frames, [(1, 32), (3, 64), (3, 64), (2, 256), (2, 256), (8, 256), (6, 32)]);
        assert_eq!(PacketRate::of(7), None);
    }

    #[test]
    fn full_packets_take_about_three_seconds() {
        for number in 0..7 {
            let rate = PacketRate::of(number).expect("rate");
            assert!((2900..3500).contains(&rate.airtime(rate.max_frames).as_millis()), "{number}");
        }
    }
}
