//! The surface's side of the directive: which slots to send, and how far each has come.

use super::{
    OrderStatus, RefusalReason, SLOTS, Series, Slot, SlotId, SlotProgress, SlotReport, SlotState, VersionedSlot,
    Withdrawal,
};
use crate::time::Instant;
use std::time::Duration;

/// A slot that waits for transmission, encoded as of now.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PendingSlot {
    /// The slot that the chunk belongs to.
    pub id: SlotId,
    /// The version within the series.
    pub version: u16,
    /// The encoded payload of the chunk.
    pub bytes: Vec<u8>,
}

/// A hold or an abort that waits while the vehicle refuses this surface for another one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WaitingStop {
    None,
    /// The vehicle is to be taken over. The order goes out once the vehicle has reported that it has no newer one.
    TakesOver,
    /// It is old: it is withdrawn, and the operator is asked.
    Withdrawn,
}

/// The directive of one vehicle at the surface.
#[derive(Debug)]
pub struct SlotOutbox {
    series: Series,
    slots: [Option<SlotProgress>; SLOTS],
    /// Whether orders are authenticated, so that those of another surface are not forged.
    is_keyed: bool,
    /// Whether the vehicle has lost its record of this series.
    is_forgotten: bool,
    /// Whether the vehicle has acknowledged an order of this series or of an earlier one.
    has_acknowledged: bool,
    /// Whether each slot that is queued was on air in an earlier run.
    was_on_air: [bool; SLOTS],
    /// Whether a report has come in since the run began.
    has_report: bool,
    /// Whether each slot was applied in an earlier run, until the vehicle has reported on it in this one.
    was_applied: [bool; SLOTS],
    /// Whether a report of this run has said that another surface's order of the slot is newer.
    is_overtaken: [bool; SLOTS],
    /// When the vehicle refused this surface for another one last.
    refused: Option<Instant>,
    /// Age after which an abort that has not arrived is withdrawn.
    abort_lifetime: Option<Duration>,
    /// The frame that acknowledged each slot that is received.
    received_in: [u64; SLOTS],
    /// Versions to leave out before the next one of each slot.
    skipped: [u16; SLOTS],
    /// The displaced version of each slot for which a series was left.
    displaced: [Option<u16>; SLOTS],
}

impl SlotOutbox {
    /// Time after an acknowledgement in which each report from before it has come in.
    const MAX_DECISION: Duration = Duration::from_secs(30);
    /// Versions that are left out after a restart: an order whose record was lost may have used one of them.
    const RESTART_GAP: u16 = 64;

    /// Age up to which a hold or an abort is obeyed although another surface may have given a newer order: to stop is safe. One
    /// that was as young when the vehicle refused this surface for another one has the time that taking over may need.
    const PROMPT: Duration = Duration::from_secs(20);
    const PROMPT_AGAINST_HOLDER: Duration = Duration::from_secs(60);

    /// Age from which a hold or an abort no longer takes a vehicle over by itself.
    const STOP_LIFETIME: Duration = Duration::from_secs(120);

    /// An empty directive; `series` must be drawn at random by a surface that does not know its last orders.
    pub fn new(series: Series, is_keyed: bool) -> Self {
        Self {
            series,
            slots: Default::default(),
            is_keyed,
            is_forgotten: false,
            has_acknowledged: false,
            was_on_air: [false; SLOTS],
            has_report: false,
            was_applied: [false; SLOTS],
            is_overtaken: [false; SLOTS],
            refused: None,
            abort_lifetime: None,
            received_in: [0; SLOTS],
            skipped: [0; SLOTS],
            displaced: [None; SLOTS],
        }
    }

    /// Sets the age after which an abort that has not arrived is withdrawn; `None`: it never is.
    pub fn set_abort_lifetime(&mut self, lifetime: Option<Duration>) {
        self.abort_lifetime = lifetime;
    }

    /// The series that the versions belong to.
    pub fn series(&self) -> Series {
        self.series
    }

