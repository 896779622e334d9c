//! Probabilities and their logits in integers, so that every CPU computes the same.

use std::sync::LazyLock;

/// Logits are in 1/256 of a binary order of magnitude, and lie between minus and plus this.
pub(super) const MAX_LOGIT: i32 = 4095;

/// log2 of 1 + i/256, in 1/256.
const MANTISSA: [u8; 256] = {
    let mut table = [0u8; 256];
    let mut i = 0;
    while i < 256 {
        // Eight squarings yield eight bits of the logarithm.
        let mut x = (256 + i as u64) << 22;
        let mut bits = 0u16;
        let mut step = 0;
        while step < 9 {
            x = (x * x) >> 30;
            bits <<= 1;
            if x >= 1 << 31 {
                bits |= 1;
                x >>= 1;
            }
            step += 1;
        }
        let rounded = (bits + 1) >> 1;
        table[i] = if rounded > 255 { 255 } else { rounded as u8 };
        i += 1;
    }
    table
};

/// log2 of `x` in 1/256; `x` must be at least 1.
pub(super) fn log2(x: u32) -> i32 {
    let top = 31 - x.leading_zeros() as i32;
    let fraction = ((u64::from(x) << 8 >> top) & 255) as usize;
    top * 256 + i32::from(MANTISSA[fraction])
}

/// The logit of a probability in 1/2^32.
pub(super) fn logit(p: u32) -> i32 {
    (log2(p.max(1)) - log2((u32::MAX - p).max(1))).clamp(-MAX_LOGIT, MAX_LOGIT)
}

static PROBABILITY: LazyLock<Vec<u16>> = LazyLock::new(|| {
    let of = |p: u32| logit(p << 16 | 0x8000);
    let mut p = 1;
    let table = (-MAX_LOGIT..=MAX_LOGIT).map(|logit| {
        while p < 65_535 && of(p) < logit {
            p += 1;
        }
        p as u16
    });
    table.collect()
});

/// The probability in 1/65536, from 1 to 65535, of a logit.
pub(super) fn probability(logit: i32) -> u32 {
    let at = (logit.clamp(-MAX_LOGIT, MAX_LOGIT) + MAX_LOGIT) as usize;
    PROBABILITY.get(at).map_or(32_768, |&p| u32::from(p))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn logit_and_probability_are_inverse() {
        for p in [1u32, 2, 9, 100, 3000, 32_768, 60_000, 65_500, 65_534] {
            let back = probability(logit(p << 16 | 0x8000));
            assert!(back.abs_diff(p) <= 1 + p.min(65_536 - p) / 100, "{p} came back as {back}");
        }
        assert_eq!(log2(1), 0);
        assert_eq!(log2(1 << 20), 20 * 256);
        assert!((log2(3) - 406).abs() <= 1);
    }
}
