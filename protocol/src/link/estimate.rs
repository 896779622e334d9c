//! Estimates of the channel's quality, from recent frames.

use crate::time::Instant;
use std::time::Duration;

/// The recent share of lost frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Loss {
    share: f64,
    frames: u32,
}

impl Default for Loss {
    fn default() -> Self {
        Self { share: 0.0, frames: 0 }
    }
}

impl Loss {
    const MEMORY: u32 = 64;
    /// The loss that is assumed before the first frame.
    const PRIOR: f64 = 0.1;

    /// Counts a frame as lost or received.
    pub fn count(&mut self, lost: bool) {
        self.frames = (self.frames + 1).min(Self::MEMORY);
        self.share += (f64::from(u8::from(lost)) - self.share) / f64::from(self.frames);
    }

    /// The share in 0..=1; 0 before the first count.
    pub fn share(&self) -> f64 {
        self.share
    }

    /// The share to plan with: the assumed loss gives way to the measured one as frames are counted.
    pub fn expected(&self) -> f64 {
        const WEIGHT: f64 = 8.0;
        let n = f64::from(self.frames);
        (self.share * n + Self::PRIOR * WEIGHT) / (n + WEIGHT)
    }

    /// The number of copies to send so that all of them are lost with at most probability `risk`; at most `most`.
    pub fn copies(&self, risk: f64, most: u32) -> u32 {
        let loss = self.expected().clamp(1e-6, 0.99);
        ((risk.ln() / loss.ln()).ceil() as u32).clamp(1, most)
    }
}

/// The recent rate of useful bits.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Goodput {
    bits: f64,
    counted: Instant,
}

impl Goodput {
    /// Time constant of the smoothing.
    const MEMORY: Duration = Duration::from_secs(60);

    /// Counts useful bytes that went through at `now`.
    pub fn count(&mut self, bytes: usize, now: Instant) {
        self.bits = self.left(now) + bytes as f64 * 8.0;
        self.counted = self.counted.max(now);
    }

    /// The smoothed rate in bit/s; it decays while no bytes are counted.
    pub fn bits_per_s(&self, now: Instant) -> f64 {
        self.left(now) / Self::MEMORY.as_secs_f64()
    }

    fn left(&self, now: Instant) -> f64 {
        self.bits * (-now.since(self.counted).as_secs_f64() / Self::MEMORY.as_secs_f64()).exp()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_copies_go_out_where_more_is_lost() {
        let copies = |lost_of_ten: u32| {
            let mut loss = Loss::default();
            (0..200).for_each(|i| loss.count(i % 10 < lost_of_ten));
            loss.copies(0.03, 6)
        };
        assert_eq!([copies(0), copies(1), copies(3), copies(5)], [1, 2, 3, 5]);
    }

    #[test]
    fn goodput_follows_a_steady_stream_and_fades_without_one() {
        let mut rate = Goodput::default();
        let at = |s: u64| Instant::from_micros(s * 1_000_000);
        (0..600).for_each(|s| rate.count(125, at(s)));
        assert!((rate.bits_per_s(at(600)) - 1000.0).abs() < 20.0);
        assert!(rate.bits_per_s(at(900)) < 10.0);
    }
}
