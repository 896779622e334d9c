//! Frames that go out without a turn, through a modem that does half duplex by itself.

use super::VehiclePeer;
use super::contact::Contact;
use super::turn::Ready;
use crate::link::handshake::FramePurpose;
use crate::mac::ModemProfile;
use crate::map::StateReplica;
use crate::schedule::{BitBudget, ClassShares};
use crate::time::Instant;
use std::time::Duration;

/// Frame numbers since the last acknowledgement after which the next one does not wait any longer.
const MAX_UNACKNOWLEDGED: u64 = 16;
/// Over a medium that carries both directions at once, the time beside two round trips after which a slot goes out again.
const FULL_DUPLEX_REPEAT: Duration = Duration::from_millis(400);
/// There, the time in which a run is proven, longer than a vehicle takes hellos for copies of one.
const FULL_DUPLEX_PROOF: Duration = Duration::from_millis(1600);

impl<R: StateReplica> VehiclePeer<R> {
    fn must_send_hello(&self, now: Instant) -> bool {
        let is_doubtful = self.contact.doubtful_from(self.slot_timeout()).is_none_or(|at| now >= at);
        (!self.pair.is_proven() || is_doubtful || self.pair.is_full()) && now >= self.contact.hello_due
    }

    /// When a run that the vehicle has offered is to be proven, unless a frame of the current run comes in before.
    fn proof_due(&self) -> Option<Instant> {
        let timeout = self.slot_timeout().max(self.proof_timeout());
        // A vehicle that repeats its hello has not received the last proof; a forged offer is silent.
        let pause = timeout * if self.pair.owes_proof() { 1 } else { 1 << (self.pair.proofs().clamp(1, 3) - 1) };
        let again = self.contact.proved.map_or(Instant::ZERO, |at| at + pause);
        let silent = self.contact.last_received.map_or(Instant::ZERO, |at| at + timeout);
        self.pair.has_offer().then(|| again.max(silent).max(self.contact.proof_allowed))
    }

    /// Whether a frame should go out at `now`: a hello, a proof, an acknowledgement, or a slot.
    pub(in crate::link::surface) fn has_reason_to_transmit(&self, now: Instant) -> bool {
        if self.must_send_hello(now) || self.proof_due().is_some_and(|at| now >= at) {
            return true;
        }
        let answer = self.contact.is_answer_due(now);
        let is_late = self.pair.highest() >= self.contact.acknowledged + MAX_UNACKNOWLEDGED;
        let is_repeat_due = self.next_repeat().is_some_and(|at| now >= at);
        let owes =
            (!self.pair.is_proven() && answer) || (self.pair.unstated() > 0 && (is_late || answer)) || is_repeat_due;
        let inquires = self.in_force.next_inquiry().is_some_and(|at| now >= at);
        let offers = self.next_offer().is_some_and(|at| now >= at);
        self.has_numbers()
            && (owes || inquires || offers || !self.outbox.pending(now, now - self.slot_timeout()).is_empty())
    }

    /// When the next part of the next key is due, if the vehicle is offered one.
    fn next_offer(&self) -> Option<Instant> {
        self.pair.offers_key().then(|| self.key_offers.next())
    }

    /// When the last acknowledgement goes out again, if no frame confirms it.
    fn next_repeat(&self) -> Option<Instant> {
        self.contact.repeat_due.filter(|_| self.pair.is_unconfirmed())
    }

    /// Whether there is a run with a number left for a frame.
    fn has_numbers(&self) -> bool {
        self.pair.has_run() && !self.pair.is_full()
    }

    /// When there will be a reason to transmit, if no frame comes in.
    pub(in crate::link::surface) fn next_reason(&self) -> Option<Instant> {
        let again = self.outbox.progress().filter_map(|s| s.sent).min().map(|at| at + self.slot_timeout());
        let again = again.filter(|_| self.outbox.has_backlog());
        let hello = self.contact.next_hello(self.pair.is_proven() && !self.pair.is_full(), self.slot_timeout());
        let numbered =
            [self.contact.answer_due, self.next_repeat(), again, self.in_force.next_inquiry(), self.next_offer()]
                .into_iter()
                .flatten()
                .filter(|_| self.has_numbers())
                .min();
        [Some(hello), self.proof_due(), numbered].into_iter().flatten().min()
    }

    /// Writes a frame, or postpones it if the budget does not allow it yet.
    pub(in crate::link::surface) fn write_without_turn(
        &mut self,
        modem: &ModemProfile,
        shares: &ClassShares,
        budget: &BitBudget,
        now: Instant,
    ) -> Option<Ready> {
        let is_proof = self.proof_due().is_some_and(|at| now >= at);
        let purpose = if is_proof { FramePurpose::Proof } else { FramePurpose::hello_if(self.must_send_hello(now)) };
        let plan = self.plan_turn(modem, purpose, 1, shares, now - self.slot_timeout());
        let slots = plan.into_iter().next()?;
        let allowed = budget.earliest(self.bits(&slots, modem, purpose), now);
        if allowed > now {
            match is_proof {
                true => self.contact.proof_allowed = allowed,
                false => self.contact.answer_due = Some(allowed),
            }
            self.contact.repeat_due = self.contact.repeat_due.map(|at| at.max(allowed));
            return None;
        }
        let has_orders = !slots.is_empty() && purpose == FramePurpose::Content;
        let ready = self.write_turn(&[slots], modem, None, purpose, now).pop()?;
        self.master.note_begun(now);
        if is_proof {
            self.contact.proved = Some(now);
            return Some(ready);
        }
        if has_orders {
            self.contact.ordered.get_or_insert(now);
        }
        // A run that was met must be proven by a numbered frame, or the vehicle will not transmit.
        let must_prove = self.pair.has_run() && !self.pair.is_proven();
        // After a hello of a run with this vehicle, a numbered frame follows at once.
        let timeout = self.slot_timeout();
        // A frame may be too small for a verdict on every frame that came in; the next one has the rest.
        let is_partial = self.pair.unstated() > 0;
        let next = if must_prove && purpose.is_hello() { now } else { now + timeout };
        self.contact.answers_left = self.contact.answers_left.saturating_sub(1);
        self.contact.repeat_due = (self.contact.answers_left > 0).then_some(now + timeout);
        self.contact.answer_due = (must_prove || is_partial).then_some(next);
        self.contact.acknowledged = self.pair.highest();
        if purpose.is_hello() {
            self.contact.note_hello(timeout.max(self.proof_timeout()), self.pair.stats.dropped_total(), now);
        }
        Some(ready)
    }

    /// Time in which a vehicle that was met proves the run.
    fn proof_timeout(&self) -> Duration {
        if self.is_full_duplex { FULL_DUPLEX_PROOF } else { Contact::PROOF_TIMEOUT }
    }

    /// Time after which a slot that was not acknowledged goes out again.
    pub(super) fn slot_timeout(&self) -> Duration {
        match self.is_full_duplex {
            true => self.master.round_trip().unwrap_or(Duration::from_millis(300)) * 2 + FULL_DUPLEX_REPEAT,
            false => self.master.round_trip().unwrap_or(Duration::from_secs(4)) * 2 + Duration::from_secs(4),
        }
    }
}
