//! How many symbols to send so that enough of them arrive.

/// Standard deviations that are covered ahead, for one group of blocks that share their losses.
const MARGIN: f64 = 0.5;

/// The rule by which symbols are sent ahead of their losses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Supply {
    /// The share of symbols that arrive.
    arrive: f64,
    /// Symbols of a block that are lost together.
    run: f64,
    /// Margin of the plan in standard deviations.
    margin: f64,
}

impl Supply {
    /// For a link that loses `loss` of its frames (0..=0.95), each with `run` symbols dealt to `blocks` blocks.
    pub(super) fn new(loss: f64, run: usize, blocks: usize) -> Self {
        // Blocks that no frame covers together fail independently: the more of them, the larger the margin.
        let groups = blocks.div_ceil(run.max(1)).max(1);
        let margin = MARGIN * f64::from(usize::BITS - groups.leading_zeros());
        Self { arrive: 1.0 - loss, run: (run as f64 / blocks as f64).max(1.0), margin }
    }

    /// The number of symbols of a block to have in flight when `missing` must arrive.
    ///
    /// The mean number of arrivals less the margin equals the missing symbols. Beyond `missing`, only whole runs are
    /// added, because less than a frame changes little. On a link without losses the result is `missing`.
    pub(super) fn in_flight(&self, missing: usize) -> usize {
        let lost = 1.0 - self.arrive;
        if lost <= 0.0 || missing == 0 {
            return missing;
        }
        let missing = missing as f64;
        let deviation = self.margin * (self.run * self.arrive * lost).sqrt();
        let root = (deviation + (deviation * deviation + 4.0 * self.arrive * missing).sqrt()) / (2.0 * self.arrive);
        let extra = (root * root - missing).max(0.0);
        (missing + (extra / self.run).floor() * self.run).ceil() as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lossless_link_sends_exactly_the_missing_symbols() {
        let supply = Supply::new(0.0, 11, 2);
        assert!((0..200).all(|n| supply.in_flight(n) == n));
    }

    #[test]
    fn more_is_sent_ahead_where_more_is_lost() {
        let ahead = |loss: f64| Supply::new(loss, 4, 1).in_flight(64);
        assert_eq!([0.0, 0.1, 0.3, 0.5, 0.9].map(ahead), [64, 72, 96, 136, 720]);
    }

    #[test]
    fn a_single_frame_is_not_doubled_by_small_losses() {
        let supply = Supply::new(0.3, 12, 1);
        assert_eq!([1, 6, 12].map(|n| supply.in_flight(n)), [1, 6, 12]);
    }
}
