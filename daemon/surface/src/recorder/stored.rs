//! The surface's types as they are stored, and back.

use crate::exemplar_cache::{OpenRequest, RequestState, StoredExemplar};
use crate::given_orders::SettingsRecord;
use crate::record::{StoredContact, StoredImage, StoredIntent, StoredOrder, StoredPlaces, StoredRange, StoredRequest};
use crate::vehicle_record::VehicleRecord;
use scenecast_protocol::directive::{
    Areas, Destination, ExemplarRequest, Fence, Limits, OrderStatus, RefusalReason, Settings, Slot, SlotProgress,
    Utility, VersionedSlot, Withdrawal,
};
use scenecast_protocol::exemplar::ExemplarView;
use scenecast_protocol::link::PeerView;
use scenecast_protocol::time::Instant;

/// Room for a status with everything in it, bytes.
const STATUS_ROOM: usize = 1024;
/// Added to the code of a reason of refusal.
const REFUSED: u8 = 16;
/// Added to the place of a reason to withdraw an order among all of them.
const WITHDRAWN: u8 = 64;

pub(super) fn slot_bytes(slot: &Slot) -> Vec<u8> {
    VersionedSlot::encode(0, slot)
}

pub(super) fn slot(bytes: &[u8]) -> Option<Slot> {
    VersionedSlot::decode(bytes).ok()?.content
}

pub(super) fn contact(record: &VehicleRecord, view: &PeerView<'_>) -> StoredContact {
    let (status, last_received) = (record.status(view), record.last_received(view));
    StoredContact {
        last_received: last_received.map(Instant::as_micros),
        pause: record.pauses.expected().map(|d| d.as_micros() as u64),
        status: status.and_then(|(status, at)| {
            let report = status.encode_report(STATUS_ROOM, 0)?.0;
            Some((at.as_micros(), status.encode_pose(STATUS_ROOM), report))
        }),
        usbl: record.found.map(|(line, at)| StoredRange {
            at: at.as_micros(),
            remote: line.remote.into(),
            range_m: line.range_m,
            direction_rad: line.direction_rad,
            accuracy: line.accuracy,
            age_s: line.age_s,
        }),
    }
}

pub(super) fn order(progress: &SlotProgress) -> StoredOrder {
    let status = match progress.status {
        OrderStatus::Queued => 0,
        OrderStatus::OnAir => 1,
        OrderStatus::Received => 2,
        OrderStatus::Applied => 3,
        OrderStatus::Refused(reason) => REFUSED + reason.code(),
        OrderStatus::Withdrawn(withdrawal) => {
            WITHDRAWN + Withdrawal::ALL.iter().position(|&w| w == withdrawal).unwrap_or_default() as u8
        }
    };
    StoredOrder {
        version: progress.version.into(),
        slot: slot_bytes(&progress.slot),
        status,
        issued: progress.issued.as_micros(),
        changed: progress.changed.as_micros(),
    }
}

/// `None` if the slot has another layout in this build.
pub(super) fn progress(order: &StoredOrder) -> Option<SlotProgress> {
    let slot = slot(&order.slot)?;
    let status = match order.status {
        0 => OrderStatus::Queued,
        1 => OrderStatus::OnAir,
        2 => OrderStatus::Received,
        3 => OrderStatus::Applied,
        code @ WITHDRAWN.. => OrderStatus::Withdrawn(*Withdrawal::ALL.get(usize::from(code - WITHDRAWN))?),
        code => OrderStatus::Refused(RefusalReason::from_code(code.checked_sub(REFUSED)?)?),
    };
    Some(SlotProgress {
        id: slot.id(),
        version: order.version.try_into().ok()?,
        slot,
        status,
        issued: Instant::from_micros(order.issued),
        changed: Instant::from_micros(order.changed),
        sent: None,
    })
}

pub(super) fn intent(record: &VehicleRecord) -> StoredIntent {
    let fence = |fence: &Fence| slot_bytes(&Slot::Fence(fence.clone()));
    let limits = |limits: &Limits| slot_bytes(&Slot::Limits(*limits));
    let (requested, in_force, settings_unsure) = record.orders.settings.parts();
    StoredIntent {
        utility: slot_bytes(&Slot::Utility(record.orders.utility.clone())),
        weighed: record.orders.weighed,
        fence: record.orders.fence.sent.as_ref().map(fence),
        limits: record.orders.limits.sent.as_ref().map(limits),
        fence_in_force: record.orders.fence.in_force.as_ref().map(|(version, f)| (*version, fence(f))),
        limits_in_force: record.orders.limits.in_force.as_ref().map(|(version, l)| (*version, limits(l))),
        settings_requested: slot_bytes(&Slot::Settings(requested)),
        settings_in_force: slot_bytes(&Slot::Settings(in_force)),
        settings_unsure,
    }
}

