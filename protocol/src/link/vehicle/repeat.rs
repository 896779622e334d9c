//! Saying again what was said: at the end of a turn, as far as that saves the next one, and at the beginning of a turn, what
//! the surface has not heard of the last. A frame that is sent again is the same frame, byte for byte.

use super::{Said, VehicleLink};
use crate::link::Transmit;
use crate::mac::Access;
use crate::map::StateSource;
use crate::time::Instant;
use std::collections::VecDeque;
use std::time::Duration;

impl<S: StateSource> VehicleLink<S> {
    /// Nothing was said in this turn yet. Where turns are taken, the surface has spoken after the end of our last one: what
    /// it has not judged of that has not reached it, and if this is little, it is said again as it was.
    pub(super) fn begin_turn(&mut self) {
        const FEW: usize = 8;
        let horizon = self.pair.horizon();
        self.said.retain(|s| s.number > horizon);
        self.said_frames = 0;
        let all = self.said.len() as u64 == self.pair.outstanding();
        let repeats = self.config.modem.access == Access::Shared && !self.pair.must_greet();
        if !repeats || self.said.len() > FEW || !all {
            self.said.clear();
        }
        self.repeats = self.said.iter().map(|s| s.bytes.clone()).collect();
    }

    /// What was said is not what would be said now.
    pub(super) fn forget_said(&mut self) {
        self.said.clear();
        self.repeats.clear();
    }

    /// How often a turn of `frames` frames, `bytes` in all, is said where nothing else is left to say: as long as saying it
    /// once more takes less time than the next turn would, times the chance that this makes that one needless. Never where
    /// the budget is what limits the link, or where frames of earlier turns are of unknown fate: then another turn is
    /// needed anyway.
    pub(super) fn copies(&self, frames: u32, bytes: usize, now: Instant) -> u32 {
        const MOST: i32 = 6;
        let modem = &self.config.modem;
        let budget_binds = f64::from(self.budget.bits_per_s()) < modem.bit_rate_bps / 2.0;
        let covered = self.pair.outstanding() <= self.said.len() as u64;
        if modem.access != Access::Shared || !covered || (budget_binds && !self.budget.is_plentiful(now)) {
            return 1;
        }
        let loss = self.pair.stats.loss_out.expected().clamp(0.0, 0.95);
        let incomplete = |copies: i32| 1.0 - (1.0 - loss.powi(copies)).powi(frames.min(1000) as i32);
        let again = modem.time_of(bytes as u64 * 8 + modem.overhead_bits * u64::from(frames)).as_secs_f64();
        let next_turn = self.time_of_hands().as_secs_f64();
        let worth = |copies: i32| again < (incomplete(copies) - incomplete(copies + 1)) * next_turn;
        (1..MOST).find(|&copies| !worth(copies)).unwrap_or(MOST) as u32
    }

    /// Time from the end of a turn to the beginning of the next, if both ways get through.
    pub(super) fn time_of_hands(&self) -> Duration {
        let modem = &self.config.modem;
        (modem.turn_around + self.one_way.unwrap_or(Duration::from_millis(300))) * 2 + modem.airtime(32)
    }

    /// The last `count` frames of this turn, round and round, the last one at the end: it tells what follows.
    pub(super) fn again(&self, count: u32) -> VecDeque<Vec<u8>> {
        let mut again: VecDeque<Vec<u8>> =
            self.said.iter().rev().map(|s| s.bytes.clone()).cycle().take(count as usize).collect();
        again.make_contiguous().reverse();
        again
    }

    /// Keeps what was said in this turn; once all is said, the rest of the turn goes to saying it again.
    pub(super) fn remember(&mut self, transmit: &Transmit, said_all: bool, remaining: u32) {
        const MOST_KEPT: usize = 64;
        self.said_frames += 1;
        if self.said.len() == MOST_KEPT {
            self.said.pop_front();
        }
        let number = self.pair.next_number() - 1;
        self.said.push_back(Said { number, bytes: transmit.bytes.clone() });
        if said_all && remaining > 0 {
            self.repeats = self.again(remaining);
        }
    }
}
