//! Rates on air over time at the surface.

use super::state::LinkRates;
use super::surface::Surface;
use scenecast_protocol::schedule::Audit;
use scenecast_protocol::time::Instant;
use std::collections::VecDeque;
use std::time::Duration;

/// Duration of one entry of the history.
const ENTRY_S: u64 = 5;
const MAX_ENTRIES: usize = 240;

/// Counts the bits that the surface sends and receives.
#[derive(Debug)]
pub struct LinkMeter {
    window: Duration,
    began: Instant,
    /// The budgets up and down for which the audits count, bit/s.
    budgets: [u32; 2],
    audits: [Audit; 2],
    /// Bits on air since the meter began, up and down.
    totals: [u64; 2],
    /// The number of each entry, and its bits up and down.
    history: VecDeque<(u64, [u64; 2])>,
}

impl LinkMeter {
    /// A meter with the window of the bit budget, which counts from `began` on.
    pub fn new(window: Duration, began: Instant) -> Self {
        let audits = [Audit::new(window), Audit::new(window)];
        Self { window, began, budgets: [0; 2], audits, totals: [0; 2], history: VecDeque::new() }
    }

    /// Counts the highest rate anew in a direction of which the budget has changed. The bits before the change were within
    /// the earlier budget.
    pub fn handle_budgets(&mut self, surface: &Surface) {
        let reported =
            surface.vehicles().filter_map(|(vehicle, _)| surface.view(vehicle)?.status().map(|s| s.0.budget_bps));
        let budgets = [reported.max().unwrap_or_else(|| surface.budget_bps()), surface.budget_bps()];
        for ((audit, before), now) in self.audits.iter_mut().zip(&self.budgets).zip(budgets) {
            if *before != now {
                *audit = Audit::new(self.window);
            }
        }
        self.budgets = budgets;
    }

    /// Counts a frame of `bits` on air from a vehicle.
    pub fn received(&mut self, bits: u64, now: Instant) {
        self.count(0, bits, now);
    }

    /// Counts a frame of `bits` on air to a vehicle.
    pub fn sent(&mut self, bits: u64, now: Instant) {
        self.count(1, bits, now);
    }

    fn count(&mut self, direction: usize, bits: u64, now: Instant) {
        self.audits[direction].record(bits, now);
        self.totals[direction] += bits;
        let number = now.as_secs_f64() as u64 / ENTRY_S;
        if self.history.back().is_none_or(|(n, _)| *n != number) {
            self.history.push_back((number, [0; 2]));
            if self.history.len() > MAX_ENTRIES {
                self.history.pop_front();
            }
        }
        if let Some((_, entry)) = self.history.back_mut() {
            entry[direction] += bits;
        }
    }

    /// The mean rate of the last minute, bit/s, up (0) or down (1).
    pub fn bps_1min(&self, direction: usize, now: Instant) -> f64 {
        let first = (now.as_secs_f64() as u64).saturating_sub(60) / ENTRY_S;
        let bits: u64 = self.history.iter().filter(|(n, _)| *n > first).map(|(_, b)| b[direction]).sum();
        bits as f64 / self.elapsed_s(now).clamp(1.0, 60.0)
    }

    /// Bits on air since the meter began, up (0) or down (1).
    pub fn total_bits(&self, direction: usize) -> u64 {
        self.totals[direction]
    }

    /// Seconds since the meter began.
    pub fn elapsed_s(&self, now: Instant) -> f64 {
        now.since(self.began).as_secs_f64()
    }

    /// The highest rate in a window of the budget since it last changed, bit/s, up (0) or down (1).
    pub fn max_window_bps(&self, direction: usize) -> f64 {
        self.audits[direction].worst_window_bps()
    }

    /// The window of the budget, seconds.
    pub fn window_s(&self) -> f64 {
        self.window.as_secs_f64()
    }

    /// The rates of the last 20 minutes.
    pub fn history(&self) -> Vec<LinkRates> {
        let rate = |bits: u64| bits as f64 / ENTRY_S as f64;
        let entry = |(n, b): &(u64, [u64; 2])| LinkRates { t_s: n * ENTRY_S, up_bps: rate(b[0]), down_bps: rate(b[1]) };
        self.history.iter().map(entry).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn totals_outlive_the_history() {
        let mut meter = LinkMeter::new(Duration::from_secs(10), Instant::ZERO);
        for minute in 0..60 {
            meter.received(1000, Instant::from_secs_f64(f64::from(minute) * 60.0));
        }
        meter.sent(500, Instant::from_secs_f64(3600.0));
        assert_eq!([meter.total_bits(0), meter.total_bits(1)], [60_000, 500]);
    }
}
