//! The exemplars of a label, and the request for another one.

use crate::state::{ExemplarImage, ExemplarProgress, ExemplarStage, seconds};
use crate::{ExemplarCache, RequestState, StoredExemplar, VehicleRecord};
use scenecast_protocol::directive::{OrderStatus, SlotId};
use scenecast_protocol::exemplar::edge_px;
use scenecast_protocol::link::PeerView;
use scenecast_protocol::wire::Address;

/// `shift_m` moves places of the vehicle's map frame into the world frame.
pub(super) fn progress(
    label: u8,
    record: &VehicleRecord,
    view: &PeerView<'_>,
    address: Address,
    shift_m: (f64, f64),
) -> ExemplarProgress {
    let entry = record.exemplars.label(label);
    let request = entry.and_then(|entry| entry.request);
    let base = format!("/api/v2/vehicles/{}/exemplars/{label}", address.number());
    let images: Vec<ExemplarImage> =
        entry.into_iter().flat_map(|entry| &entry.stored).map(|p| image(p, &base, shift_m)).collect();
    let latest = images.last();
    let (state, progress, bytes) = match request.map(|r| r.state) {
        None if latest.is_some() => (ExemplarStage::Received, 1.0, None),
        None => (ExemplarStage::None, 0.0, None),
        Some(RequestState::Ordered) if is_queued(view) => (ExemplarStage::Queued, 0.0, None),
        Some(RequestState::Ordered) => (ExemplarStage::OnAir, 0.0, None),
        Some(RequestState::NoneYet) => (ExemplarStage::NotAvailable, 0.0, None),
        Some(RequestState::Refused) => (ExemplarStage::Refused, 0.0, None),
        Some(RequestState::Arriving(held, total)) => {
            (ExemplarStage::Receiving, held as f64 / total.max(1) as f64, Some(total))
        }
    };
    ExemplarProgress {
        state,
        progress,
        bytes: bytes.or(latest.map(|i| i.bytes)),
        url: latest.map(|_| format!("{base}.webp")),
        at_s: request.map(|r| seconds(r.changed)).or(latest.map(|i| i.at_s)),
        images,
    }
}

/// A label without images, of which none can be requested.
pub(super) fn none() -> ExemplarProgress {
    let (state, images) = (ExemplarStage::None, Vec::new());
    ExemplarProgress { state, progress: 0.0, bytes: None, url: None, at_s: None, images }
}

fn image(p: &StoredExemplar, base: &str, shift_m: (f64, f64)) -> ExemplarImage {
    let place = p.place_m(shift_m);
    ExemplarImage {
        number: p.number,
        edge_px: edge_px(p.size),
        can_enlarge: p.size < ExemplarCache::MAX_SIZE,
        bytes: p.sent_bytes,
        url: format!("{base}-{}.webp", p.number),
        at_s: seconds(p.received),
        taken_s: p.taken.map(seconds),
        width_m: p.width_m(),
        x_m: place.map(|(east_m, _)| east_m),
        y_m: place.map(|(_, north_m)| north_m),
        requested: p.requested,
    }
}

/// Whether the requests for images have not been sent yet.
fn is_queued(view: &PeerView<'_>) -> bool {
    let requests = view.slots().find(|s| s.id == SlotId::Requests).map(|s| s.status);
    matches!(requests, Some(OrderStatus::Queued) | None)
}
