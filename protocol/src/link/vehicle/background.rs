//! Background streams: content that uses the spare capacity of the link, in the operator's order.

use super::content::VehicleContent;
use super::planes::PlaneOut;
use crate::map::StateSource;
use crate::schedule::{BitBudget, Extra};
use crate::time::Instant;

impl<S: StateSource> VehicleContent<S> {
    /// Whether the waiting cells of the map are themselves a background stream.
    pub(super) fn is_refining(&self) -> bool {
        self.spend.has(Extra::Finer) && self.source.is_refining()
    }

    /// The background streams that wait and may be sent now. There is spare capacity while less than half of the
    /// budget's window was used, so that urgent content that comes up next finds room. While finer cells wait, the
    /// streams that the operator lists before them may be sent too.
    pub(super) fn extras(&self, budget: &BitBudget, now: Instant) -> impl Iterator<Item = Extra> {
        let (spare, refining) = (budget.is_plentiful(now), self.is_refining());
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

    /// About how many bytes of background streams, without the map's finer cells, wait and may be sent.
    pub(super) fn extra_backlog(&self, budget: &BitBudget, now: Instant) -> usize {
        self.extras(budget, now).filter(|&e| e != Extra::Finer).map(|e| self.waiting_bytes(e)).sum()
    }

    /// Whether no plane and no background object waits that may be sent, and none is outstanding.
    pub(super) fn extras_are_quiet(&self, budget: &BitBudget, now: Instant) -> bool {
        let objects = self.objects.has_no_extra() || self.objects.extra_backlog_bytes() > 0;
        let planes = self.planes().all(|p| p.is_quiet() || p.backlog_bytes() > 0) && self.shared_plane_backlog() == 0;
        objects && planes && self.extra_backlog(budget, now) == 0
    }
}
