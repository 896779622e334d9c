//! What bits that nobody else needs are spent on, in the operator's order.

use super::VehicleLink;
use super::planes::PlaneOut;
use crate::map::StateSource;
use crate::object::ObjectId;
use crate::schedule::{Extra, SpendOrder};
use crate::time::Instant;

impl<S: StateSource> VehicleLink<S> {
    /// Changes what left-over bits are spent on.
    pub fn set_spend(&mut self, order: SpendOrder) {
        self.spend = order;
    }

    /// What left-over bits are spent on.
    pub fn spend(&self) -> SpendOrder {
        self.spend
    }

    /// Queues an object that is only worth bits that are left over ([`Extra::Exemplars`]).
    pub fn push_extra_object(&mut self, bytes: Vec<u8>) -> Option<ObjectId> {
        self.objects.push_extra(bytes)
    }

    /// Whether the cells of the state that wait are an extra themselves.
    pub(super) fn is_refining(&self) -> bool {
        self.spend.has(Extra::Finer) && self.source.is_refining()
    }

    /// What waits for left-over bits and may have them now. Bits are left over while less than half of what the budget
    /// allows in a window was sent, so that what comes up next finds room. What the operator puts before finer cells goes
    /// before them while they wait, too.
    pub(super) fn extras(&self, now: Instant) -> impl Iterator<Item = Extra> {
        let (spare, refining) = (self.budget.is_plentiful(now), self.is_refining());
        let finer = self.spend.iter().position(|e| e == Extra::Finer).filter(|_| refining);
        let allowed = move |place: usize| spare || finer.is_some_and(|finer| place <= finer);
        let in_order = self.spend.iter().enumerate();
        in_order.filter(move |&(place, extra)| allowed(place) && self.waiting_bytes(extra) > 0).map(|(_, extra)| extra)
    }

    fn waiting_bytes(&self, extra: Extra) -> usize {
        match extra {
            Extra::Finer if self.is_refining() => self.source.backlog_bytes(),
            Extra::Finer => 0,
            Extra::Exemplars => self.objects.extra_backlog_bytes(),
            Extra::Depth | Extra::Confidence | Extra::Curiosity => {
                let of_extra = |p: &&PlaneOut| p.is_told && !p.has_share && p.class() == extra.class();
                self.planes.iter().find(of_extra).map_or(0, |p| p.source.backlog_bytes())
            }
        }
    }

    /// About how many bytes of extras beside the state itself wait and may be sent.
    pub(super) fn extra_backlog(&self, now: Instant) -> usize {
        self.extras(now).filter(|&e| e != Extra::Finer).map(|e| self.waiting_bytes(e)).sum()
    }

    /// Whether no plane and no extra object waits that may be sent, and none is on its way.
    pub(super) fn extras_are_quiet(&self, now: Instant) -> bool {
        let objects = self.objects.has_no_extra() || self.objects.extra_backlog_bytes() > 0;
        let planes = self.planes().all(|p| p.is_quiet() || p.backlog_bytes() > 0) && self.shared_plane_backlog() == 0;
        objects && planes && self.extra_backlog(now) == 0
    }
}
