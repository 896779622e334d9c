//! The state of a vehicle as messages of ROS 2, for those who publish and those who record it.

use crate::state::{MapLabelTree, MissionState, OrderProgress, OrderStatus, StatusReport, VehicleState};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use scenecast_core::{LatLon, TangentPlane};
use scenecast_messages::contents::{Place, Stamps, WORLD_FRAME, fix, header};
use scenecast_messages::scenecast_msgs::{self, LabelTree};
use scenecast_messages::sensor_msgs::NavSatFix;
use scenecast_messages::std_msgs::Header;
use scenecast_protocol::map::{LayerDescriptor, Quantity};
use serde::{Deserialize, Serialize};

/// Which labels become one at coarser cuts.
pub fn label_tree(vehicle: &VehicleState, tree: &MapLabelTree, header: Header) -> LabelTree {
    let (into, joins) = tree.merges.iter().copied().unzip();
    let clearest = tree.clearest.unwrap_or(0);
    LabelTree { header, vehicle: vehicle.name.clone(), epoch: vehicle.map.epoch.into(), into, joins, clearest }
}

/// The meaning of a layer's levels in a record, as JSON.
#[derive(Serialize, Deserialize)]
struct LayerText {
    name: String,
    unit: String,
    is_depth: bool,
    /// The bounds of levels in units: level n lies from `edges[n - 1]` to `edges[n]`.
    edges: Vec<f64>,
    /// Base64 of the descriptor's bytes on the wire.
    descriptor: String,
}

/// The meaning of a layer's levels as text for a record.
pub fn layer_text(descriptor: &LayerDescriptor) -> String {
    let bounds = |level| descriptor.bounds(level).unwrap_or_default();
    let text = LayerText {
        name: descriptor.name.clone().into_owned(),
        unit: descriptor.unit.clone().into_owned(),
        is_depth: descriptor.quantity == Quantity::Depth,
        edges: (1..=descriptor.levels).map(|n| bounds(n).0).chain([bounds(descriptor.levels).1]).collect(),
        descriptor: STANDARD.encode(descriptor.to_bytes()),
    };
    // Strings, numbers and lists of these, so this cannot fail.
    serde_json::to_string(&text).unwrap_or_default()
}

/// Reads [`layer_text`]; `None` if it is another text.
pub(crate) fn layer_of_text(text: &str) -> Option<LayerDescriptor> {
    let text: LayerText = serde_json::from_str(text).ok()?;
    LayerDescriptor::from_bytes(&STANDARD.decode(text.descriptor).ok()?)
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