    /// Continues with the series and the orders of an earlier run of the surface. Orders that the vehicle has not decided
    /// about are sent again, with their versions.
    pub fn restore(&mut self, series: Series, orders: impl IntoIterator<Item = SlotProgress>) {
        (self.series, self.skipped) = (series, [Self::RESTART_GAP; SLOTS]);
        for order in orders {
            self.is_forgotten |= is_forgotten(order.status);
            self.has_acknowledged |= !matches!(order.status, OrderStatus::Queued | OrderStatus::OnAir);
            if let Some(was_applied) = self.was_applied.get_mut(order.id.index()) {
                *was_applied = order.status == OrderStatus::Applied;
            }
            if let Some(was_on_air) = self.was_on_air.get_mut(order.id.index()) {
                *was_on_air = matches!(order.status, OrderStatus::OnAir | OrderStatus::Received);
            }
            if let Some(entry) = self.slots.get_mut(order.id.index()) {
                *entry = Some(SlotProgress { sent: None, ..order });
            }
        }
    }

    /// Issues a new version of a slot, which supersedes the older one; returns the version.
    ///
    /// If the vehicle has lost its record of the series, a new one begins, in which every order is sent again.
    pub fn issue(&mut self, slot: Slot, now: Instant) -> u16 {
        if self.is_forgotten {
            self.begin_series(|_| false, now);
        }
        let id = slot.id();
        if let Some(was_on_air) = self.was_on_air.get_mut(id.index()) {
            *was_on_air = false;
        }
        let Some(entry) = self.slots.get_mut(id.index()) else { return 0 };
        let gap = self.skipped.get_mut(id.index()).map(std::mem::take).unwrap_or_default();
        let version = entry.as_ref().map_or(1, |s| s.version.wrapping_add(1)).wrapping_add(gap);
        *entry = Some(SlotProgress {
            id,
            version,
            slot,
            status: OrderStatus::Queued,
            issued: now,
            changed: now,
            sent: None,
        });
        version
    }

    /// The latest version of every slot that was issued.
    pub fn progress(&self) -> impl Iterator<Item = &SlotProgress> {
        self.slots.iter().flatten()
    }

    /// Whether a version waits that the vehicle is not known to have received.
    pub fn has_backlog(&self) -> bool {
        self.progress().any(is_pending)
    }

    /// The slots that the vehicle is not known to have received, commands before fixes, encoded as of `now`;
    /// without those sent after `again_before`.
    pub fn pending(&self, now: Instant, again_before: Instant) -> Vec<PendingSlot> {
        self.progress()
            .filter(|s| is_pending(s) && self.may_go(s, now))
            .filter(|s| s.sent.is_none_or(|at| at <= again_before))
            .map(|s| PendingSlot {
                id: s.id,
                version: s.version,
                bytes: VersionedSlot::encode(s.version, &dated(s, now)),
            })
            .collect()
    }

    /// The chunk of a version as of `now`, unless the version is superseded.
    pub fn encode(&self, id: SlotId, version: u16, now: Instant) -> Option<Vec<u8>> {
        let slot = self.progress().find(|s| s.id == id && s.version == version)?;
        Some(VersionedSlot::encode(version, &dated(slot, now)))
    }

    /// Notes that a frame with this version was written.
    pub fn mark_on_air(&mut self, id: SlotId, version: u16, now: Instant) {
        let is_first = self.slots.get(id.index()).and_then(Option::as_ref).is_some_and(|s| s.sent.is_none());
        self.advance(id, version, OrderStatus::OnAir, now, |status| {
            status == OrderStatus::Queued || is_first && status == OrderStatus::Received
        });
        if let Some(slot) = self.slots.get_mut(id.index()).and_then(Option::as_mut) {
            slot.sent = Some(now);
        }
    }

    /// Notes that frame `number` of the vehicle acknowledged a frame with this version.
    pub fn mark_received(&mut self, id: SlotId, version: u16, number: u64, now: Instant) {
        self.has_acknowledged = true;
        let is_new = self.advance(id, version, OrderStatus::Received, now, |status| {
            matches!(status, OrderStatus::Queued | OrderStatus::OnAir)
        });
        if let Some(received_in) = self.received_in.get_mut(id.index()).filter(|_| is_new) {
            *received_in = number;
        }
    }

