//! Binary arithmetic coding with 16-bit probabilities; not a bit is wasted at the end.

use super::stage::{Contexts, StageLayout};
use crate::bytes::{BitReader, BitWriter};

/// Codes one decision at a time. An encoder writes `bit`, a decoder ignores it, and both return the decision.
pub(super) trait BitCoder {
    /// `one` is the probability of `true` in 1/65536, from 1 to 65535.
    fn code(&mut self, bit: bool, one: u32) -> bool;

    /// The next decisions are those of the cell at this column and row of the patch.
    fn begin_cell(&mut self, _: (usize, usize)) {}

    /// The next decision is of this kind; one with a fixed probability has no contexts.
    fn begin(&mut self, _kind: &'static str, _: Option<(&StageLayout, &Contexts)>) {}
}

/// Width of the window on the code value in bits.
const WINDOW: u32 = 32;

/// The interval that the decisions so far leave: `low..low + range` in units of the window.
#[derive(Debug, Clone, Copy)]
struct Interval {
    low: u64,
    range: u64,
}

impl Interval {
    const START: Self = Self { low: 0, range: 1 << WINDOW };

    /// Narrows the interval to the part of `bit`; the lower part stands for `true`.
    fn narrow(&mut self, bit: bool, split: u64) {
        if bit {
            self.range = split;
        } else {
            self.low += split;
            self.range -= split;
        }
    }

    fn split(&self, one: u32) -> u64 {
        (self.range >> 16) * u64::from(one)
    }

    /// The number inside that needs the fewest leading bits, followed by zeros, and the number of these bits.
    fn shortest(&self) -> (u64, u32) {
        let candidates = (0..=WINDOW).map(|bits| {
            let step = 1u64 << (WINDOW - bits);
            (self.low.next_multiple_of(step), bits)
        });
        candidates.into_iter().find(|(value, _)| value - self.low < self.range).unwrap_or((self.low, WINDOW))
    }
}

#[derive(Debug)]
pub(super) struct Encoder {
    out: BitWriter,
    interval: Interval,
}

impl Encoder {
    /// Continues after the bits in `out`.
    pub(super) fn new(out: BitWriter) -> Self {
        Self { out, interval: Interval::START }
    }

    /// The length of the chunk in bits if it ended here.
    pub(super) fn bits(&self) -> usize {
        self.out.len() + self.interval.shortest().1 as usize
    }

    /// The bytes, which end with the shortest string that stands for all decisions.
    pub(super) fn finish(mut self) -> Vec<u8> {
        let (value, bits) = self.interval.shortest();
        self.interval.low = value;
        for _ in 0..bits {
            self.shift();
        }
        self.carry();
        self.out.into_bytes()
    }

    fn carry(&mut self) {
        if self.interval.low >> WINDOW != 0 {
            self.out.increment();
            self.interval.low &= (1 << WINDOW) - 1;
        }
    }

    fn shift(&mut self) {
        self.carry();
        self.out.bit(self.interval.low >> (WINDOW - 1) & 1 == 1);
        self.interval.low = self.interval.low << 1 & ((1 << WINDOW) - 1);
        self.interval.range <<= 1;
    }
}

impl BitCoder for Encoder {
    fn code(&mut self, bit: bool, one: u32) -> bool {
        self.interval.narrow(bit, self.interval.split(one));
        while self.interval.range <= 1 << (WINDOW - 1) {
            self.shift();
        }
        bit
    }
}

/// Reads decisions; bits past the end are zero.
#[derive(Debug)]
pub(super) struct Decoder<'a> {
    bits: BitReader<'a>,
    interval: Interval,
    /// The code value above the interval's lower end.
    above: u64,
    /// Bits of the code value that have left the window.
    shifted: usize,
    start: usize,
}

impl<'a> Decoder<'a> {
    /// Continues at the position of `bits`.
    pub(super) fn new(mut bits: BitReader<'a>) -> Self {
        let start = bits.position();
        let above = (0..WINDOW).fold(0, |value, _| value << 1 | u64::from(bits.bit().unwrap_or(false)));
        Self { bits, interval: Interval::START, above, shifted: 0, start }
    }

    /// Whether the bytes end exactly where and how the encoder ends them after these decisions.
    pub(super) fn ended_well(&self) -> bool {
        let (value, bits) = self.interval.shortest();
        let length = (self.start + self.shifted + bits as usize).div_ceil(8);
        self.above == value - self.interval.low && self.bits.total_bytes() == length
    }
}

impl BitCoder for Decoder<'_> {
    fn code(&mut self, _: bool, one: u32) -> bool {
        let split = self.interval.split(one);
        let bit = self.above < split;
        if !bit {
            self.above -= split;
        }
        self.interval.narrow(bit, split);
        while self.interval.range <= 1 << (WINDOW - 1) {
            self.interval.low = self.interval.low << 1 & ((1 << WINDOW) - 1);
            self.interval.range <<= 1;
            self.above = self.above << 1 | u64::from(self.bits.bit().unwrap_or(false));
            self.shifted += 1;
        }
        bit
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decisions(seed: u32, count: usize) -> Vec<(bool, u32)> {
        let mut state = seed;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            state >> 16
        };
        (0..count).map(|_| (next() % 7 == 0, next().clamp(1, 65_535))).collect()
    }

    #[test]
    fn decisions_read_back_and_wrong_endings_are_refused() {
        for seed in 0..400 {
            let coded = decisions(seed, seed as usize % 97);
            let mut head = BitWriter::default();
            head.put(5, seed % 11);
            let mut encoder = Encoder::new(head);
            for &(bit, one) in &coded {
                encoder.code(bit, one);
            }
            let bits = encoder.bits();
            let bytes = encoder.finish();
            assert_eq!(bytes.len(), bits.div_ceil(8));
            let ends_well = |bytes: &[u8]| {
                let mut reader = BitReader::new(bytes);
                reader.take(seed % 11).expect("head");
                let mut decoder = Decoder::new(reader);
                let right = coded.iter().all(|&(bit, one)| decoder.code(false, one) == bit);
                (right, decoder.ended_well())
            };
            assert_eq!(ends_well(&bytes), (true, true), "seed {seed}");
            let longer: Vec<u8> = bytes.iter().copied().chain([0]).collect();
            assert_eq!(ends_well(&longer), (true, false));
        }
    }
}
