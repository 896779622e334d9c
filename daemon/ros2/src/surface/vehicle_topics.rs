//! The topics of one vehicle at the surface: their names, its pose, path, plan and position.

use super::Desk;
use super::health::health;
use super::map::MapTopics;
use super::orders::OrderTopics;
use crate::node::{Publisher, RosNode};
use crate::transport::Qos;
use crate::valid_part;
use scenecast_core::UserError;
use scenecast_messages::contents::{Stamps, WORLD_FRAME, diagnostics, exemplar_jpeg, header, pose};
use scenecast_messages::diagnostic_msgs::DiagnosticArray;
use scenecast_messages::geometry_msgs::PoseWithCovarianceStamped;
use scenecast_messages::nav_msgs::Path;
use scenecast_messages::scenecast_msgs::{self, Event};
use scenecast_messages::sensor_msgs::{CompressedImage, NavSatFix};
use scenecast_messages::std_msgs::Header;
use scenecast_surface::messages::{label_tree, order_status, place, place_on_earth, plan, track};
use scenecast_surface::state::{MapLabelTree, MissionState, OrderStatus, VehicleState};
use scenecast_surface::{ClientRequest, Reply, SurfaceRequest};
use std::collections::{BTreeMap, BTreeSet};
use std::time::{Duration, Instant};

const DIAGNOSTICS_INTERVAL: Duration = Duration::from_secs(1);
/// Exemplars that are kept for later subscribers: one for each label.
const EXEMPLARS: usize = 254;
/// Order states that are kept for later subscribers: one for each slot.
const SLOTS: usize = 10;

/// The topics of one vehicle.
pub(super) struct VehicleTopics {
    map: MapTopics,
    tree: Publisher<scenecast_msgs::LabelTree>,
    /// Epoch and tree that were published.
    tree_published: Option<(u8, MapLabelTree)>,
    state: StateTopics,
    exemplars: Publisher<CompressedImage>,
    /// Label and number of the exemplars that were published, of this epoch.
    published: (u8, BTreeSet<(u8, u8)>),
    diagnostics: Publisher<DiagnosticArray>,
    last_diagnostics: Option<Instant>,
    order_status: Publisher<scenecast_msgs::OrderStatus>,
    /// Version and state by slot, as published.
    orders_published: BTreeMap<String, (u16, OrderStatus)>,
    events: Publisher<Event>,
    orders: Option<OrderTopics>,
}

impl VehicleTopics {
    /// The topics below this part of their names.
    pub fn new(node: &RosNode, part: &str, takes_orders: bool) -> Result<Self, UserError> {
        let topic = |name: &str| node.own_topic(&format!("{part}/{name}"));
        Ok(Self {
            map: MapTopics::new(node, part)?,
            tree: node.publisher(&topic("label_tree")?, Qos::Latched(1))?,
            tree_published: None,
            state: StateTopics::new(node, part)?,
            exemplars: node.publisher(&topic("exemplars")?, Qos::Latched(EXEMPLARS))?,
            published: (0, BTreeSet::new()),
            diagnostics: node.publisher(&topic("diagnostics")?, Qos::Reliable(10))?,
            last_diagnostics: None,
            order_status: node.publisher(&topic("order_status")?, Qos::Latched(SLOTS))?,
            orders_published: BTreeMap::new(),
            events: node.publisher(&topic("events")?, Qos::Reliable(100))?,
            orders: takes_orders.then(|| OrderTopics::new(node, part)).transpose()?,
        })
    }

    /// Requests what was ordered, and reports what became of it.
    pub fn handle_orders(&mut self, desk: &Desk, vehicle: &VehicleState, stamps: &Stamps) {
        let Some(orders) = &mut self.orders else { return };
        for (level, text) in orders.handle(desk, vehicle) {
            match level {
                Event::INFO => tracing::info!("ROS 2: {}: {text}", vehicle.name),
                _ => tracing::warn!("ROS 2: {}: {text}", vehicle.name),
            }
            let (header, name) = (header(stamps.now(), WORLD_FRAME), vehicle.name.clone());
            self.events.publish(Event { header, vehicle: name, level, source: "ros2".to_owned(), text });
        }
    }

