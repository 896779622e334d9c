//! The outbox of an autopilot: bytes, steps and notes for its host.

use super::plausible::{Jump, Plausible};
use super::{Counters, Step};
use scenecast_protocol::time::Instant;
use std::collections::VecDeque;

/// Bytes, way and notes that wait to be fetched, at most [`Outbox::MAX`] of each, and counters.
#[derive(Debug, Default)]
pub struct Outbox {
    pub(super) outputs: VecDeque<Vec<u8>>,
    pub(super) steps: VecDeque<Step>,
    pub(super) notes: VecDeque<String>,
    pub(super) counters: Counters,
    plausible: Plausible,
}

impl Outbox {
    /// Most of each that waits.
    pub(super) const MAX: usize = 256;

    /// Queues bytes for the autopilot; the newest are dropped when the queue is full.
    pub(super) fn write(&mut self, bytes: Vec<u8>) {
        if self.outputs.len() < Self::MAX {
            self.outputs.push_back(bytes);
        }
    }

    /// A stretch of way. None is lost: where too many wait, it is added to the last one.
    pub fn walk(&mut self, step: Step) {
        let is_full = self.steps.len() >= Self::MAX;
        match self.steps.back_mut() {
            Some(last) if is_full => {
                let (dx_m, dy_m) = (last.dx_m + step.dx_m, last.dy_m + step.dy_m);
                *last = Step { dx_m, dy_m, unseen: last.unseen.saturating_add(step.unseen), ..step };
            }
            _ => self.steps.push_back(step),
        }
    }

    /// A stretch of way as sensors measured it: depth, heading and height above the sea floor that cannot be are replaced by the last
    /// ones that can, and named.
    pub(super) fn walk_measured(&mut self, step: Step, now: Instant) {
        let (step, jumps) = self.plausible.check(step, now);
        jumps.into_iter().for_each(|jump| self.take_jump(jump));
        self.walk(step);
    }

    /// A measured velocity east and north, metres a second, or the last one before it jumped.
    pub(super) fn plausible_velocity(&mut self, measured: (f64, f64), now: Instant) -> (f64, f64) {
        let (velocity, jumps) = self.plausible.check_velocity(measured, now);
        jumps.into_iter().for_each(|jump| self.take_jump(jump));
        velocity
    }

    /// A measured position, metres north and east.
    pub(super) fn check_place(&mut self, place: (f64, f64), now: Instant) {
        let jump = self.plausible.check_place(place, now);
        jump.into_iter().for_each(|jump| self.take_jump(jump));
    }

    /// Whether a target must not count from the last position.
    pub(super) fn is_place_in_doubt(&self) -> bool {
        self.plausible.is_place_in_doubt()
    }

    fn take_jump(&mut self, jump: Jump) {
        self.count(jump.counter);
        jump.note.into_iter().for_each(|note| self.note(note));
    }

    /// The depth that the autopilot reports at the surface, metres; `None` while its depth is in doubt.
    pub(super) fn depth_zero_m(&self) -> Option<f64> {
        self.plausible.depth_zero_m()
    }

    /// Sensors measure from another zero from now on: the next values are taken as they are.
    pub(super) fn forget_measured(&mut self) {
        self.plausible = Plausible::default();
    }

    /// Something that a person should read.
    pub(super) fn note(&mut self, text: impl Into<String>) {
        if self.notes.len() < Self::MAX {
            self.notes.push_back(text.into());
        }
    }

    /// It has happened once more.
    pub(super) fn count(&mut self, what: &'static str) {
        *self.counters.entry(what).or_default() += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn unread_steps_are_summed_up_in_bounded_memory() {
        let mut outbox = Outbox::default();
        for i in 0..10_000 {
            let unseen = Duration::from_millis(u64::from(i % 2 == 0));
            outbox.walk(Step { dx_m: 1.0, dy_m: -2.0, heading_rad: Some(f64::from(i)), unseen, ..Step::default() });
            outbox.note("the same");
            outbox.write(vec![0]);
        }
        assert!([outbox.steps.len(), outbox.notes.len(), outbox.outputs.len()].iter().all(|&n| n == Outbox::MAX));
        let (x, y) = outbox.steps.iter().fold((0.0, 0.0), |(x, y), s| (x + s.dx_m, y + s.dy_m));
        assert_eq!((x, y), (10_000.0, -20_000.0));
        assert_eq!(outbox.steps.iter().map(|s| s.unseen).sum::<Duration>(), Duration::from_secs(5));
        assert_eq!(outbox.steps.back().and_then(|s| s.heading_rad), Some(9_999.0));
    }
}
