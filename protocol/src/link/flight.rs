//! Sent frames whose fate is not known yet.

use super::FrameNumber;
use crate::wire::{AckStatement, MAX_WINDOW};
use std::collections::BTreeMap;

/// Numbers the frames toward one peer, and keeps the content of each until the peer has reported its fate.
#[derive(Debug)]
pub struct Flight<T> {
    next: FrameNumber,
    horizon: FrameNumber,
    frames: BTreeMap<FrameNumber, T>,
}

impl<T> Default for Flight<T> {
    fn default() -> Self {
        Self { next: 1, horizon: 0, frames: BTreeMap::new() }
    }
}

impl<T> Flight<T> {
    /// The number of the next frame; the first is 1.
    pub fn next_number(&self) -> FrameNumber {
        self.next
    }

    /// The next frame's number minus the horizon, as the header's `base` field states it.
    pub fn base_distance(&self) -> u16 {
        (self.next - self.horizon).min(MAX_WINDOW) as u16
    }

    /// Whether the peer must answer first, because a further number could be mistaken for an old one.
    pub fn is_full(&self) -> bool {
        // A turn that has begun is completed.
        const TURN: u64 = 64;
        self.next - self.horizon >= MAX_WINDOW - TURN
    }

    /// The last frame whose fate is known.
    pub fn horizon(&self) -> FrameNumber {
        self.horizon
    }

    /// Numbers the next frame, which carries `content`.
    pub fn push(&mut self, content: T) {
        self.frames.insert(self.next, content);
        self.next += 1;
    }

    /// Takes the peer's verdict. Returns the content of newly judged frames in the order of their
    /// numbers, and whether each arrived.
    pub fn handle_statement(&mut self, statement: &AckStatement) -> Vec<(T, bool)> {
        let ahead = u64::from(statement.horizon_low.wrapping_sub(self.horizon as u16) & 0xFFF);
        let horizon = self.horizon + ahead;
        if ahead == 0 || horizon >= self.next {
            return Vec::new();
        }
        let later = self.frames.split_off(&(horizon + 1));
        let judged = std::mem::replace(&mut self.frames, later);
        self.horizon = horizon;
        let lost = |number: u64| statement.lost.binary_search(&((horizon - number) as u16)).is_ok();
        judged.into_iter().map(|(number, content)| (content, !lost(number))).collect()
    }
}