    /// Takes the decisions in the vehicle's report; returns the slots that are newly applied, refused or withdrawn.
    pub fn handle_report(&mut self, reports: &[SlotReport; SLOTS], now: Instant) -> Vec<SlotId> {
        let mut decided = Vec::new();
        for (id, report) in SlotId::ALL.into_iter().zip(reports) {
            if self.handle_older_memory(id, report, now) {
                decided.push(id);
                continue;
            }
            if report.state == SlotState::Refused(RefusalReason::Overtaken) {
                decided.extend(self.handle_overtaken(id, now).then_some(id));
                continue;
            }
            let Some(Some(slot)) = self.slots.get(id.index()) else { continue };
            let status = match report.state {
                SlotState::Unknown => {
                    // What has only lifted a hold is not given again by itself: the vehicle may hold for a newer reason.
                    let is_lifted = lifts(&slot.slot);
                    let forgotten = |s| s == OrderStatus::Received || s == OrderStatus::Applied && !is_lifted;
                    self.advance(id, slot.version, OrderStatus::Queued, now, forgotten);
                    continue;
                }
                SlotState::Pending => continue,
                // This surface has forgotten a newer order of its own, such as one with the file of an hour ago.
                SlotState::Applied if is_newer(report.version_low, slot.version as u8) => {
                    let superseded = OrderStatus::Withdrawn(Withdrawal::Superseded);
                    let is_new = self.advance(id, slot.version, superseded, now, |s| s == OrderStatus::Applied);
                    decided.extend(is_new.then_some(id));
                    continue;
                }
                _ if slot.version as u8 != report.version_low => continue,
                SlotState::Applied => OrderStatus::Applied,
                SlotState::Refused(reason) => OrderStatus::Refused(reason),
            };
            // One that was withdrawn because it seemed not to have arrived may have arrived.
            let may_have_arrived = slot.sent.is_some();
            let is_undecided =
                |s| s == OrderStatus::Received || may_have_arrived && s == OrderStatus::Withdrawn(Withdrawal::Late);
            if self.advance(id, slot.version, status, now, is_undecided) {
                self.is_forgotten |= is_forgotten(status);
                decided.push(id);
            }
        }
        self.has_report = true;
        decided
    }

    /// A vehicle that has decided about an older version than the one that it had applied before has the memory of an earlier
    /// time, such as a copy of its folder: that order is lost. Returns whether it is.
    fn handle_older_memory(&mut self, id: SlotId, report: &SlotReport, now: Instant) -> bool {
        let decided = matches!(report.state, SlotState::Applied | SlotState::Refused(_));
        let is_own = report.state != SlotState::Refused(RefusalReason::Overtaken);
        let Some(was_applied) = self.was_applied.get_mut(id.index()).filter(|_| report.state != SlotState::Pending)
        else {
            return false;
        };
        let was_applied = std::mem::take(was_applied);
        let Some(Some(order)) = self.slots.get_mut(id.index()) else { return false };
        let is_older = is_newer(order.version as u8, report.version_low);
        let is_lost =
            was_applied && decided && is_own && is_older && order.status == OrderStatus::Applied && !is_given_anew(id);
        if is_lost {
            (order.status, order.changed) = (OrderStatus::Withdrawn(Withdrawal::Lost), now);
            self.is_forgotten = true;
        }
        is_lost
    }

    /// The vehicle has no record of this series: if it has acknowledged any order before, every one that it may have received
    /// is withdrawn. Fixes and requests grow old soon, and are given anew anyway. Returns the withdrawn slots.
    pub fn handle_lost_memory(&mut self, now: Instant) -> Vec<SlotId> {
        let mut lost = Vec::new();
        if !std::mem::take(&mut self.has_acknowledged) {
            return lost;
        }
        for (order, was_on_air) in self.slots.iter_mut().zip(&mut self.was_on_air) {
            let Some(order) = order.as_mut().filter(|order| !is_given_anew(order.id)) else { continue };
            let was_known = matches!(order.status, OrderStatus::OnAir | OrderStatus::Received | OrderStatus::Applied);
            let was_sent = order.status == OrderStatus::Queued && std::mem::take(was_on_air);
            if was_known || was_sent {
                (order.status, order.changed) = (OrderStatus::Withdrawn(Withdrawal::Lost), now);
                lost.push(order.id);
            }
        }
        self.is_forgotten |= !lost.is_empty();
        lost
    }

