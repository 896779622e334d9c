//! The state of a vehicle as messages of ROS 2, for those who publish and those who record it.

use crate::map_cells::MapCells;
use crate::state::{
    ExemplarStage, LinkSummary, MapLabelTree, MissionState, OrderProgress, OrderStatus, StatusReport, UtilityTerms,
    VehicleState,
};
use scenecast_core::{LatLon, TangentPlane};
use scenecast_messages::builtin_interfaces::Time;
use scenecast_messages::contents::{Grid, Place, Stamps, WORLD_FRAME, fix, header, path};
use scenecast_messages::nav_msgs::Path;
use scenecast_messages::scenecast_msgs::{self, LabelTree, Link, Order};
use scenecast_messages::sensor_msgs::NavSatFix;
use scenecast_messages::std_msgs::Header;
use scenecast_protocol::directive::SlotId;
use scenecast_protocol::map::Quantity;
use serde_json::json;

/// Which labels become one at coarser cuts.
pub fn label_tree(vehicle: &VehicleState, tree: &MapLabelTree, header: Header) -> LabelTree {
    let (into, joins) = tree.merges.iter().copied().unzip();
    let clearest = tree.clearest.unwrap_or(0);
    LabelTree { header, vehicle: vehicle.name.clone(), epoch: vehicle.map.epoch.into(), into, joins, clearest }
}

/// An order with its content as the HTTP API takes it; `None` for a position fix, which the surface gives by itself.
pub fn order(
    mission: &MissionState,
    vehicle: &VehicleState,
    slot: &OrderProgress,
    principal: String,
    stamps: &Stamps,
) -> Option<Order> {
    let orders = &vehicle.orders;
    let content = match SlotId::ALL.into_iter().find(|id| id.name() == slot.slot)? {
        SlotId::Utility => {
            let UtilityTerms { exploration, curiosity, weights } = &orders.utility;
            json!({ "weights": weights, "exploration": exploration, "curiosity": curiosity })
        }
        SlotId::Constraints => json!({ "hold": slot.name == "hold", "abort": slot.name == "abort" }),
        SlotId::Fence => json!(orders.fence),
        SlotId::Limits => json!(orders.limits),
        SlotId::Areas => json!(orders.areas),
        SlotId::Destination => json!(orders.destination),
        SlotId::Settings => json!(orders.settings.requested),
        SlotId::Requests => {
            let is_requested = |stage| {
                use ExemplarStage::{NotAvailable, OnAir, Queued, Receiving};
                matches!(stage, Queued | OnAir | NotAvailable | Receiving)
            };
            let requested = vehicle.labels.iter().filter(|label| is_requested(label.exemplar.state));
            json!({ "labels": requested.map(|label| label.id).collect::<Vec<_>>() })
        }
        SlotId::Budget => {
            let LinkSummary { budget_bps, shares, background, .. } = &mission.link;
            json!({ "budget_bps": budget_bps, "shares": shares, "background": background })
        }
        _ => return None,
    };
    Some(Order {
        header: header(stamps.at(slot.issued_s), ""),
        vehicle: vehicle.name.clone(),
        principal,
        slot: slot.slot.clone(),
        version: slot.version.into(),
        content: content.to_string(),
    })
}

/// How far an order has come.
pub fn order_status(vehicle: &VehicleState, slot: &OrderProgress, stamps: &Stamps) -> scenecast_msgs::OrderStatus {
    let status = match slot.state {
        OrderStatus::Queued => scenecast_msgs::OrderStatus::QUEUED,
        OrderStatus::OnAir => scenecast_msgs::OrderStatus::ON_AIR,
        OrderStatus::Received => scenecast_msgs::OrderStatus::RECEIVED,
        OrderStatus::Applied => scenecast_msgs::OrderStatus::APPLIED,
        OrderStatus::Refused => scenecast_msgs::OrderStatus::REFUSED,
        OrderStatus::Withdrawn => scenecast_msgs::OrderStatus::WITHDRAWN,
    };
    scenecast_msgs::OrderStatus {
        header: header(stamps.at(slot.changed_s), ""),
        vehicle: vehicle.name.clone(),
        slot: slot.slot.clone(),
        version: slot.version.into(),
        status,
        reason: slot.reason.clone().unwrap_or_default(),
        given: stamps.at(slot.issued_s),
    }
}

