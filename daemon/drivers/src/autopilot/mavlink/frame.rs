//! MAVLink frames in a stream of bytes.
//!
//! ```text
//! version 1: FE length seq system component id(1)                         payload crc(2)
//! version 2: FD length incompatible compatible seq system component id(3) payload crc(2) [signature(13)]
//! ```
//! Numbers are little-endian. The CRC is CRC-16/MCRF4XX over everything between the marker and itself, then over a byte
//! that stands for the layout of the message. Source: <https://mavlink.io/en/guide/serialization.html>.

use crc::{CRC_16_MCRF4XX, Crc};

const CRC: Crc<u16> = Crc::<u16>::new(&CRC_16_MCRF4XX);
const V1: u8 = 0xFE;
const V2: u8 = 0xFD;
/// The only incompatibility that is understood: a signature follows.
const SIGNED: u8 = 1;

/// A frame with a right check.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    pub system: u8,
    pub component: u8,
    pub id: u32,
    /// Its fields; trailing zeros may be missing.
    pub payload: Vec<u8>,
    /// Whether a signature follows, which is not verified. Own frames have none.
    pub is_signed: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Refused {
    /// Frames of a known message with a wrong check.
    pub checksum: u64,
    /// Frames with a feature that is not understood.
    pub incompatible: u64,
    pub garbage: u64,
}

/// Finds frames in a stream.
#[derive(Debug, Default)]
pub struct Deframer {
    held: Vec<u8>,
    refused: Refused,
    /// Whether the held bytes begin where a frame has ended.
    is_aligned: bool,
}

/// The frame at the front of the collected bytes.
enum Front {
    Incomplete,
    /// A frame of so many bytes, `None` if its message is not known.
    Whole(usize, Option<Frame>),
    /// So many bytes that are none.
    Skip(usize),
}

impl Deframer {
    /// Refused bytes so far, by reason.
    pub fn refused(&self) -> Refused {
        self.refused
    }

    pub fn clear(&mut self) {
        self.held.clear();
        self.is_aligned = false;
    }

    /// Takes bytes; calls `found` with each frame of a message whose layout byte `extra` knows.
    pub fn push(&mut self, bytes: &[u8], extra: impl Fn(u32) -> Option<u8>, mut found: impl FnMut(Frame)) {
        // A frame has at most 280 bytes, so no more than these and the new ones are ever held.
        self.held.extend_from_slice(bytes);
        let held = std::mem::take(&mut self.held);
        let mut rest = held.as_slice();
        while !rest.is_empty() {
            match self.front(rest, &extra) {
                Front::Incomplete => break,
                Front::Whole(n, frame) => {
                    self.is_aligned = true;
                    frame.into_iter().for_each(&mut found);
                    rest = rest.get(n..).unwrap_or_default();
                }
                Front::Skip(n) => {
                    self.is_aligned = false;
                    rest = rest.get(n.max(1)..).unwrap_or_default();
                }
            }
        }
        self.held = rest.to_vec();
    }

    fn front(&mut self, rest: &[u8], extra: &impl Fn(u32) -> Option<u8>) -> Front {
        let Some(start) = rest.iter().position(|b| matches!(*b, V1 | V2)) else {
            self.refused.garbage += rest.len() as u64;
            return Front::Skip(rest.len());
        };
        if start > 0 {
            self.refused.garbage += start as u64;
            return Front::Skip(start);
        }
        let byte = |i: usize| rest.get(i).copied();
        let number = |i: usize| byte(i).map(u32::from);
        let is_v2 = byte(0) == Some(V2);
        let head = if is_v2 { 10 } else { 6 };
        let (Some(length), true) = (byte(1), rest.len() >= head) else { return Front::Incomplete };
        let signature = if is_v2 && byte(2).is_some_and(|f| f & SIGNED != 0) { 13 } else { 0 };
        let body = head + usize::from(length);
        let Some(whole) = rest.get(..body + 2 + signature) else { return Front::Incomplete };
        if is_v2 && byte(2).is_some_and(|f| f & !SIGNED != 0) {
            self.refused.incompatible += 1;
            return Front::Skip(1);
        }
        let at = if is_v2 { 5 } else { 3 };
        let id = match is_v2 {
            true => number(7).zip(number(8)).zip(number(9)).map(|((a, b), c)| a | b << 8 | c << 16),
            false => number(5),
        };
        let Some(id) = id else { return Front::Incomplete };
        let Some(extra) = extra(id) else { return self.unknown(whole.len(), rest.get(whole.len())) };
        let told = whole.get(body).zip(whole.get(body + 1)).map(|(&low, &high)| u16::from_le_bytes([low, high]));
        if told != Some(check(whole.get(1..body).unwrap_or_default(), extra)) {
            self.refused.checksum += 1;
            return Front::Skip(1);
        }
        let payload = whole.get(head..body).unwrap_or_default().to_vec();
        let (system, component) = (byte(at).unwrap_or(0), byte(at + 1).unwrap_or(0));
        let frame = Frame { system, component, id, payload, is_signed: signature > 0 };
        Front::Whole(whole.len(), Some(frame))
    }