    /// Sends the orders that the vehicle has lost again, in a new series, except one that only lifts a hold or an abort:
    /// the operator lifts it by a new order. Returns them.
    pub fn restore_lost(&mut self, now: Instant) -> Vec<SlotId> {
        let is_lost = |order: &&mut SlotProgress| order.status == OrderStatus::Withdrawn(Withdrawal::Lost);
        let mut restored = Vec::new();
        for order in self.slots.iter_mut().flatten().filter(is_lost).filter(|order| !lifts(&order.slot)) {
            (order.status, order.changed, order.sent) = (OrderStatus::Queued, now, None);
            restored.push(order.id);
        }
        if !restored.is_empty() {
            self.begin_series(|_| false, now);
        }
        restored
    }

    /// Withdraws an abort, or an order that lifts one or a hold, that has not arrived in time; returns whether there was one. A hold
    /// stays, because to stop is safe.
    pub fn withdraw_late(&mut self, now: Instant) -> bool {
        let Some(lifetime) = self.abort_lifetime else { return false };
        let is_late = |order: &&mut SlotProgress| {
            let is_abort = matches!(order.slot, Slot::Constraints(constraints) if constraints.abort);
            (is_abort || lifts(&order.slot)) && order.status.is_pending() && now.since(order.issued) >= lifetime
        };
        let late = self.slots.iter_mut().flatten().find(is_late);
        late.map(|order| (order.status, order.changed) = (OrderStatus::Withdrawn(Withdrawal::Late), now)).is_some()
    }

    /// The order of a kind, if it is withdrawn.
    pub fn withdrawn(&self, id: SlotId) -> Option<Slot> {
        let order = self.progress().find(|order| order.id == id)?;
        matches!(order.status, OrderStatus::Withdrawn(_)).then(|| order.slot.clone())
    }

    /// The newest order of a slot in force is another surface's. One of ours that the vehicle has not decided about was given
    /// before this surface knew that. Returns whether it is withdrawn.
    fn handle_overtaken(&mut self, id: SlotId, now: Instant) -> bool {
        let is_obeyed = |order: &SlotProgress| order.id == id && order.slot.stops() && self.is_prompt(order, now);
        let is_prompt_stop = self.progress().any(is_obeyed);
        let Some(is_known) = self.is_overtaken.get_mut(id.index()) else { return false };
        let is_known = std::mem::replace(is_known, true);
        let Some(order) = self.slots.get_mut(id.index()).and_then(Option::as_mut).filter(|_| self.is_keyed) else {
            return false;
        };
        let withdrawal = match order.status {
            OrderStatus::Applied => Withdrawal::Superseded,
            status if status.is_pending() && !is_known && !is_prompt_stop => Withdrawal::Overtaken,
            _ => return false,
        };
        (order.status, order.changed) = (OrderStatus::Withdrawn(withdrawal), now);
        true
    }

    /// Whether an order may go out. A hold or an abort that another surface's order may have overtaken waits for the first
    /// report of a run; the vehicle itself sorts out the other orders, and obeys these at once.
    fn may_go(&self, order: &SlotProgress, now: Instant) -> bool {
        !self.is_keyed || !order.slot.stops() || self.has_report || self.is_prompt(order, now)
    }

    /// Whether the operator has just given an order.
    fn is_prompt(&self, order: &SlotProgress, now: Instant) -> bool {
        let is_against_holder = self.refused.is_some_and(|at| at.since(order.issued) < Self::PROMPT);
        let most = if is_against_holder { Self::PROMPT_AGAINST_HOLDER } else { Self::PROMPT };
        now.since(order.issued) < most
    }

    /// The vehicle has refused this surface for another one.
    pub fn handle_refusal(&mut self, now: Instant) -> WaitingStop {
        self.refused = Some(now);
        let waits = |order: &&mut SlotProgress| order.slot.stops() && order.status.is_pending();
        let Some(order) = self.slots.iter_mut().flatten().find(waits) else { return WaitingStop::None };
        if now.since(order.issued) < Self::STOP_LIFETIME {
            return WaitingStop::TakesOver;
        }
        (order.status, order.changed) = (OrderStatus::Withdrawn(Withdrawal::Late), now);
        WaitingStop::Withdrawn
    }