    /// Publishes what has changed and has subscribers.
    pub fn publish(
        &mut self,
        node: &RosNode,
        desk: &Desk,
        mission: &MissionState,
        vehicle: &VehicleState,
        stamps: &Stamps,
    ) {
        let confirmed = vehicle.map.updated_s.map_or_else(|| stamps.now(), |at| stamps.at(at));
        self.map.publish(desk, vehicle, || header(confirmed.clone(), WORLD_FRAME));
        self.publish_tree(vehicle, || header(confirmed.clone(), WORLD_FRAME));
        self.state.publish(mission, vehicle, stamps);
        self.publish_exemplars(desk, vehicle, stamps);
        self.publish_orders(vehicle, stamps);
        let is_due = self.last_diagnostics.is_none_or(|last| last.elapsed() >= DIAGNOSTICS_INTERVAL);
        if is_due && self.diagnostics.subscribers() > 0 {
            self.last_diagnostics = Some(Instant::now());
            let parts = health(vehicle, stamps.now_s()).into_iter().chain([node.health()]);
            self.diagnostics.publish(diagnostics(parts, &vehicle.name, header(stamps.now(), "")));
        }
    }

    /// Publishes the tree of the labels when it has changed.
    fn publish_tree(&mut self, vehicle: &VehicleState, header: impl Fn() -> Header) {
        let Some(tree) = vehicle.label_tree.as_ref().filter(|_| self.tree.subscribers() > 0) else { return };
        let found = (vehicle.map.epoch, tree.clone());
        if self.tree_published.as_ref() == Some(&found) {
            return;
        }
        let message = label_tree(vehicle, tree, header());
        // One that was refused is tried again.
        if self.tree.publish(message) {
            self.tree_published = Some(found);
        }
    }

    /// Publishes each exemplar once, as one for each call, in the frame `label_N`.
    fn publish_exemplars(&mut self, desk: &Desk, vehicle: &VehicleState, stamps: &Stamps) {
        if self.exemplars.subscribers() == 0 {
            return;
        }
        if self.published.0 != vehicle.map.epoch {
            self.published = (vehicle.map.epoch, BTreeSet::new());
        }
        let images =
            vehicle.labels.iter().flat_map(|label| label.exemplar.images.iter().map(|image| (label.id, image)));
        let Some((label, image)) = images.into_iter().find(|(l, i)| !self.published.1.contains(&(*l, i.number))) else {
            return;
        };
        let request = SurfaceRequest::Exemplar(vehicle.id, label, Some(image.number));
        match desk.request(ClientRequest { by: None, request }) {
            Some(Reply::File(_, webp)) => {
                let header = header(stamps.at(image.at_s), &format!("label_{label}"));
                if exemplar_jpeg(&webp, header).is_some_and(|message| !self.exemplars.publish(message)) {
                    // It was refused: it is tried again.
                    return;
                }
            }
            // It was replaced meanwhile.
            Some(_) => {}
            None => return,
        }
        self.published.1.insert((label, image.number));
    }

    fn publish_orders(&mut self, vehicle: &VehicleState, stamps: &Stamps) {
        if self.order_status.subscribers() == 0 {
            return;
        }
        for slot in &vehicle.orders.directive.slots {
            let state = (slot.version, slot.state);
            if self.orders_published.get(&slot.slot) == Some(&state) {
                continue;
            }
            let message = order_status(vehicle, slot, stamps);
            if self.order_status.publish(message) {
                self.orders_published.insert(slot.slot.clone(), state);
            }
        }
    }
}

/// What depends on the last report of a vehicle.
pub(super) struct StateTopics {
    pose: Publisher<PoseWithCovarianceStamped>,
    path: Publisher<Path>,
    plan: Publisher<Path>,
    fix: Publisher<NavSatFix>,
    /// The mission time of the report that was published last.
    last_s: Option<f64>,
}

