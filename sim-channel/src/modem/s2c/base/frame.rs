//! The frames between S2C emulators, and measurements of a received one. The layout is this crate's own; real S2C waveforms are
//! not public.
//!
//! ```text
//! byte 0     magic 0xE5
//!      1     kind
//!      2     source address          3     destination address (255: all modems)
//!      4     highest address         5     carrier waveform
//!      6- 7  packet time, ms         8     protocol id
//!      9     flag or session        10     packets that follow
//!     11-14  sequence number         15-22 bit map of packets held beyond the sequence number
//!     23     protocol id and 24 length of a piggyback message (0: none)
//!     25-26  CRC-16 of bytes 0..25
//!     27-    piggyback message, then payload; unprotected, so that corruption can pass
//! ```

use crate::channel::Arrival;
use crate::modem::emulator::board::crc16;
use crate::nodes::NodePosition;
use crate::usbl::UsblFix;
use std::time::Duration;

#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct S2cFrame {
    pub kind: FrameKind,
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

/// Two modems receive each other if these properties match.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Network {
    pub highest: u8,
    pub carrier: u8,
    pub packet_ms: u16,
}

impl Network {
    /// Carrier 0 pairs with 1, 2 with 2, 3 with 3.
    pub(crate) fn receives(&self, other: &Network) -> bool {
        let carriers = matches!((self.carrier, other.carrier), (0, 1) | (1, 0) | (2, 2) | (3, 3));
        carriers && self.highest == other.highest && self.packet_ms == other.packet_ms
    }
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum FrameKind {
    /// Instant message: tag 0 ack, 1 noack, 2 force.
    Instant,
    InstantAck,
    /// Synchronous instant message: seq is the sender's clock, us.
    Synchronous,
    /// Requests a connection: tag is the session.
    Request,
    Grant,
    /// A data packet of a train.
    Packet,
    /// Opens a turn: seq is the first packet missing, held those beyond it.
    Turn,
    Disconnect,
}

const KINDS: [FrameKind; 8] = [
    FrameKind::Instant,
    FrameKind::InstantAck,
    FrameKind::Synchronous,
    FrameKind::Request,
    FrameKind::Grant,
    FrameKind::Packet,
    FrameKind::Turn,
    FrameKind::Disconnect,
];

const MAGIC: u8 = 0xE5;
const HEADER_BYTES: usize = 27;

impl S2cFrame {
    /// A frame without payload; all other fields are 0.
    pub(crate) fn new(kind: FrameKind, src: u8, dst: u8, network: Network) -> Self {
        Self {
            kind,
            src,
            dst,
            network,
            pid: 0,
            tag: 0,
            follow: 0,
            seq: 0,
            held: 0,
            piggyback: None,
            payload: Vec::new(),
        }
    }

    pub(crate) fn encode(&self) -> Vec<u8> {
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

    /// `None` if the header is damaged.
    pub(crate) fn decode(bytes: &[u8]) -> Option<Self> {
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

/// Relative velocity in m/s: the emulator does not differentiate tracks.
pub(crate) const VELOCITY: &str = "0.0000";

/// How a frame was received.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ReceivedSignal {
    pub airtime: Duration,
    pub received_at: Duration,
    pub one_way: Duration,
    /// Received level, dB; -20 within 10 m, -85 at the least.
    pub rssi: i32,
    pub integrity: i32,
    pub sender: NodePosition,
    pub receiver: NodePosition,
}

impl ReceivedSignal {
    pub(crate) fn of(arrival: &Arrival) -> Self {
        let flight = arrival.at.saturating_sub(arrival.sent_at).saturating_sub(arrival.airtime);
        let rssi = -20.0 - 15.0 * (arrival.range_m.max(10.0) / 10.0).log10();
        let rssi = rssi.max(-85.0) as i32;
        Self {
            airtime: arrival.airtime,
            received_at: arrival.at,
            one_way: flight,
            rssi,
            integrity: 230 + rssi,
            sender: arrival.sender,
            receiver: arrival.receiver,
        }
    }
}

/// A USBL fix that the head is still computing.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PendingFix {
    pub remote: u8,
    pub fix: UsblFix,
    pub travel: Duration,
    pub rssi: i32,
    pub integrity: i32,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame() -> S2cFrame {
        S2cFrame {
            kind: FrameKind::Turn,
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
            let frame = S2cFrame { kind, ..frame() };
            assert_eq!(S2cFrame::decode(&frame.encode()), Some(frame));
        }
    }

    #[test]
    fn a_damaged_header_is_refused_and_damaged_payload_slips_past() {
        let bytes = frame().encode();
        for byte in 0..HEADER_BYTES {
            let mut bad = bytes.clone();
            bad[byte] ^= 4;
            assert_eq!(S2cFrame::decode(&bad), None);
        }
        let mut bad = bytes.clone();
        bad[HEADER_BYTES] ^= 4;
        assert!(S2cFrame::decode(&bad).is_some());
        assert!((0..bytes.len()).all(|len| S2cFrame::decode(&bytes[..len]).is_none_or(|f| f.payload.len() < 3)));
    }

    #[test]
    fn carriers_pair_as_the_manual_says() {
        let on = |carrier| Network { highest: 14, carrier, packet_ms: 500 };
        assert!(on(0).receives(&on(1)) && on(2).receives(&on(2)) && !on(0).receives(&on(0)) && !on(2).receives(&on(3)));
        assert!(!on(2).receives(&Network { highest: 30, ..on(2) }));
    }
}