    /// Begins a new series if the report in frame `number` alone, without earlier ones, shows that the vehicle ignores a
    /// received version, because it knows a newer one that was not issued here, which takes a forged frame. An order that it
    /// left out for another surface's, although this surface knows that, is only sent again. A vehicle decides before it acknowledges, so the reports after the acknowledgement
    /// have the decision. As the number of the acknowledgement may be forged, a report long after it has the decision too.
    pub fn leave_overtaken_series(
        &mut self,
        report: &[SlotReport; SLOTS],
        number: u64,
        is_replaced: impl Fn(&SlotProgress) -> bool,
        now: Instant,
    ) {
        let ignored = |slot: &&SlotProgress| {
            let (report, received_in) = (report.get(slot.id.index()), self.received_in.get(slot.id.index()));
            let is_other = |r: &SlotReport| r.state != SlotState::Unknown && r.version_low != slot.version as u8;
            let is_later = received_in.is_some_and(|&n| n < number) || now.since(slot.changed) >= Self::MAX_DECISION;
            slot.status == OrderStatus::Received && report.is_some_and(is_other) && is_later
        };
        let Some((id, version)) = self.progress().find(ignored).map(|slot| (slot.id, slot.version)) else { return };
        let overtaken = SlotState::Refused(RefusalReason::Overtaken);
        match self.is_keyed && report.get(id.index()).is_some_and(|r| r.state == overtaken) {
            true => drop(self.advance(id, version, OrderStatus::Queued, now, |_| true)),
            false => self.begin_series(is_replaced, now),
        }
    }

    /// Queues again each order that a restarted vehicle is not known to have in force.
    pub fn handle_peer_restart(&mut self, now: Instant) {
        (self.has_report, self.is_overtaken) = (false, [false; SLOTS]);
        for ((slot, was_on_air), was_applied) in
            self.slots.iter_mut().zip(&mut self.was_on_air).zip(&mut self.was_applied)
        {
            let Some(slot) = slot else { continue };
            *was_applied = slot.status == OrderStatus::Applied;
            if matches!(slot.status, OrderStatus::OnAir | OrderStatus::Received) {
                (slot.status, slot.changed, slot.sent) = (OrderStatus::Queued, now, None);
                *was_on_air = true;
            }
        }
    }

    /// Begins a new series, because the latest order of a slot was displaced by one that was not issued here. An order is
    /// sent again for this reason once only, because a vehicle could report another content for ever.
    pub fn leave_series_of_displaced(&mut self, id: SlotId, is_replaced: impl Fn(&SlotProgress) -> bool, now: Instant) {
        let version = self.slots.get(id.index()).and_then(Option::as_ref).map(|order| order.version);
        if self.displaced.get_mut(id.index()).is_some_and(|displaced| std::mem::replace(displaced, version) != version)
        {
            self.begin_series(is_replaced, now);
        }
    }

    /// Sends every order again in a new series, except those of which nothing is in force any more, by `is_replaced`, and one that only
    /// lifts a hold or an abort: the vehicle holds since it has lost its record, and the operator lifts that by a new order.
    fn begin_series(&mut self, is_replaced: impl Fn(&SlotProgress) -> bool, now: Instant) {
        self.series = self.series.next();
        (self.is_forgotten, self.was_on_air) = (false, [false; SLOTS]);
        for progress in self.slots.iter_mut().flatten() {
            let is_final = match progress.status {
                OrderStatus::Refused(reason) => reason != RefusalReason::Forgotten,
                OrderStatus::Withdrawn(_) => true,
                _ => false,
            };
            let is_applied = progress.status == OrderStatus::Applied;
            if is_applied && is_replaced(progress) {
                (progress.status, progress.changed) = (OrderStatus::Withdrawn(Withdrawal::Superseded), now);
                continue;
            }
            let lifts = lifts(&progress.slot);
            // What was applied before the vehicle lost its record is withdrawn as lost, so this was applied since.
            if is_final || lifts && is_applied {
                continue;
            }
            if lifts {
                progress.status = OrderStatus::Refused(RefusalReason::Forgotten);
            } else {
                (progress.status, progress.changed, progress.sent) = (OrderStatus::Queued, now, None);
            }
        }
    }

