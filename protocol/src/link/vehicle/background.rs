//! Background streams: content that uses the spare capacity of the link, in the operator's order.

use super::content::VehicleContent;
use super::layers::LayerOut;
use crate::map::StateSource;
use crate::schedule::{BackgroundStream, BitBudget};
use crate::time::Instant;

impl<S: StateSource> VehicleContent<S> {
    /// Whether the waiting cells of the map are themselves a background stream.
    pub(super) fn is_refining(&self) -> bool {
        self.background.has(BackgroundStream::Finer) && self.source.is_refining()
    }

    /// The background streams that wait and may be sent now. There is spare capacity while less than half of the
    /// budget's window was used, so that urgent content that comes up next finds room. While finer cells wait, the
    /// streams that the operator lists before them may be sent too.
    pub(super) fn background_streams(
        &self,
        budget: &BitBudget,
        now: Instant,
    ) -> impl Iterator<Item = BackgroundStream> {
        let (spare, refining) = (budget.is_plentiful(now), self.is_refining());
        let finer = self.background.iter().position(|s| s == BackgroundStream::Finer).filter(|_| refining);
        let allowed = move |place: usize| spare || finer.is_some_and(|finer| place <= finer);
        let in_order = self.background.iter().enumerate();
        in_order
            .filter(move |&(place, stream)| allowed(place) && self.waiting_bytes(stream) > 0)
            .map(|(_, stream)| stream)
    }

    fn waiting_bytes(&self, stream: BackgroundStream) -> usize {
        match stream {
            BackgroundStream::Finer if self.is_refining() => self.source.backlog_bytes(),
            BackgroundStream::Finer => 0,
            BackgroundStream::Exemplars => self.objects.background_backlog_bytes(),
            BackgroundStream::Layer(id) => {
                let of_stream = |l: &&LayerOut| l.is_selected && !l.has_share() && l.source.id() == id;
                self.layers.iter().find(of_stream).map_or(0, |l| l.source.backlog_bytes())
            }
        }
    }

    /// About how many bytes of background streams, without the map's finer cells, wait and may be sent.
    pub(super) fn background_backlog(&self, budget: &BitBudget, now: Instant) -> usize {
        self.background_streams(budget, now)
            .filter(|&e| e != BackgroundStream::Finer)
            .map(|e| self.waiting_bytes(e))
            .sum()
    }

    /// Whether no layer and no background object waits that may be sent, and none is outstanding.
    pub(super) fn background_is_quiet(&self, budget: &BitBudget, now: Instant) -> bool {
        let objects = self.objects.has_no_background() || self.objects.background_backlog_bytes() > 0;
        let layers = self.layers().all(|l| l.is_quiet() || l.backlog_bytes() > 0) && self.shared_layer_backlog() == 0;
        objects && layers && self.background_backlog(budget, now) == 0
    }
}
