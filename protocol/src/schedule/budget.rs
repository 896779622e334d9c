//! The bit budget of one transmitter, and an independent check of the bits on air.

use crate::time::Instant;
use std::collections::VecDeque;
use std::time::Duration;

/// Releases whole transmissions so that neither any window nor the long run exceeds the budget.
///
/// Two conditions must hold, both in bits on air:
/// * The transmissions that began within the last window add up to less than `rate x window`, so that one more exceeds
///   it by at most its own size.
/// * A token bucket (RFC 2215) as deep as `rate x window`, filled at `rate`, has enough bits. A transmission larger
///   than the bucket needs a full bucket and leaves a debt. This bounds the long-run mean where a transmission is large
///   compared to a window.
///
/// ```
/// use scenecast_protocol::schedule::BitBudget;
/// use scenecast_protocol::time::Instant;
/// use std::time::Duration;
///
/// let mut budget = BitBudget::new(100, Duration::from_secs(10), Instant::ZERO);
/// assert_eq!(budget.earliest(1000, Instant::ZERO), Instant::ZERO, "a full window is free");
/// budget.spend(1000, Instant::ZERO);
/// assert!(budget.earliest(500, Instant::ZERO) >= Instant::from_secs_f64(5.0));
/// ```
#[derive(Debug, Clone)]
pub struct BitBudget {
    bits_per_s: u32,
    window: Duration,
    /// Bits in the bucket, in millionths, so that a rate times microseconds is exact; negative values are a debt.
    tokens: i128,
    filled: Instant,
    recent: VecDeque<(Instant, u64)>,
    recent_bits: u64,
}

impl BitBudget {
    /// A budget of `bits_per_s` over `window`, unused at `now`.
    pub fn new(bits_per_s: u32, window: Duration, now: Instant) -> Self {
        let bits_per_s = bits_per_s.max(1);
        let tokens = i128::from(bits_per_s) * window.as_micros() as i128;
        Self { bits_per_s, window, tokens, filled: now, recent: VecDeque::new(), recent_bits: 0 }
    }

    /// Counts the whole window as used, because a run that has just ended may have sent all that was allowed.
    pub fn assume_spent(&mut self, now: Instant) {
        self.spend((self.capacity() / 1_000_000).max(0) as u64, now);
    }

    /// The rate of the budget in bit/s.
    pub fn bits_per_s(&self) -> u32 {
        self.bits_per_s
    }

    /// The window over which the budget holds.
    pub fn window(&self) -> Duration {
        self.window
    }

    /// Changes the rate from `now` on; earlier transmissions stay counted.
    pub fn set_rate(&mut self, bits_per_s: u32, now: Instant) {
        self.advance(now);
        self.bits_per_s = bits_per_s.max(1);
        self.tokens = self.tokens.min(self.capacity());
    }

    /// The earliest time at which a transmission of `bits` may begin, not before `now`.
    #[must_use]
    pub fn earliest(&self, bits: u64, now: Instant) -> Instant {
        let mut at = now;
        let short = millionths(bits).min(self.capacity()) - self.tokens - self.gained(now);
        if short > 0 {
            let micros = short.div_euclid(i128::from(self.bits_per_s)) + 1;
            at = now + Duration::from_micros(micros as u64);
        }
        let limit = self.capacity();
        let mut sum = millionths(self.recent_bits);
        for &(sent, sent_bits) in &self.recent {
            if sum < limit {
                break;
            }
            at = at.max(sent + self.window);
            sum -= millionths(sent_bits);
        }
        at
    }

    /// Whether less than half of the window's bits were sent in the last window.
    pub fn is_plentiful(&self, now: Instant) -> bool {
        let recent: u64 = self.recent.iter().filter(|(at, _)| now.since(*at) < self.window).map(|(_, bits)| bits).sum();
        millionths(recent) * 2 < self.capacity()
    }

    /// How many of `transmissions`, each with its bits and its start, may go out one after the other.
    pub fn affordable(&self, transmissions: impl IntoIterator<Item = (u64, Instant)>) -> usize {
        let mut trial = self.clone();
        let allowed = transmissions.into_iter().take_while(|&(bits, at)| {
            let ok = trial.earliest(bits, at) <= at;
            trial.spend(bits, at);
            ok
        });
        allowed.count()
    }

    /// The budget as a transmission of `bits` at `now` leaves it.
    #[must_use]
    pub fn after(&self, bits: u64, now: Instant) -> Self {
        let mut rest = self.clone();
        rest.spend(bits, now);
        rest
    }

    /// Counts a transmission that begins at `now`.
    pub fn spend(&mut self, bits: u64, now: Instant) {
        self.advance(now);
        self.tokens -= millionths(bits);
        self.recent.push_back((now, bits));
        self.recent_bits += bits;
    }

    /// Moves the start of the last `transmissions` to `now`, because they were still in the modem until then.
    pub fn handle_delay(&mut self, transmissions: usize, now: Instant) {
        for (at, _) in self.recent.iter_mut().rev().take(transmissions) {
            *at = now;
        }
    }

    fn capacity(&self) -> i128 {
        i128::from(self.bits_per_s) * self.window.as_micros() as i128
    }

    fn gained(&self, now: Instant) -> i128 {
        i128::from(self.bits_per_s) * now.since(self.filled).as_micros() as i128
    }

    fn advance(&mut self, now: Instant) {
        self.tokens = (self.tokens + self.gained(now)).min(self.capacity());
        self.filled = self.filled.max(now);
        while let Some(&(sent, bits)) = self.recent.front()
            && now.since(sent) >= self.window
        {
            self.recent.pop_front();
            self.recent_bits -= bits;
        }
    }
}

fn millionths(bits: u64) -> i128 {
    i128::from(bits) * 1_000_000
}

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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn no_window_exceeds_the_budget_by_more_than_one_transmission(
            rate in 50u32..20_000,
            sizes in proptest::collection::vec((100u64..9000, 0u64..4_000_000), 1..200),
        ) {
            let window = Duration::from_secs(10);
            let mut budget = BitBudget::new(rate, window, Instant::ZERO);
            let mut audit = Audit::new(window);
            let (mut now, mut largest, mut total) = (Instant::ZERO, 0, 0);
            for (bits, pause) in sizes {
                now = budget.earliest(bits, now + Duration::from_micros(pause));
                prop_assert!(budget.earliest(bits, now) <= now);
                budget.spend(bits, now);
                audit.record(bits, now);
                largest = largest.max(bits);
                total += bits;
            }
            let limit = f64::from(rate) * 10.0;
            prop_assert!(audit.worst_window_bits() as f64 <= limit + largest as f64);
            prop_assert!(total as f64 <= f64::from(rate) * (now.as_secs_f64() + 10.0) + largest as f64 + limit);
        }
    }

    #[test]
    fn the_whole_budget_is_used_over_a_long_run() {
        let mut budget = BitBudget::new(100, Duration::from_secs(10), Instant::ZERO);
        let (mut now, mut sent) = (Instant::ZERO, 0);
        while now < Instant::from_secs_f64(3600.0) {
            now = budget.earliest(512, now);
            budget.spend(512, now);
            sent += 512;
        }
        assert!((355_000..=362_000).contains(&sent), "{sent} bits in an hour at 100 bit/s");
    }
}