    fn advance(
        &mut self,
        id: SlotId,
        version: u16,
        to: OrderStatus,
        now: Instant,
        from: impl Fn(OrderStatus) -> bool,
    ) -> bool {
        match self.slots.get_mut(id.index()) {
            Some(Some(s)) if s.version == version && from(s.status) => {
                (s.status, s.changed) = (to, now);
                true
            }
            _ => false,
        }
    }
}

/// Whether the lowest bits of a version are of a later one than another.
fn is_newer(low: u8, than: u8) -> bool {
    (1..128).contains(&low.wrapping_sub(than))
}

/// Whether the vehicle is not known to have received an order. One that an earlier run of the surface knew as received, and
/// not as decided, has not been sent in this run.
fn is_pending(order: &SlotProgress) -> bool {
    match order.status {
        OrderStatus::Queued | OrderStatus::OnAir => true,
        OrderStatus::Received => order.sent.is_none(),
        OrderStatus::Applied | OrderStatus::Refused(_) | OrderStatus::Withdrawn(_) => false,
    }
}

/// Whether orders of a kind grow old soon, so that they are given anew anyway.
fn is_given_anew(id: SlotId) -> bool {
    matches!(id, SlotId::Fix | SlotId::Requests)
}

/// Whether an order only lifts a hold or an abort.
fn lifts(slot: &Slot) -> bool {
    matches!(slot, Slot::Constraints(order) if !order.stops())
}

/// Whether a status shows that the vehicle has lost its record of the series.
fn is_forgotten(status: OrderStatus) -> bool {
    matches!(status, OrderStatus::Refused(RefusalReason::Forgotten) | OrderStatus::Withdrawn(Withdrawal::Lost))
}

