//! Repetition of frames, byte for byte, to save the turn that a loss would cost, and frames that ask for an acknowledgement.
//!
//! A turn ends with copies of its frames as long as a copy costs less airtime and energy than the wait it is likely to save,
//! and begins with the frames of the previous turn that the surface has not acknowledged.

use crate::mac::{Access, ModemProfile};
use crate::time::Instant;
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
    /// Whether this turn has content beside what spare capacity carries.
    has_urgent: bool,
    /// Whether all data was sent with the last turn.
    is_complete: bool,
    /// Share of the recent turns that began with new data although the turn before had sent all, in 0..=1.
    news: f64,
    /// Frames that the surface had declared lost when this turn began.
    lost: u64,
}

impl Repeater {
    /// A longer unacknowledged turn is not repeated.
    const MAX_REPEATED_TURN: usize = 8;
    /// Frames of a turn that are kept.
    const MAX_KEPT: usize = 64;
    const MAX_COPIES: i32 = 6;
    /// Where a turn takes longer to follow, convergence needs the copies: without them, `bench link` misses its bounds at 3 km
    /// and meets all of them at 1 km.
    const LONG_HANDOVER: Duration = Duration::from_millis(2500);
    /// Weight of the latest turn in the share of recent turns with new data.
    const NEWS_WEIGHT: f64 = 1.0 / 16.0;

    /// Begins a turn with the last frame of known fate, the number of frames of unknown fate and that of lost ones;
    /// `has_news` is whether changes wait. Where turns alternate, the surface has transmitted since the end of our last
    /// turn, so it has missed every frame after `horizon`. If these are few and no other frame is outstanding, they are
    /// queued again.
    pub(super) fn begin_turn(
        &mut self,
        (horizon, outstanding, lost): (u64, u64, u64),
        may_repeat: bool,
        has_news: bool,
    ) {
        // What was lost waits again, and is no news.
        let has_lost = std::mem::replace(&mut self.lost, lost) != lost;
        if std::mem::take(&mut self.is_complete) && !has_lost {
            self.news += (f64::from(u8::from(has_news)) - self.news) * Self::NEWS_WEIGHT;
        }
        self.sent.retain(|s| s.number > horizon);
        (self.new_frames, self.has_urgent) = (0, false);
        let has_all = self.sent.len() as u64 == outstanding;
        if !may_repeat || self.sent.len() > Self::MAX_REPEATED_TURN || !has_all {
            self.sent.clear();
        }
        self.queue = self.sent.iter().map(|s| s.bytes.clone()).collect();
    }

    pub(super) fn end_turn(&mut self) {
        self.queue.clear();
    }

    /// This turn has content beside what spare capacity carries.
    pub(super) fn note_urgent(&mut self) {
        self.has_urgent = true;
    }

    pub(super) fn has_urgent(&self) -> bool {
        self.has_urgent
    }