/// The track of a vehicle in the world frame, at the depth of its last report.
pub fn track(vehicle: &VehicleState, status: &StatusReport, stamps: &Stamps) -> Path {
    let places =
        vehicle.track.iter().map(|&(s, east, north)| place_on_path(vehicle, status, stamps.at(s), (east, north)));
    path(&places.collect::<Vec<_>>(), header(stamps.at(status.at_s), WORLD_FRAME))
}

/// The waypoints ahead of a vehicle, likewise.
pub fn plan(vehicle: &VehicleState, status: &StatusReport, stamps: &Stamps) -> Path {
    let stamp = stamps.at(status.at_s);
    let waypoints = status.plan.waypoint.iter().chain(&status.plan.path);
    let places = waypoints.map(|&waypoint| place_on_path(vehicle, status, stamp.clone(), waypoint));
    path(&places.collect::<Vec<_>>(), header(stamp.clone(), WORLD_FRAME))
}

fn place_on_path(vehicle: &VehicleState, status: &StatusReport, stamp: Time, (east, north): (f64, f64)) -> Place {
    let shift = vehicle.map.shift_m();
    Place { stamp, position_m: [east + shift.0, north + shift.1, status.pose.z_m], heading_rad: 0.0 }
}

/// A map with its layers as a grid in the world frame; `None` without cells, or with too many for a message.
pub fn grid(cells: &MapCells, shift_m: (f64, f64)) -> Option<Grid> {
    let mut grid = Grid::new(cells.bounds?, cells.cell_m, shift_m, |cell| cells.label(cell))?;
    for layer in &cells.layers {
        let descriptor = &layer.descriptor;
        grid.add_layer(&descriptor.name, descriptor.quantity == Quantity::Depth, |cell| layer.value(cell));
    }
    Some(grid)
}

/// The measurements of the link to a vehicle.
pub fn link(mission: &MissionState, vehicle: &VehicleState, stamps: &Stamps) -> Link {
    let (link, channel) = (&mission.link, &vehicle.link);
    Link {
        header: header(stamps.now(), ""),
        vehicle: vehicle.name.clone(),
        budget_bps: link.budget_bps,
        sent_bps: link.down.bps_1min as f32,
        received_bps: link.up.bps_1min as f32,
        loss: channel.up.loss as f32,
        round_trip_s: channel.round_trip_s.map_or(f32::NAN, |s| s as f32),
        age_s: vehicle.last_received_s.map_or(f32::NAN, |at| (mission.now_s - at) as f32),
        backlog_bits: channel.backlog.as_ref().map_or(0, |backlog| backlog.bits),
    }
}

/// The place of a vehicle by its report, in the world frame, where its map lies `shift_m` east and north.
pub fn place(status: &StatusReport, shift_m: (f64, f64), stamps: &Stamps) -> Place {
    let pose = &status.pose;
    Place {
        stamp: stamps.at(status.at_s),
        position_m: [pose.x_m + shift_m.0, pose.y_m + shift_m.1, pose.z_m],
        heading_rad: pose.heading_deg.to_radians(),
    }
}

/// A place on the Earth; `None` without an origin of the mission.
pub fn place_on_earth(mission: &MissionState, place: &Place, sigma_m: f64) -> Option<NavSatFix> {
    let origin = mission.mission.origin.and_then(|o| LatLon::new(o.lat_deg, o.lon_deg))?;
    let [east, north, _] = place.position_m;
    let on_earth = TangentPlane::new(origin).to_place(east, north);
    Some(fix(on_earth, sigma_m, header(place.stamp.clone(), WORLD_FRAME)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_recorded_as_sent_whatever_is_on_the_map() {
        let mut vehicle = VehicleState::default();
        vehicle.orders.utility.weights = [(9, 0.5)].into();
        let slot = OrderProgress {
            slot: SlotId::Utility.name().to_owned(),
            name: SlotId::Utility.name().to_owned(),
            version: 1,
            state: OrderStatus::Applied,
            reason: None,
            asks: false,
            issued_s: 1.0,
            changed_s: 2.0,
        };
        let order = order(&MissionState::default(), &vehicle, &slot, String::new(), &Stamps::default()).unwrap();
        let content: serde_json::Value = serde_json::from_str(&order.content).unwrap();
        assert_eq!(content["weights"], json!({ "9": 0.5 }));
    }
}
