//! The topics of one vehicle at the surface.

use super::Desk;
use super::health::health;
use super::map::MapTopics;
use super::orders::OrderTopics;
use super::stamps::Stamps;
use super::state::StateTopics;
use crate::node::Publisher;
use crate::node::RosNode;
use crate::transport::Qos;
use scenecast_console::state::{MapLabelTree, MissionState, OrderStatus, VehicleState};
use scenecast_console::{ClientRequest, Reply, SurfaceRequest};
use scenecast_core::UserError;
use scenecast_messages::diagnostic_msgs::DiagnosticArray;
use scenecast_messages::scenecast_msgs::{self, Event};
use scenecast_messages::sensor_msgs::CompressedImage;
use scenecast_messages::std_msgs::Header;
use scenecast_outlets::{WORLD_FRAME, diagnostics, exemplar_jpeg, header};
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
        let (into, joins) = tree.merges.iter().copied().unzip();
        let message = scenecast_msgs::LabelTree {
            header: header(),
            vehicle: vehicle.name.clone(),
            epoch: vehicle.map.epoch.into(),
            into,
            joins,
            clearest: tree.clearest.unwrap_or(0),
        };
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
            let message = scenecast_msgs::OrderStatus {
                header: header(stamps.at(slot.changed_s), ""),
                vehicle: vehicle.name.clone(),
                slot: slot.slot.clone(),
                version: slot.version.into(),
                status: status(slot.state),
                reason: slot.reason.clone().unwrap_or_default(),
                given: stamps.at(slot.issued_s),
            };
            if self.order_status.publish(message) {
                self.orders_published.insert(slot.slot.clone(), state);
            }
        }
    }
}

fn status(state: OrderStatus) -> u8 {
    match state {
        OrderStatus::Queued => scenecast_msgs::OrderStatus::QUEUED,
        OrderStatus::OnAir => scenecast_msgs::OrderStatus::ON_AIR,
        OrderStatus::Received => scenecast_msgs::OrderStatus::RECEIVED,
        OrderStatus::Applied => scenecast_msgs::OrderStatus::APPLIED,
        OrderStatus::Refused => scenecast_msgs::OrderStatus::REFUSED,
        OrderStatus::Withdrawn => scenecast_msgs::OrderStatus::WITHDRAWN,
    }
}
