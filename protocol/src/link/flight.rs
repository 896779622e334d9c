//! Frames sent whose fate is not known.

use super::FrameNumber;
use crate::wire::{AckStatement, MAX_WINDOW};
use std::collections::BTreeMap;

/// Numbers the frames toward one peer and remembers what each carried until the peer has judged it.
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
    /// Number of the next frame.
    pub fn next_number(&self) -> FrameNumber {
        self.next
    }

    /// Distance of the next frame to the last one whose fate is known.
    pub fn base_distance(&self) -> u16 {
        (self.next - self.horizon).min(MAX_WINDOW) as u16
    }

    /// Whether no further frame can be told from an old one before the peer has answered.
    pub fn is_full(&self) -> bool {
        // A turn that has begun is finished.
        const TURN: u64 = 64;
        self.next - self.horizon >= MAX_WINDOW - TURN
    }

    /// The last frame whose fate is known.
    pub fn horizon(&self) -> FrameNumber {
        self.horizon
    }

    /// The next frame was written and carries `content`.
    pub fn push(&mut self, content: T) {
        self.frames.insert(self.next, content);
        self.next += 1;
    }

    /// The peer's verdict; returns what newly judged frames carried, in the order of their numbers, and whether it arrived.
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
