//! Repetition of frames, byte for byte, to save the turn that a loss would cost.
//!
//! A turn ends with copies of its frames as long as a copy costs less airtime than the turn it is likely to save, and
//! begins with the frames of the previous turn that the surface has not acknowledged.

use crate::mac::{Access, ModemProfile};
use std::collections::VecDeque;
use std::time::Duration;

/// A frame of the current turn.
#[derive(Debug)]
struct SentFrame {
    number: u64,
    bytes: Vec<u8>,
}

/// The state of the link that decides how many copies of a turn are worth sending.
#[derive(Debug, Clone, Copy)]
pub(super) struct RepeatTerms {
    pub(super) modem: ModemProfile,
    /// Frames whose fate the surface has not reported.
    pub(super) outstanding: u64,
    /// Expected share of lost frames, in 0..=1.
    pub(super) loss: f64,
    /// Whether the bit budget, not the modem, limits the link at the moment.
    pub(super) is_budget_bound: bool,
    /// Time from the end of a turn to the beginning of the next, if both directions get through.
    pub(super) handover: Duration,
}

/// The frames of the current turn and the copies that are still to be sent.
#[derive(Debug, Default)]
pub(super) struct Repeater {
    sent: VecDeque<SentFrame>,
    /// New frames of this turn, including those that are no longer kept.
    new_frames: usize,
    queue: VecDeque<Vec<u8>>,
}

impl Repeater {
    /// A longer unacknowledged turn is not repeated.
    const MAX_REPEATED_TURN: usize = 8;
    /// Frames of a turn that are kept.
    const MAX_KEPT: usize = 64;
    const MAX_COPIES: i32 = 6;

    /// Begins a turn. Where turns alternate, the surface has transmitted since the end of our last turn, so it has
    /// missed every frame after `horizon`. If these are few and no other frame is outstanding, they are queued again.
    pub(super) fn begin_turn(&mut self, horizon: u64, outstanding: u64, may_repeat: bool) {
        self.sent.retain(|s| s.number > horizon);
        self.new_frames = 0;
        let has_all = self.sent.len() as u64 == outstanding;
        if !may_repeat || self.sent.len() > Self::MAX_REPEATED_TURN || !has_all {
            self.sent.clear();
        }
        self.queue = self.sent.iter().map(|s| s.bytes.clone()).collect();
    }

    pub(super) fn end_turn(&mut self) {
        self.queue.clear();
    }

    /// Drops every kept frame: the state has changed, so their content is outdated.
    pub(super) fn forget(&mut self) {
        self.sent.clear();
        self.queue.clear();
    }

    /// The next copy, and whether the turn ends with it. Copies at the beginning of a turn may be known to the surface
    /// by now, so a new frame always follows them.
    pub(super) fn pop(&mut self) -> Option<(Vec<u8>, bool)> {
        let bytes = self.queue.pop_front()?;
        Some((bytes, self.queue.is_empty() && self.new_frames > 0))
    }

    /// Frames of this turn that are kept.
    pub(super) fn kept(&self) -> u32 {
        self.sent.len() as u32
    }

    /// Total size of the kept frames in bytes.
    pub(super) fn kept_bytes(&self) -> usize {
        self.sent.iter().map(|s| s.bytes.len()).sum()
    }

    /// New frames of this turn so far.
    pub(super) fn new_frames(&self) -> usize {
        self.new_frames
    }

    /// How often a turn of `frames` frames, `bytes` in all, is sent when no new data is left: another copy is sent as
    /// long as it takes less time than the next turn would, times the probability that it makes that turn needless.
    /// There are no copies where the budget limits the link, or where frames of earlier turns are outstanding: then
    /// another turn is needed anyway.
    pub(super) fn copies(&self, frames: u32, bytes: usize, terms: &RepeatTerms) -> u32 {
        let modem = &terms.modem;
        let is_covered = terms.outstanding <= self.sent.len() as u64;
        if modem.access != Access::Shared || !is_covered || terms.is_budget_bound {
            return 1;
        }
        let loss = terms.loss.clamp(0.0, 0.95);
        let incomplete = |copies: i32| 1.0 - (1.0 - loss.powi(copies)).powi(frames.min(1000) as i32);
        let copy_s = modem.time_of(bytes as u64 * 8 + modem.overhead_bits * u64::from(frames)).as_secs_f64();
        let next_turn_s = terms.handover.as_secs_f64();
        let pays_off = |copies: i32| copy_s < (incomplete(copies) - incomplete(copies + 1)) * next_turn_s;
        (1..Self::MAX_COPIES).find(|&copies| !pays_off(copies)).unwrap_or(Self::MAX_COPIES) as u32
    }

    /// Keeps a new frame of this turn. If it is the last new one, `copies` further frames fill the rest of the turn:
    /// the kept frames in turn, ending with this one, whose header announces how many follow.
    pub(super) fn keep(&mut self, number: u64, bytes: &[u8], copies: Option<u32>) {
        self.new_frames += 1;
        if self.sent.len() == Self::MAX_KEPT {
            self.sent.pop_front();
        }
        self.sent.push_back(SentFrame { number, bytes: bytes.to_vec() });
        if let Some(copies) = copies {
            let latest_first = self.sent.iter().rev().map(|s| s.bytes.clone()).cycle();
            self.queue = latest_first.take(copies as usize).collect();
            self.queue.make_contiguous().reverse();
        }
    }
}
