//! What S2C emulators say to each other. The layout is this crate's own; real S2C waveforms are not public.
//!
//! ```text
//! byte 0     magic 0xE5
//!      1     kind
//!      2     source address          3     destination address (255: everybody)
//!      4     highest address         5     carrier waveform
//!      6- 7  packet time, ms         8     protocol id
//!      9     flag or session        10     packets that follow
//!     11-14  sequence number         15-22 bit map of packets held beyond the sequence number
//!     23     protocol id and 24 length of a piggyback message (0: none)
//!     25-26  CRC-16 of bytes 0..25
//!     27-    piggyback message, then payload; unprotected, so that corruption can slip past
//! ```

use crate::modem::crc::crc16;

/// Who a frame is for, what it is, and what it carries.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct Frame {
    pub kind: Kind,
    pub src: u8,
    pub dst: u8,
    pub network: Network,
    pub pid: u8,
    pub tag: u8,
    pub follow: u8,
    pub seq: u32,
    pub held: u64,
    pub piggyback: Option<(u8, Vec<u8>)>,
    pub payload: Vec<u8>,
}

/// What must be equal, or fit, for two modems to hear each other.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Network {
    pub highest: u8,
    pub carrier: u8,
    pub packet_ms: u16,
}

impl Network {
    /// Carriers go 0 with 1, 2 with 2, 3 with 3.
    pub(super) fn hears(&self, other: &Network) -> bool {
        let carriers = matches!((self.carrier, other.carrier), (0, 1) | (1, 0) | (2, 2) | (3, 3));
        carriers && self.highest == other.highest && self.packet_ms == other.packet_ms
    }
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Kind {
    /// Instant message: tag 0 ack, 1 noack, 2 force.
    Instant,
    /// Acknowledges an instant message.
    InstantAck,
    /// Synchronous instant message: seq is the sender's clock, us.
    Synchronous,
    /// Asks for a connection: tag is the session.
    Request,
    /// Grants it.
    Answer,
    /// A data packet of a train.
    Packet,
    /// Opens a turn: seq is the first packet missing, held those beyond it.
    Turn,
    /// Ends the connection.
    Close,
}

const KINDS: [Kind; 8] = [
    Kind::Instant,
    Kind::InstantAck,
    Kind::Synchronous,
    Kind::Request,
    Kind::Answer,
    Kind::Packet,
    Kind::Turn,
    Kind::Close,
];

const MAGIC: u8 = 0xE5;
const HEADER_BYTES: usize = 27;

impl Frame {
    pub(super) fn encode(&self) -> Vec<u8> {
        let kind = KINDS.iter().position(|kind| *kind == self.kind).unwrap_or_default() as u8;
        let Network { highest, carrier, packet_ms } = self.network;
        let (pbm_pid, pbm) = self.piggyback.as_ref().map_or((0, &[][..]), |(pid, bytes)| (*pid, &bytes[..]));
        let mut out = vec![MAGIC, kind, self.src, self.dst, highest, carrier];
        out.extend(packet_ms.to_be_bytes());
        out.extend([self.pid, self.tag, self.follow]);
        out.extend(self.seq.to_be_bytes());
        out.extend(self.held.to_be_bytes());
        out.extend([pbm_pid, pbm.len() as u8]);
        out.extend(crc16(&out).to_be_bytes());
        out.extend(pbm);
        out.extend(&self.payload);
        out
    }

    /// `None` if the header is not whole.
    pub(super) fn decode(bytes: &[u8]) -> Option<Self> {
        let (header, rest) = bytes.split_at_checked(HEADER_BYTES)?;
        let (checked, crc) = header.split_at_checked(HEADER_BYTES - 2)?;
        if crc != crc16(checked).to_be_bytes() {
            return None;
        }
        let [MAGIC, kind, src, dst, highest, carrier, p1, p0, pid, tag, follow, numbers @ ..] = checked else {
            return None;
        };
        let (seq, numbers) = numbers.split_first_chunk::<4>()?;
        let (held, pbm) = numbers.split_first_chunk::<8>()?;
        let [pbm_pid, pbm_len] = pbm else { return None };
        let (piggyback, payload) = rest.split_at_checked(usize::from(*pbm_len))?;
        Some(Self {
            kind: *KINDS.get(usize::from(*kind))?,
            src: *src,
            dst: *dst,
            network: Network { highest: *highest, carrier: *carrier, packet_ms: u16::from_be_bytes([*p1, *p0]) },
            pid: *pid,
            tag: *tag,
            follow: *follow,
            seq: u32::from_be_bytes(*seq),
            held: u64::from_be_bytes(*held),
            piggyback: (*pbm_len > 0).then(|| (*pbm_pid, piggyback.to_vec())),
            payload: payload.to_vec(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame() -> Frame {
        Frame {
            kind: Kind::Turn,
            src: 3,
            dst: 9,
            network: Network { highest: 14, carrier: 2, packet_ms: 750 },
            pid: 1,
            tag: 77,
            follow: 4,
            seq: 70_000,
            held: 0b101,
            piggyback: Some((2, b"hello".to_vec())),
            payload: vec![1, 2, 3],
        }
    }

    #[test]
    fn every_kind_comes_back() {
        for kind in KINDS {
            let frame = Frame { kind, ..frame() };
            assert_eq!(Frame::decode(&frame.encode()), Some(frame));
        }
    }

    #[test]
    fn a_damaged_header_is_refused_and_damaged_payload_slips_past() {
        let bytes = frame().encode();
        for byte in 0..HEADER_BYTES {
            let mut bad = bytes.clone();
            bad[byte] ^= 4;
            assert_eq!(Frame::decode(&bad), None);
        }
        let mut bad = bytes.clone();
        bad[HEADER_BYTES] ^= 4;
        assert!(Frame::decode(&bad).is_some());
        assert!((0..bytes.len()).all(|len| Frame::decode(&bytes[..len]).is_none_or(|f| f.payload.len() < 3)));
    }

    #[test]
    fn carriers_pair_as_the_manual_says() {
        let on = |carrier| Network { highest: 14, carrier, packet_ms: 500 };
        assert!(on(0).hears(&on(1)) && on(2).hears(&on(2)) && !on(0).hears(&on(0)) && !on(2).hears(&on(3)));
        assert!(!on(2).hears(&Network { highest: 30, ..on(2) }));
    }
}
