//! Frames in a stream that may lose, change or add bytes.
//!
//! COBS (Cheshire and Baker, 1999) with every byte combined with `+` by exclusive or, so that the delimiter is `+` and
//! occurs nowhere else. There is one delimiter on each side of a frame. `+++AT`, which a modem would interpret as a
//! command, never occurs.

/// Bytes that framing adds at most to a frame of up to 1016 bytes: two delimiters, a code for each 254 bytes.
pub const OVERHEAD_BYTES: u64 = 7;

pub const DELIMITER: u8 = b'+';

/// A frame between two delimiters.
pub fn encode(frame: &[u8]) -> Vec<u8> {
    let mut out = Vec::with_capacity(frame.len() + frame.len() / 254 + 3);
    out.push(DELIMITER);
    for group in frame.split(|&b| b == 0) {
        let mut rest = group;
        while rest.len() >= 254 {
            let (block, tail) = rest.split_at(254);
            out.push(255 ^ DELIMITER);
            out.extend(block.iter().map(|b| b ^ DELIMITER));
            rest = tail;
        }
        out.push((rest.len() as u8 + 1) ^ DELIMITER);
        out.extend(rest.iter().map(|b| b ^ DELIMITER));
    }
    out.push(DELIMITER);
    out
}

/// Finds frames in a stream.
#[derive(Debug)]
pub struct Deframer {
    collected: Vec<u8>,
    most: usize,
    overlong: bool,
}

impl Deframer {
    /// Finds frames of at most `most` bytes.
    pub fn new(most: usize) -> Self {
        Self { collected: Vec::new(), most: most + most / 254 + 2, overlong: false }
    }

    /// Takes bytes of the stream; calls `found` for each frame. Invalid bytes are skipped up to the next delimiter.
    pub fn push(&mut self, bytes: &[u8], mut found: impl FnMut(Vec<u8>)) {
        for &byte in bytes {
            if byte != DELIMITER {
                self.overlong |= self.collected.len() >= self.most;
                if !self.overlong {
                    self.collected.push(byte ^ DELIMITER);
                }
                continue;
            }
            if !self.overlong
                && let Some(frame) = decode(&self.collected).filter(|f| !f.is_empty())
            {
                found(frame);
            }
            self.collected.clear();
            self.overlong = false;
        }
    }
}

fn decode(mut block: &[u8]) -> Option<Vec<u8>> {
    let mut out = Vec::with_capacity(block.len());
    while let Some((&length, rest)) = block.split_first() {
        let (data, rest) = rest.split_at_checked(usize::from(length).checked_sub(1)?)?;
        out.extend_from_slice(data);
        if length < 255 && !rest.is_empty() {
            out.push(0);
        }
        block = rest;
    }
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn deframe(stream: &[u8], most: usize) -> Vec<Vec<u8>> {
        let mut frames = Vec::new();
        Deframer::new(most).push(stream, |f| frames.push(f));
        frames
    }

    proptest! {
        #[test]
        fn frames_come_back_and_no_modem_command_is_ever_sent(
            frames in proptest::collection::vec(proptest::collection::vec(prop_oneof![Just(0u8), Just(b'+'), any::<u8>()], 1..700), 1..5),
        ) {
            let stream: Vec<u8> = frames.iter().flat_map(|f| encode(f)).collect();
            prop_assert!(!stream.windows(3).any(|w| w == b"+++"));
            prop_assert_eq!(deframe(&stream, 700), frames);
        }

        #[test]
        fn the_frame_after_garbage_is_found(
            garbage in proptest::collection::vec(any::<u8>(), 0..3000), frame in proptest::collection::vec(any::<u8>(), 1..300),
        ) {
            let stream = [garbage, encode(&frame)].concat();
            let found = deframe(&stream, 300);
            prop_assert_eq!(found.last(), Some(&frame));
        }
    }

    #[test]
    fn long_runs_without_a_zero_are_split_and_joined() {
        for n in [253, 254, 255, 508, 509, 1024] {
            let frame = vec![7; n];
            assert_eq!(deframe(&encode(&frame), 1024), [frame]);
        }
    }
}
