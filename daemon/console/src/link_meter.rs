//! Bits on air over time, as the surface sees them.

use super::state::Rates;
use scenecast_protocol::schedule::Audit;
use scenecast_protocol::time::Instant;
use std::collections::VecDeque;
use std::time::Duration;

/// Seconds that a point of the history stands for.
const POINT_S: u64 = 5;
/// Points of the history that are kept.
const POINTS: usize = 240;

/// Counts what the surface sends and hears.
#[derive(Debug)]
pub struct LinkMeter {
    window: Duration,
    audits: [Audit; 2],
    /// Bits up and down by point of time.
    history: VecDeque<(u64, [u64; 2])>,
}

impl LinkMeter {
    /// A meter with the window of the budget.
    pub fn new(window: Duration) -> Self {
        Self { window, audits: [Audit::new(window), Audit::new(window)], history: VecDeque::new() }
    }

    /// A frame of `bits` was heard from a vehicle.
    pub fn heard(&mut self, bits: u64, now: Instant) {
        self.count(0, bits, now);
    }

    /// A frame of `bits` was sent.
    pub fn sent(&mut self, bits: u64, now: Instant) {
        self.count(1, bits, now);
    }

    fn count(&mut self, direction: usize, bits: u64, now: Instant) {
        self.audits[direction].record(bits, now);
        let point = now.as_secs_f64() as u64 / POINT_S;
        if self.history.back().is_none_or(|(p, _)| *p != point) {
            self.history.push_back((point, [0; 2]));
            if self.history.len() > POINTS {
                self.history.pop_front();
            }
        }
        if let Some((_, bits_of_point)) = self.history.back_mut() {
            bits_of_point[direction] += bits;
        }
    }

    /// Mean rate of the last minute, up (0) or down (1).
    pub fn bps_1min(&self, direction: usize, now: Instant) -> f64 {
        let first = (now.as_secs_f64() as u64).saturating_sub(60) / POINT_S;
        let bits: u64 = self.history.iter().filter(|(p, _)| *p > first).map(|(_, b)| b[direction]).sum();
        bits as f64 / now.as_secs_f64().clamp(1.0, 60.0)
    }

    /// Worst window so far, up (0) or down (1), bits a second.
    pub fn worst_window_bps(&self, direction: usize) -> f64 {
        self.audits[direction].worst_window_bps()
    }

    /// Seconds of the window.
    pub fn window_s(&self) -> f64 {
        self.window.as_secs_f64()
    }

    /// The history for the page.
    pub fn history(&self) -> Vec<Rates> {
        let rate = |bits: u64| bits as f64 / POINT_S as f64;
        let point = |(p, b): &(u64, [u64; 2])| Rates { t_s: p * POINT_S, up_bps: rate(b[0]), down_bps: rate(b[1]) };
        self.history.iter().map(point).collect()
    }
}