    /// No data waits any more.
    pub(super) fn note_complete(&mut self) {
        self.is_complete = true;
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

    /// How often a turn of `frames` frames, `bytes` in all, is sent when no new data is left. Another copy is sent as long as
    /// it costs less than it gains, both in seconds.
    ///
    /// * If new data will wait, the next turn comes anyway. A copy gains the cycle that the content of a lost frame would
    ///   wait, times the probability that only the copy arrives. It costs its airtime twice: once for what follows it, and
    ///   once for the energy, of which a second on air counts as much as a second of age.
    /// * Otherwise a copy that makes the next turn needless gains that turn. Nothing follows that could wait, so its airtime
    ///   counts once.
    ///
    /// The share of recent turns with new data weighs both cases. There are no copies where the budget limits the link, or
    /// where frames of earlier turns are outstanding: then another turn is needed anyway.
    pub(super) fn copies(&self, frames: u32, bytes: usize, terms: &RepeatTerms) -> u32 {
        let modem = &terms.modem;
        let is_covered = terms.outstanding <= self.sent.len() as u64;
        if modem.access != Access::Shared || !is_covered || terms.is_budget_bound {
            return 1;
        }
        let copy_s = modem.time_of(bytes as u64 * 8 + modem.overhead_bits * u64::from(frames)).as_secs_f64();
        let next_turn_s = terms.handover.as_secs_f64();
        let loss = terms.loss.clamp(0.0, 0.95);
        let news = if terms.handover > Self::LONG_HANDOVER { 0.0 } else { self.news };
        let frame_lost = |copies: i32| loss.powi(copies);
        let turn_incomplete = |copies: i32| 1.0 - (1.0 - frame_lost(copies)).powi(frames.min(1000) as i32);
        let gain_s = |copies: i32| {
            let sooner = (frame_lost(copies) - frame_lost(copies + 1)) * (next_turn_s + copy_s);
            let needless = (turn_incomplete(copies) - turn_incomplete(copies + 1)) * next_turn_s;
            news * sooner + (1.0 - news) * needless
        };
        let cost_s = copy_s * (1.0 + news);
        (1..Self::MAX_COPIES).find(|&copies| cost_s >= gain_s(copies)).unwrap_or(Self::MAX_COPIES) as u32
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

/// When a loss at the end of the traffic is to be looked for. Nothing that follows a lost frame would show it, and the frame
/// would be sent again only with the next news.
#[derive(Debug, Default)]
pub(super) struct TailProbe {
    due: Option<Instant>,
    /// How often a probe has gone out since frames were last acknowledged.
    unanswered: u32,
}

impl TailProbe {
    /// Most doublings of the wait: a surface that is gone costs a probe every 32 waits.
    const MAX_DOUBLINGS: u32 = 5;

    /// When the next probe is due.
    pub(super) fn due(&self) -> Option<Instant> {
        self.due
    }

    pub(super) fn is_due(&self, now: Instant) -> bool {
        self.due.is_some_and(|at| now >= at)
    }

    /// A frame goes out at `now`; an acknowledgement takes about `wait` to come.
    pub(super) fn handle_transmit(&mut self, wait: Duration, now: Instant) {
        self.unanswered += u32::from(self.is_due(now));
        self.due = Some(now + wait * (1 << self.unanswered.min(Self::MAX_DOUBLINGS)));
    }

    /// The fate of frames is known; `outstanding` are still without one.
    pub(super) fn handle_fates(&mut self, outstanding: u64) {
        self.unanswered = 0;
        if outstanding == 0 {
            self.due = None;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Copies of a turn of one frame of 64 bytes at 10 kbit/s, by loss, after turns that all had changes or none.
    fn copies(range_m: f64, loss: f64, has_news: bool) -> u32 {
        let turn_around = Duration::from_millis(200);
        let modem = ModemProfile {
            frame_bytes: 64,
            bit_rate_bps: 10_000.0,
            overhead_bits: 0,
            turn_around,
            access: Access::Shared,
        };
        let one_way = Duration::from_secs_f64(range_m / 1500.0);
        let handover = (turn_around + one_way) * 2 + modem.airtime(32);
        let terms = RepeatTerms { modem, outstanding: 0, loss, is_budget_bound: false, handover };
        let mut repeater = Repeater::default();
        (0..200).for_each(|_| (repeater.note_complete(), repeater.begin_turn((0, 0, 0), true, has_news)).1);
        repeater.copies(1, 64, &terms)
    }

    #[test]
    fn copies_go_out_where_a_loss_costs_more_than_they_do() {
        let at_rest = [0.0, 0.1, 0.3, 0.5].map(|loss| copies(500.0, loss, false));
        let changing = [0.0, 0.1, 0.3, 0.5].map(|loss| copies(500.0, loss, true));
        assert_eq!((at_rest, changing), ([1, 2, 3, 4], [1, 2, 2, 3]));
        assert_eq!([copies(100.0, 0.1, true), copies(3000.0, 0.1, true)], [1, 2]);
    }

    #[test]
    fn probes_end_with_the_last_fate_and_grow_rarer_without_one() {
        let at = |ms: u64| Instant::from_micros(ms * 1000);
        let mut probe = TailProbe::default();
        probe.handle_transmit(Duration::from_millis(100), at(0));
        assert!(!probe.is_due(at(99)) && probe.is_due(at(100)));
        let mut now = at(100);
        let pauses: Vec<u128> = (0..8)
            .map(|_| {
                probe.handle_transmit(Duration::from_millis(100), now);
                let pause = probe.due().unwrap().since(now);
                now = probe.due().unwrap();
                pause.as_millis()
            })
            .collect();
        assert_eq!(pauses, [200, 400, 800, 1600, 3200, 3200, 3200, 3200]);
        probe.handle_fates(3);
        assert!(probe.due().is_some());
        probe.handle_fates(0);
        assert_eq!(probe.due(), None);
    }
}
