//! When the surface speaks through a modem that does half duplex by itself: whenever there is something to say and the
//! modem's pool has room.

use super::SurfaceLink;
use super::peer::Peer;
use crate::link::Transmit;
use crate::map::StateReplica;
use crate::time::Instant;
use std::time::Duration;

/// Frames heard after which an acknowledgement does not wait any longer.
const MANY_UNSTATED: u64 = 16;
/// Silence after which a vehicle is greeted, in case that it has restarted.
const SILENCE: Duration = Duration::from_secs(60);

impl<R: StateReplica> SurfaceLink<R> {
    pub(super) fn poll_pool(&mut self, pool_frames: u32, now: Instant) -> Option<Transmit> {
        if self.in_modem.len() >= pool_frames as usize {
            return None;
        }
        let modem = self.config.modem;
        let vehicle = self
            .peers
            .values()
            .filter(|p| p.has_reason_to_speak(now))
            .min_by_key(|p| (p.master.begun(), p.pair.peer()))
            .map(|p| p.pair.peer())?;
        let peer = self.peers.get_mut(&vehicle)?;
        let hello = peer.must_greet(now);
        let plan = peer.plan_turn(&modem, hello, 1, &self.shares, now - peer.patience());
        let slots = plan.into_iter().next()?;
        let allowed = self.budget.earliest(peer.bits(&slots, &modem), now);
        if allowed > now {
            peer.answer_due = Some(allowed);
            return None;
        }
        let ready = peer.write_turn(&[slots], &modem, None, hello, now).pop()?;
        peer.note_spoken(hello, now);
        Some(self.send(ready, false, now))
    }

    pub(super) fn next_of_pool(&self) -> Option<Instant> {
        self.peers.values().filter_map(Peer::next_reason).min()
    }
}

impl<R: StateReplica> Peer<R> {
    fn must_greet(&self, now: Instant) -> bool {
        let silent = self.heard.is_none_or(|at| now.since(at) >= SILENCE);
        (!self.pair.is_met() || silent || self.pair.is_full()) && now >= self.hello_due
    }

    fn has_reason_to_speak(&self, now: Instant) -> bool {
        if self.must_greet(now) {
            return true;
        }
        let answer = self.answer_due.is_some_and(|at| now >= at);
        let owes = (!self.pair.is_proven() && answer)
            || (self.pair.unstated() > 0 && (self.pair.unstated() >= MANY_UNSTATED || answer));
        self.pair.is_met() && (owes || !self.outbox.pending(now, now - self.patience()).is_empty())
    }

    fn next_reason(&self) -> Option<Instant> {
        let again = self.outbox.progress().filter_map(|s| s.sent).min().map(|at| at + self.patience());
        let silence = self.heard.map_or(self.hello_due, |at| (at + SILENCE).max(self.hello_due));
        let again = again.filter(|_| self.outbox.has_backlog());
        [Some(silence), self.answer_due, again].into_iter().flatten().min()
    }

    fn note_spoken(&mut self, hello: bool, now: Instant) {
        self.master.note_begun(now);
        // A run that was met must be proven by a numbered frame, or the vehicle will not speak.
        self.answer_due = (self.pair.is_met() && !self.pair.is_proven()).then(|| now + self.patience());
        if hello {
            self.hello_due = now + Duration::from_secs(5 << self.hellos.min(4));
            self.hellos += 1;
        }
    }
}