    /// A frame of an unknown message has a check that cannot be verified, and may be noise that hides other frames: another frame must
    /// be `next`, or nothing behind a frame.
    fn unknown(&mut self, length: usize, next: Option<&u8>) -> Front {
        match next {
            Some(&V1 | &V2) => Front::Whole(length, None),
            None if self.is_aligned => Front::Whole(length, None),
            None => Front::Incomplete,
            Some(_) => {
                self.refused.garbage += 1;
                Front::Skip(1)
            }
        }
    }
}

pub(super) fn check(bytes: &[u8], extra: u8) -> u16 {
    let mut digest = CRC.digest();
    digest.update(bytes);
    digest.update(&[extra]);
    digest.finalize()
}

/// A frame of version 2; trailing zeros of the payload are left out, as the standard asks.
pub fn encode(frame: &Frame, seq: u8, extra: u8) -> Vec<u8> {
    let used = frame.payload.iter().rposition(|b| *b != 0).map_or(1, |i| i + 1).min(frame.payload.len());
    let [a, b, c, _] = frame.id.to_le_bytes();
    let mut out = vec![V2, used as u8, 0, 0, seq, frame.system, frame.component, a, b, c];
    out.extend_from_slice(frame.payload.get(..used).unwrap_or_default());
    let sum = check(out.get(1..).unwrap_or_default(), extra);
    out.extend_from_slice(&sum.to_le_bytes());
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A heartbeat as pymavlink 2.4.50 packs it.
    const HEARTBEAT: &str = "fd09000000ffbe0000000000000006080004033d48";

    fn bytes(hex: &str) -> Vec<u8> {
        (0..hex.len()).step_by(2).map(|i| u8::from_str_radix(&hex[i..i + 2], 16).unwrap()).collect()
    }

    fn extra(id: u32) -> Option<u8> {
        (id == 0).then_some(50)
    }

    #[test]
    fn a_frame_of_pymavlink_is_read_and_written_again() {
        let (mut found, mut deframer) = (Vec::new(), Deframer::default());
        deframer.push(&bytes(HEARTBEAT), extra, |f| found.push(f));
        let payload = vec![0, 0, 0, 0, 6, 8, 0, 4, 3];
        let frame = Frame { system: 255, component: 190, id: 0, payload, is_signed: false };
        assert_eq!(found, std::slice::from_ref(&frame));
        assert_eq!(encode(&frame, 0, 50), bytes(HEARTBEAT));
    }

    #[test]
    fn frames_are_found_after_garbage_and_a_wrong_check_is_counted() {
        let mut wrong = bytes(HEARTBEAT);
        wrong[12] ^= 1;
        let stream = [b"garbage".to_vec(), wrong, bytes(HEARTBEAT), vec![V2, 200]].concat();
        let (mut found, mut deframer) = (0, Deframer::default());
        for piece in stream.chunks(3) {
            deframer.push(piece, extra, |_| found += 1);
        }
        assert_eq!((found, deframer.refused().checksum), (1, 1));
        assert!(deframer.refused().garbage >= 7);
    }

    #[test]
    fn version_one_signed_and_unknown_messages_are_skipped() {
        let mut v1 = vec![V1, 9, 7, 1, 1, 0, 0, 0, 0, 0, 6, 8, 0, 4, 3];
        v1.extend(check(&v1[1..], 50).to_le_bytes());
        let mut signed = bytes(HEARTBEAT);
        signed[2] = SIGNED;
        let sum = check(&signed[1..19], 50).to_le_bytes();
        signed[19..21].copy_from_slice(&sum);
        signed.extend([0xFD; 13]);
        let mut unknown = bytes(HEARTBEAT);
        unknown[7] = 99;
        let (mut found, mut deframer) = (Vec::new(), Deframer::default());
        deframer.push(&[v1, signed, unknown].concat(), extra, |f| found.push(f.system));
        assert_eq!((found, deframer.refused()), (vec![1, 255], Refused::default()));
    }

    #[test]
    fn noise_that_looks_like_an_unknown_frame_hides_nothing() {
        let beats = bytes(HEARTBEAT).repeat(20);
        for noise in [vec![V2], vec![V1], vec![V2, 250, 0, 0], b"x\xFD\xC8\0\0\x01\x01\x01\x09\x09".to_vec()] {
            let (mut found, mut deframer) = (0, Deframer::default());
            deframer.push(&[&bytes(HEARTBEAT)[..], &noise, &beats].concat(), extra, |_| found += 1);
            assert_eq!(found, 21, "{noise:?}");
        }
        let mut unknown = bytes(HEARTBEAT);
        unknown[7] = 99;
        let (mut found, mut deframer) = (0, Deframer::default());
        for datagram in [unknown, bytes(HEARTBEAT), bytes(HEARTBEAT)] {
            deframer.push(&datagram, extra, |_| found += 1);
        }
        assert_eq!((found, deframer.refused()), (2, Refused::default()));
    }

    proptest! {
        #[test]
        fn any_stream_is_accepted_and_at_most_a_frame_is_held(
            pieces in proptest::collection::vec(proptest::collection::vec(prop_oneof![Just(V2), Just(V1), any::<u8>()], 0..400), 0..10),
        ) {
            let mut deframer = Deframer::default();
            for piece in pieces {
                deframer.push(&piece, |_| Some(7), |_| {});
                prop_assert!(deframer.held.len() <= 280);
            }
        }
    }
}
