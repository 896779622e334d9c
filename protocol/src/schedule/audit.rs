//! An independent check of the bits on air.

use crate::time::Instant;
use std::collections::VecDeque;
use std::time::Duration;

/// Counts bits on air where frames enter the modem, and keeps the largest sum of any window. It shares
/// no code with the budget.
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
    /// An audit over windows of this length.
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

    /// Counts a transmission of `bits` that begins at `now`.
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

    /// The length of the window.
    pub fn window(&self) -> Duration {
        self.window
    }

    /// The most bits that began within any window.
    pub fn worst_window_bits(&self) -> u64 {
        self.worst_bits
    }

    /// [`Self::worst_window_bits`] divided by the window, in bit/s.
    pub fn worst_window_bps(&self) -> f64 {
        self.worst_bits as f64 / self.window.as_secs_f64()
    }

    /// Bits on air since the beginning.
    pub fn total_bits(&self) -> u64 {
        self.total_bits
    }

    /// Bits on air of the largest transmission.
    pub fn largest_bits(&self) -> u64 {
        self.largest_bits
    }

    /// The number of transmissions since the beginning.
    pub fn transmissions(&self) -> u64 {
        self.transmissions
    }
}
