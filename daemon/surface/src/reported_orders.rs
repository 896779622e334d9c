//! The orders in force by the vehicle's reports, also those that this surface has not given.

use super::given_orders::SentOrder;
use super::vehicle_record::VehicleRecord;
use scenecast_protocol::directive::{Destination, OrderStatus, RefusalReason, Slot, SlotId};
use scenecast_protocol::link::{InForce, PeerView};
use scenecast_protocol::map::MAX_LABEL;

/// The version of an order in force that another surface, or an earlier run of this one, has given.
const VERSION_OF_OTHERS: u16 = 0;

/// Takes over the contents that the vehicle reports. One that this surface does not know is not shown as in force.
pub(super) fn follow(record: &mut VehicleRecord, view: &PeerView<'_>) {
    follow_order(&mut record.orders.fence, SlotId::Fence, view, |slot| match slot {
        Slot::Fence(fence) => Some(fence.clone()),
        _ => None,
    });
    follow_order(&mut record.orders.limits, SlotId::Limits, view, |slot| match slot {
        Slot::Limits(limits) => Some(*limits),
        _ => None,
    });
    follow_order(&mut record.orders.areas, SlotId::Areas, view, |slot| match slot {
        Slot::Areas(areas) => Some(areas.clone()),
        _ => None,
    });
    follow_order(&mut record.orders.destination, SlotId::Destination, view, |slot| match slot {
        Slot::Destination(destination) => Some(*destination),
        _ => None,
    });
    if let (InForce::Known(Slot::Utility(utility)), None) =
        (view.in_force(SlotId::Utility), status(view, SlotId::Utility))
        && utility.epoch == record.epoch
    {
        // How many labels there were when another surface sent it is not known.
        (record.orders.utility, record.orders.weighed) = (utility.clone(), MAX_LABEL);
    }
    if let (InForce::Known(Slot::Settings(settings)), None) =
        (view.in_force(SlotId::Settings), status(view, SlotId::Settings))
    {
        record.orders.settings.handle_reported(*settings);
    }
}

fn follow_order<T: Clone + Default + PartialEq>(
    order: &mut SentOrder<T>,
    id: SlotId,
    view: &PeerView<'_>,
    content: impl Fn(&Slot) -> Option<T>,
) {
    match view.in_force(id) {
        InForce::NotReported => {}
        // An order without content, such as one that lifts the fence, stays as the last one in force.
        InForce::None => order.in_force = order.in_force.take().filter(|(_, content)| *content == T::default()),
        InForce::Unknown => order.in_force = None,
        InForce::Known(slot) => {
            let Some(content) = content(slot) else { return };
            if order.in_force.as_ref().is_none_or(|(_, known)| *known != content) {
                let own = view.slots().find(|slot| slot.id == id && order.sent.as_ref() == Some(&content));
                order.in_force = Some((own.map_or(VERSION_OF_OTHERS, |slot| slot.version), content.clone()));
            }
            if status(view, id).is_none() {
                order.sent = Some(content);
            }
        }
    }
}

/// Why the vehicle has refused an order: by the orders in force, where its own reason is more general.
pub(super) fn why_refused(record: &VehicleRecord, slot: &Slot, reason: RefusalReason) -> String {
    let fence = record.orders.fence.in_force.as_ref().map(|(_, fence)| fence);
    match (slot, reason, fence) {
        (Slot::Destination(Destination { place: Some(place) }), RefusalReason::Contradiction, Some(fence)) => {
            let kept_out = fence.keep_outs.iter().position(|outline| outline.contains(*place));
            match kept_out {
                _ if fence.fence.as_ref().is_some_and(|outline| !outline.contains(*place)) => {
                    "the place lies outside of the fence in force".to_owned()
                }
                Some(index) => format!("the place lies in keep-out {} of the fence in force", index + 1),
                None => "the place is too near to an outline of the fence in force, or no way leads there".to_owned(),
            }
        }
        (Slot::Destination(_), RefusalReason::Contradiction, None) => "no way leads to the place".to_owned(),
        _ => reason.explain().to_owned(),
    }
}

/// The status of this surface's last order of a kind.
pub(super) fn status(view: &PeerView<'_>, id: SlotId) -> Option<OrderStatus> {
    view.slots().find(|slot| slot.id == id).map(|slot| slot.status)
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenecast_protocol::coordinates::DecimetrePoint;
    use scenecast_protocol::directive::{Fence, Polygon};

    #[test]
    fn a_refused_place_is_explained_by_the_fence_in_force() {
        let square = |from: i32, to: i32| {
            Polygon([(from, from), (to, from), (to, to), (from, to)].map(|(x, y)| DecimetrePoint::new(x, y)).to_vec())
        };
        let mut record = VehicleRecord::new("gannet".to_owned());
        let why = |record: &VehicleRecord, x, y| {
            let place = Some(DecimetrePoint::new(x, y));
            why_refused(record, &Slot::Destination(Destination { place }), RefusalReason::Contradiction)
        };
        assert_eq!(why(&record, 900, 0), "no way leads to the place");
        let fence = Fence { fence: Some(square(0, 500)), keep_outs: vec![square(100, 200)], return_point: None };
        record.orders.fence.in_force = Some((1, fence));
        assert_eq!(why(&record, 900, 0), "the place lies outside of the fence in force");
        assert_eq!(why(&record, 150, 150), "the place lies in keep-out 1 of the fence in force");
        assert!(why(&record, 499, 499).starts_with("the place is too near"));
        let limits = why_refused(&record, &Slot::Limits(Default::default()), RefusalReason::Unable);
        assert_eq!(limits, RefusalReason::Unable.explain());
    }
}