impl StateTopics {
    pub fn new(node: &RosNode, part: &str) -> Result<Self, UserError> {
        let topic = |name: &str| node.own_topic(&format!("{part}/{name}"));
        Ok(Self {
            pose: node.publisher(&topic("pose")?, Qos::Reliable(10))?,
            path: node.publisher(&topic("path")?, Qos::Reliable(1))?,
            plan: node.publisher(&topic("plan")?, Qos::Reliable(1))?,
            fix: node.publisher(&topic("fix")?, Qos::Reliable(10))?,
            last_s: None,
        })
    }

    /// Publishes each report once, in the world frame, for those who subscribe.
    pub fn publish(&mut self, mission: &MissionState, vehicle: &VehicleState, stamps: &Stamps) {
        let Some(status) = vehicle.status.as_ref().filter(|status| self.last_s != Some(status.at_s)) else { return };
        self.last_s = Some(status.at_s);
        let place = place(status, vehicle.map.shift_m(), stamps);
        if self.pose.subscribers() > 0 {
            self.pose.publish(pose(&place, status.pose.sigma_m, WORLD_FRAME));
        }
        if self.path.subscribers() > 0 {
            self.path.publish(track(vehicle, status, stamps));
        }
        if self.plan.subscribers() > 0 {
            self.plan.publish(plan(vehicle, status, stamps));
        }
        if self.fix.subscribers() > 0
            && let Some(fix) = place_on_earth(mission, &place, status.pose.sigma_m)
        {
            self.fix.publish(fix);
        }
    }
}

/// Which vehicle has which part, with its address and its name.
#[derive(Debug, Default)]
pub(super) struct Parts(BTreeMap<String, (u8, String)>);

impl Parts {
    /// The parts of these vehicles, by address and name.
    ///
    /// # Errors
    ///
    /// Two vehicles whose topics would be the same.
    pub fn new(vehicles: impl IntoIterator<Item = (u8, String)>) -> Result<Self, UserError> {
        let mut parts = Self::default();
        vehicles.into_iter().try_for_each(|(address, name)| parts.claim(address, &name).map(drop))?;
        Ok(parts)
    }

    /// The part of a vehicle.
    ///
    /// # Errors
    ///
    /// Another vehicle has it, so that an order to one would go to both.
    pub fn claim(&mut self, address: u8, name: &str) -> Result<String, UserError> {
        let part = valid_part(name);
        let (owner, other) = self.0.entry(part.clone()).or_insert_with(|| (address, name.to_owned()));
        if *owner == address {
            return Ok(part);
        }
        let vehicles = format!("{other:?} (address {owner}) and {name:?} (address {address})");
        Err(UserError::Input(format!(
            "ROS 2: the vehicles {vehicles} would share the topics {part}/...; choose a vehicle.name that differs in letters \
             or digits"
        )))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parts(names: &[&str]) -> Result<Parts, UserError> {
        Parts::new((1..).zip(names.iter().map(|&name| name.to_owned())))
    }

    #[test]
    fn vehicles_with_the_same_topics_are_refused() {
        assert!(parts(&["auv-1", "auv-2"]).is_ok());
        let refusal = parts(&["auv-1", "auv_1"]).unwrap_err();
        assert!(matches!(refusal, UserError::Input(_)));
        let text = refusal.to_string();
        assert!(
            text.contains("\"auv-1\" (address 1) and \"auv_1\" (address 2)") && text.contains("auv_1/..."),
            "{text}"
        );
        assert!(parts(&["auv", "auv"]).is_err());
        let long = "a".repeat(64);
        assert!(parts(&[&format!("{long}1"), &format!("{long}2")]).is_err(), "names are cut");
    }

    #[test]
    fn a_vehicle_that_is_found_later_takes_no_topics_of_others() {
        let mut parts = parts(&["vehicle-2"]).unwrap();
        assert!(parts.claim(2, "vehicle 2").is_err());
        assert_eq!(parts.claim(1, "vehicle-2").unwrap(), "vehicle_2");
        assert_eq!(parts.claim(3, "vehicle 3").unwrap(), "vehicle_3");
    }
}
