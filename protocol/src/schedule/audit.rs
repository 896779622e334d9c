//! A witness of what went on air, independent of the budget that let it out.

use crate::time::Instant;
use std::collections::VecDeque;
use std::time::Duration;

/// Counts bits on air at the modem's door and keeps the worst window.
#[derive(Debug, Clone)]
pub struct Audit {
    window: Duration,
    recent: VecDeque<(Instant, u64)>,
    recent_bits: u64,
    worst_bits: u64,
    total_bits: u64,
    largest_bits: u64,
    transmissions: u64,
}

impl Audit {
    /// A witness over `window`.
    pub fn new(window: Duration) -> Self {
        Self {
            window,
            recent: VecDeque::new(),
            recent_bits: 0,
            worst_bits: 0,
            total_bits: 0,
            largest_bits: 0,
            transmissions: 0,
        }
    }

    /// A transmission of `bits` began at `now`.
    pub fn record(&mut self, bits: u64, now: Instant) {
        while let Some(&(sent, old)) = self.recent.front()
            && now.since(sent) >= self.window
        {
            self.recent.pop_front();
            self.recent_bits -= old;
        }
        self.recent.push_back((now, bits));
        self.recent_bits += bits;
        self.worst_bits = self.worst_bits.max(self.recent_bits);
        self.total_bits += bits;
        self.largest_bits = self.largest_bits.max(bits);
        self.transmissions += 1;
    }

    /// The window.
    pub fn window(&self) -> Duration {
        self.window
    }

    /// Most bits that began within any window.
    pub fn worst_window_bits(&self) -> u64 {
        self.worst_bits
    }

    /// [`Self::worst_window_bits`] a second of window.
    pub fn worst_window_bps(&self) -> f64 {
        self.worst_bits as f64 / self.window.as_secs_f64()
    }

    /// Bits so far.
    pub fn total_bits(&self) -> u64 {
        self.total_bits
    }

    /// Bits of the largest transmission so far.
    pub fn largest_bits(&self) -> u64 {
        self.largest_bits
    }

    /// Transmissions so far.
    pub fn transmissions(&self) -> u64 {
        self.transmissions
    }
}
