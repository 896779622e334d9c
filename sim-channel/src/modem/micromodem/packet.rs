//! What Micromodem emulators say to each other. The layout is this crate's own.
//!
//! ```text
//! byte 0  magic 0xCA   1 kind   2 source   3 destination   4 rate   5 flags (1: ack, 2: ascii)   6 frames
//!      7  header version (`psk.packet.mod_hdr_version`)    8 unique number
//!      9-10 CRC-16 of bytes 0..9
//! then for each frame: 2 bytes length, bytes, 2 bytes CRC-16 of the bytes
//! ```

use crate::modem::emulator::crc::crc16;

/// A packet on air.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Packet {
    pub kind: Kind,
    pub src: u8,
    pub dst: u8,
    pub rate: u8,
    pub ack: bool,
    pub ascii: bool,
    /// For a cycle init, the number of frames asked for; else the number that follows.
    pub frame_count: u8,
    pub header_version: u8,
    pub number: u8,
    /// `None` for a frame whose bytes were damaged.
    pub frames: Vec<Option<Vec<u8>>>,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Kind {
    /// Minipacket before an FSK packet, or a request for an uplink.
    CycleInit,
    /// Frames of data.
    Data,
    /// One frame that holds the numbers of frames received.
    Ack,
    /// Flexible data: the first frame is the minipacket's part.
    Flexible,
    Ping,
    PingReply,
    /// 13 bits in one frame.
    User,
}

const KINDS: [Kind; 7] =
    [Kind::CycleInit, Kind::Data, Kind::Ack, Kind::Flexible, Kind::Ping, Kind::PingReply, Kind::User];
const MAGIC: u8 = 0xCA;
const HEADER_BYTES: usize = 11;

impl Packet {
    pub(super) fn new(kind: Kind, src: u8, dst: u8) -> Self {
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

    /// Whether it is modulated as PSK.
    pub(super) fn is_psk(&self) -> bool {
        match self.kind {
            Kind::Data | Kind::Ack => self.rate > 0,
            Kind::Flexible => true,
            Kind::CycleInit | Kind::Ping | Kind::PingReply | Kind::User => false,
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

    /// `None` if the header is not whole; frames beyond damage in a length are missing.
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
            ..Packet::new(Kind::Data, 1, 2)
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
    fn damage_is_told_frame_by_frame() {
        let mut bytes = packet().encode();
        bytes[HEADER_BYTES + 2] ^= 1;
        let damaged = Packet::decode(&bytes).expect("header");
        assert_eq!(damaged.frames[0], None);
        assert_eq!(damaged.frames[1..], packet().frames[1..]);
        bytes[4] ^= 1;
        assert_eq!(Packet::decode(&bytes), None);
    }

    #[test]
    fn cut_bytes_are_survived() {
        let bytes = packet().encode();
        for len in 0..bytes.len() {
            assert!(Packet::decode(&bytes[..len]).is_none_or(|packet| packet.frames.len() < 3));
        }
    }
}
