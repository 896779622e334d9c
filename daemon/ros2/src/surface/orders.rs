//! The orders of ROS 2 to one vehicle.

use super::Desk;
use super::order;
use super::stamps;
use crate::inbox::Inbox;
use crate::node::RosNode;
use crate::transport::Qos;
use scenecast_console::state::VehicleState;
use scenecast_console::{ClientRequest, Reply, SurfaceRequest};
use scenecast_core::{Giver, UserError};
use scenecast_messages::scenecast_msgs::{Abort, Event, Fence, Hold, Utility};
use scenecast_messages::std_msgs::Header;
use std::time::SystemTime;

/// Orders of a kind that wait at most.
const ORDERS: usize = 10;

/// The topics `orders/...` of one vehicle.
pub(super) struct OrderTopics {
    utility: Inbox<Utility>,
    fence: Inbox<Fence>,
    hold: Inbox<Hold>,
    abort: Inbox<Abort>,
}

/// What became of an order: the level of [`Event`], and one line for people.
pub(super) type Outcome = (u8, String);

impl OrderTopics {
    pub fn new(node: &RosNode, part: &str) -> Result<Self, UserError> {
        let topic = |name: &str| node.own_topic(&format!("{part}/orders/{name}"));
        let qos = Qos::Reliable(ORDERS);
        Ok(Self {
            utility: node.subscribe(&topic("utility")?, qos, ORDERS)?,
            fence: node.subscribe(&topic("fence")?, qos, ORDERS)?,
            hold: node.subscribe(&topic("hold")?, qos, ORDERS)?,
            abort: node.subscribe(&topic("abort")?, qos, ORDERS)?,
        })
    }

    /// Requests what was ordered: stops first.
    pub fn handle(&mut self, desk: &Desk, vehicle: &VehicleState) -> Vec<Outcome> {
        let Some(giver) = &desk.giver else { return Vec::new() };
        let by = |request| ClientRequest { by: Some(giver.clone()), request };
        let mut outcomes = Vec::new();
        let mut order = |name, header: &Header, request: Result<SurfaceRequest, String>| {
            let reply = fresh(header).and(request).map(|request| desk.request(by(request)));
            outcomes.push(outcome(name, giver, reply));
        };
        while let Some(received) = self.abort.take() {
            order("abort", &received.message.header, order::abort(vehicle.id, &received.message));
        }
        while let Some(received) = self.hold.take() {
            order("hold", &received.message.header, order::hold(vehicle.id, &received.message));
        }
        while let Some(received) = self.fence.take() {
            order("fence", &received.message.header, order::fence(vehicle.id, &received.message));
        }
        while let Some(received) = self.utility.take() {
            order("utility", &received.message.header, order::utility(vehicle.id, &received.message));
        }
        outcomes
    }
}

fn fresh(header: &Header) -> Result<(), String> {
    order::check_age(header, stamps::nanos(SystemTime::now()))
}

fn outcome(name: &str, by: &Giver, reply: Result<Option<Reply>, String>) -> Outcome {
    let refused = |reason: &str| (Event::WARN, format!("{name} of {}: refused: {reason}", by.name()));
    match reply {
        Ok(Some(Reply::Accepted(order))) => {
            let version = order.version.map(|version| format!(" {version}")).unwrap_or_default();
            (Event::INFO, format!("{name} of {}: accepted as {}{version}", by.name(), order.name))
        }
        Ok(Some(Reply::Forbidden(reason) | Reply::NotInCommand(reason) | Reply::Refused(reason))) => refused(&reason),
        Ok(Some(Reply::NotFound)) => refused("no such vehicle or label"),
        Ok(Some(_)) => refused("the surface gave another reply"),
        Ok(None) => refused("the surface is busy"),
        Err(reason) => refused(&reason),
    }
}