pub(super) fn places(record: &VehicleRecord) -> StoredPlaces {
    let areas = |areas: &Areas| slot_bytes(&Slot::Areas(areas.clone()));
    let place = |place: &Destination| slot_bytes(&Slot::Destination(*place));
    StoredPlaces {
        areas: record.orders.areas.sent.as_ref().map(areas),
        areas_in_force: record.orders.areas.in_force.as_ref().map(|(version, a)| (*version, areas(a))),
        destination: record.orders.destination.sent.as_ref().map(place),
        destination_in_force: record.orders.destination.in_force.as_ref().map(|(version, d)| (*version, place(d))),
    }
}

/// Puts areas and destination back into the record, as far as this build reads them.
pub(super) fn restore_places(stored: &StoredPlaces, record: &mut VehicleRecord) {
    let areas = |bytes: &Vec<u8>| match slot(bytes) {
        Some(Slot::Areas(areas)) => Some(areas),
        _ => None,
    };
    let place = |bytes: &Vec<u8>| match slot(bytes) {
        Some(Slot::Destination(destination)) => Some(destination),
        _ => None,
    };
    record.orders.areas.sent = stored.areas.as_ref().and_then(areas);
    record.orders.areas.in_force = stored.areas_in_force.as_ref().and_then(|(v, bytes)| Some((*v, areas(bytes)?)));
    record.orders.destination.sent = stored.destination.as_ref().and_then(place);
    record.orders.destination.in_force =
        stored.destination_in_force.as_ref().and_then(|(v, bytes)| Some((*v, place(bytes)?)));
}

/// Puts the orders back into the record, as far as this build reads them.
pub(super) fn restore_intent(stored: &StoredIntent, record: &mut VehicleRecord) {
    let utility = |bytes: &[u8]| match slot(bytes) {
        Some(Slot::Utility(utility)) => utility,
        _ => Utility::default(),
    };
    let fence = |bytes: &Vec<u8>| match slot(bytes) {
        Some(Slot::Fence(fence)) => Some(fence),
        _ => None,
    };
    let limits = |bytes: &Vec<u8>| match slot(bytes) {
        Some(Slot::Limits(limits)) => Some(limits),
        _ => None,
    };
    let settings = |bytes: &[u8]| match slot(bytes) {
        Some(Slot::Settings(settings)) => settings,
        _ => Settings::default(),
    };
    (record.orders.utility, record.orders.weighed) = (utility(&stored.utility), stored.weighed);
    record.orders.fence.sent = stored.fence.as_ref().and_then(fence);
    record.orders.limits.sent = stored.limits.as_ref().and_then(limits);
    record.orders.fence.in_force = stored.fence_in_force.as_ref().and_then(|(v, bytes)| Some((*v, fence(bytes)?)));
    record.orders.limits.in_force = stored.limits_in_force.as_ref().and_then(|(v, bytes)| Some((*v, limits(bytes)?)));
    let (requested, in_force) = (settings(&stored.settings_requested), settings(&stored.settings_in_force));
    record.orders.settings = SettingsRecord::of_parts(requested, in_force, stored.settings_unsure);
}

pub(super) fn image(exemplar: &StoredExemplar) -> StoredImage {
    StoredImage {
        number: exemplar.number,
        size: exemplar.size,
        webp: exemplar.webp.clone(),
        sent_bytes: exemplar.sent_bytes as u32,
        received: exemplar.received.as_micros(),
        requested: exemplar.requested,
        width_mm: exemplar.view.width_mm,
        middle_dm: (exemplar.view.east_dm, exemplar.view.north_dm),
        taken: exemplar.taken.map(Instant::as_micros),
    }
}

pub(super) fn exemplar(image: &StoredImage) -> StoredExemplar {
    StoredExemplar {
        number: image.number,
        size: image.size,
        webp: image.webp.clone(),
        sent_bytes: image.sent_bytes as usize,
        received: Instant::from_micros(image.received),
        requested: image.requested,
        view: ExemplarView {
            width_mm: image.width_mm,
            east_dm: image.middle_dm.0,
            north_dm: image.middle_dm.1,
            clock_ms: None,
        },
        taken: image.taken.map(Instant::from_micros),
    }
}

pub(super) fn request(open: &OpenRequest) -> StoredRequest {
    let (state, held) = match open.state {
        RequestState::Ordered => (0, (0, 0)),
        RequestState::NoneYet => (1, (0, 0)),
        RequestState::Arriving(held, total) => (2, (held as u32, total as u32)),
        RequestState::Refused => (3, (0, 0)),
    };
    let ExemplarRequest { serial, size, picture, .. } = open.request;
    StoredRequest { serial, size, picture, state, held, changed: open.changed.as_micros() }
}

pub(super) fn open_request(label: u8, stored: &StoredRequest) -> OpenRequest {
    let StoredRequest { serial, size, picture, state, held, changed } = *stored;
    let state = match state {
        1 => RequestState::NoneYet,
        2 => RequestState::Arriving(held.0 as usize, held.1 as usize),
        3 => RequestState::Refused,
        _ => RequestState::Ordered,
    };
    let request = ExemplarRequest { label, serial, size, picture };
    OpenRequest { request, state, changed: Instant::from_micros(changed) }
}