/// Brings the age of a fix up to date.
fn dated(progress: &SlotProgress, now: Instant) -> Slot {
    match progress.slot {
        Slot::Fix(fix) => Slot::Fix(super::Fix { age_s: fix.age_s + now.since(progress.issued).as_secs_f64(), ..fix }),
        ref other => other.clone(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::directive::Constraints;

    fn hold(hold: bool) -> Slot {
        Slot::Constraints(Constraints { hold, abort: false })
    }

    #[test]
    fn restored_orders_are_sent_again_with_their_versions() {
        let now = Instant::from_secs_f64(5.0);
        for (status, is_sent) in [
            (OrderStatus::Queued, true),
            (OrderStatus::OnAir, true),
            (OrderStatus::Received, true),
            (OrderStatus::Applied, false),
            (OrderStatus::Refused(RefusalReason::Unable), false),
        ] {
            let mut before = SlotOutbox::new(Series::from_random(9), false);
            (0..3).for_each(|i| assert_eq!(before.issue(hold(i % 2 == 0), now), i + 1));
            let mut order = before.progress().next().unwrap().clone();
            (order.status, order.sent) = (status, Some(now));
            let mut after = SlotOutbox::new(Series::from_random(1), false);
            after.restore(Series::from_random(9), [order]);
            let pending = after.pending(now, Instant::ZERO);
            let bytes = VersionedSlot::encode(3, &hold(true));
            assert_eq!(pending.iter().map(|p| &p.bytes).collect::<Vec<_>>(), Vec::from_iter(is_sent.then_some(&bytes)));
            assert_eq!(after.progress().next().unwrap().status, status);
            if is_sent {
                after.mark_on_air(SlotId::Constraints, 3, now);
                after.mark_received(SlotId::Constraints, 3, 1, now);
                assert_eq!(after.progress().next().unwrap().status, OrderStatus::Received);
                assert!(!after.has_backlog());
            }
            assert!(after.issue(hold(false), now) > 3 + 1, "the next version may have been used by a lost order");
        }
    }

    /// An outbox with these orders, which the vehicle is said to have applied.
    fn applied(orders: &[Slot], now: Instant) -> SlotOutbox {
        let mut outbox = SlotOutbox::new(Series::from_random(9), true);
        for order in orders {
            let version = outbox.issue(order.clone(), now);
            outbox.advance(order.id(), version, OrderStatus::Applied, now, |_| true);
        }
        outbox
    }

    fn status_of(outbox: &SlotOutbox, id: SlotId) -> OrderStatus {
        outbox.progress().find(|order| order.id == id).unwrap().status
    }

    #[test]
    fn a_new_series_sends_nothing_that_a_newer_order_has_replaced() {
        let now = Instant::from_secs_f64(5.0);
        let limits = Slot::Limits(crate::directive::Limits::default());
        let mut outbox = applied(&[limits, hold(true)], now);
        outbox.begin_series(|order| order.id == SlotId::Limits, now);
        assert_eq!(status_of(&outbox, SlotId::Limits), OrderStatus::Withdrawn(Withdrawal::Superseded));
        assert_eq!(status_of(&outbox, SlotId::Constraints), OrderStatus::Queued);
    }

    #[test]
    fn what_has_lifted_a_hold_is_neither_refused_nor_sent_again() {
        let now = Instant::from_secs_f64(5.0);
        let mut outbox = applied(&[hold(false)], now);
        outbox.begin_series(|_| false, now);
        outbox.handle_report(&Default::default(), now);
        assert_eq!(status_of(&outbox, SlotId::Constraints), OrderStatus::Applied);
        assert!(!outbox.has_backlog());
    }

    #[test]
    fn an_abort_that_seemed_lost_and_arrived_is_shown_as_applied() {
        let at = Instant::from_secs_f64;
        let abort = Slot::Constraints(Constraints { hold: false, abort: true });
        for was_sent in [true, false] {
            let mut outbox = SlotOutbox::new(Series::from_random(9), true);
            outbox.set_abort_lifetime(Some(Duration::from_secs(120)));
            let version = outbox.issue(abort.clone(), at(5.0));
            if was_sent {
                outbox.mark_on_air(SlotId::Constraints, version, at(6.0));
            }
            assert!(outbox.withdraw_late(at(130.0)));
            let mut reports = [SlotReport::default(); SLOTS];
            reports[SlotId::Constraints.index()] = SlotReport { state: SlotState::Applied, version_low: version as u8 };
            outbox.handle_report(&reports, at(140.0));
            let late = OrderStatus::Withdrawn(Withdrawal::Late);
            let status = status_of(&outbox, SlotId::Constraints);
            assert_eq!(status, if was_sent { OrderStatus::Applied } else { late }, "{was_sent}");
        }
    }

    #[test]
    fn a_later_order_of_the_series_in_force_supersedes_an_order() {
        let now = Instant::from_secs_f64(5.0);
        for (state, version_low, is_superseded) in [
            (SlotState::Applied, 2, true),
            (SlotState::Applied, 1, false),
            (SlotState::Pending, 2, false),
            (SlotState::Refused(RefusalReason::Unable), 2, false),
        ] {
            let mut outbox = applied(&[hold(true)], now);
            let mut reports = [SlotReport::default(); SLOTS];
            reports[SlotId::Constraints.index()] = SlotReport { state, version_low };
            let decided = outbox.handle_report(&reports, now);
            assert_eq!(decided.contains(&SlotId::Constraints), is_superseded, "{state:?}");
            let superseded = OrderStatus::Withdrawn(Withdrawal::Superseded);
            let expected = if is_superseded { superseded } else { OrderStatus::Applied };
            assert_eq!(status_of(&outbox, SlotId::Constraints), expected, "{state:?}");
        }
    }

    #[test]
    fn an_old_resume_is_withdrawn_and_a_hold_stays() {
        let at = Instant::from_secs_f64;
        for (order, is_withdrawn) in [(hold(false), true), (hold(true), false)] {
            let mut outbox = SlotOutbox::new(Series::from_random(9), true);
            outbox.set_abort_lifetime(Some(Duration::from_secs(120)));
            outbox.issue(order, at(5.0));
            assert!(!outbox.withdraw_late(at(124.0)));
            assert_eq!(outbox.withdraw_late(at(125.0)), is_withdrawn);
        }
    }
}
