//! The orders of ROS 2 to one vehicle, as requests of the surface.

use super::{Desk, nanos};
use crate::inbox::Inbox;
use crate::node::RosNode;
use crate::transport::Qos;
use scenecast_core::{Giver, UserError};
use scenecast_messages::contents::WORLD_FRAME;
use scenecast_messages::geometry_msgs::Polygon;
use scenecast_messages::scenecast_msgs::{Abort, Event, Fence, Hold, Utility};
use scenecast_messages::std_msgs::Header;
use scenecast_protocol::directive::Constraints;
use scenecast_surface::state::VehicleState;
use scenecast_surface::{ClientRequest, FenceOrder, OrderChanges, Reply, SurfaceRequest};
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

/// Why a message is no order.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(super) enum OrderFault {
    #[error("its stamp is {seconds} s old; allowed: 60 s at most")]
    Old { seconds: u64 },
    #[error("its stamp is {seconds} s in the future; allowed: 60 s at most")]
    Future { seconds: u64 },
    #[error("it is in the frame {0:?}; allowed: {WORLD_FRAME:?}")]
    Frame(String),
    #[error("{0} keep-outs: it takes {MAX_OUTLINES} or fewer")]
    KeepOuts(usize),
    #[error("an outline of {0} vertices: it takes 3 to {MAX_VERTICES}")]
    Vertices(usize),
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
        let mut order = |name, header: &Header, request: Result<SurfaceRequest, OrderFault>| {
            let reply = fresh(header).and(request).map(|request| desk.request(by(request)));
            outcomes.push(outcome(name, giver, reply));
        };
        while let Some(received) = self.abort.take() {
            order("abort", &received.message.header, abort(vehicle.id, &received.message));
        }
        while let Some(received) = self.hold.take() {
            order("hold", &received.message.header, hold(vehicle.id, &received.message));
        }
        while let Some(received) = self.fence.take() {
            order("fence", &received.message.header, fence(vehicle.id, &received.message));
        }
        while let Some(received) = self.utility.take() {
            order("utility", &received.message.header, utility(vehicle.id, &received.message));
        }
        outcomes
    }
}

fn fresh(header: &Header) -> Result<(), OrderFault> {
    check_age(header, nanos(SystemTime::now()))
}

fn outcome(name: &str, by: &Giver, reply: Result<Option<Reply>, OrderFault>) -> Outcome {
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
        Err(fault) => refused(&fault.to_string()),
    }
}

/// Distance of a stamp to now from which an order is refused: it may come from the playback of a recording, or from a clock
/// that is wrong.
const MAX_AGE_NANOS: i64 = 60_000_000_000;
/// Outlines and vertices at most, as in the surface's own orders, which check the rest.
const MAX_OUTLINES: usize = 15;
const MAX_VERTICES: usize = 34;

/// Refuses an order with a stamp of the past or of the future; one without a stamp, as `ros2 topic pub` sends it, is taken
/// for new.
pub(super) fn check_age(header: &Header, now_nanos: i64) -> Result<(), OrderFault> {
    let stamp = header.stamp.nanos();
    let age = now_nanos.saturating_sub(stamp);
    if stamp == 0 || age.unsigned_abs() <= MAX_AGE_NANOS as u64 {
        return Ok(());
    }
    let seconds = age.unsigned_abs() / 1_000_000_000;
    Err(if age > 0 { OrderFault::Old { seconds } } else { OrderFault::Future { seconds } })
}

pub(super) fn utility(vehicle: u8, order: &Utility) -> Result<SurfaceRequest, OrderFault> {
    let weights = order.labels.iter().map(|l| (l.label, f64::from(l.weight))).collect();
    let terms = (f64::from(order.exploration), f64::from(order.curiosity));
    Ok(SurfaceRequest::Utility(vehicle, weights, terms))
}

/// An outline is in the world frame, which is also taken for an empty name.
pub(super) fn fence(vehicle: u8, order: &Fence) -> Result<SurfaceRequest, OrderFault> {
    let frame = order.header.frame_id.as_str();
    if !["", WORLD_FRAME].contains(&frame) {
        return Err(OrderFault::Frame(frame.to_owned()));
    }
    if order.keep_outs.len() > MAX_OUTLINES {
        return Err(OrderFault::KeepOuts(order.keep_outs.len()));
    }
    let point = &order.return_point;
    let whole = FenceOrder {
        fence: (!order.outline.points.is_empty()).then(|| outline(&order.outline)).transpose()?,
        keep_outs: order.keep_outs.iter().map(outline).collect::<Result<_, _>>()?,
        return_point: order.has_return_point.then_some([point.x, point.y]),
    };
    Ok(SurfaceRequest::Fence(vehicle, OrderChanges::whole(&whole)))
}

fn outline(polygon: &Polygon) -> Result<Vec<[f64; 2]>, OrderFault> {
    let points = &polygon.points;
    if points.len() > MAX_VERTICES {
        return Err(OrderFault::Vertices(points.len()));
    }
    Ok(points.iter().map(|point| [f64::from(point.x), f64::from(point.y)]).collect())
}

/// Hold leaves an abort as it is; the end of an abort is an order of its own.
pub(super) fn hold(vehicle: u8, order: &Hold) -> Result<SurfaceRequest, OrderFault> {
    Ok(SurfaceRequest::Hold(vehicle, order.hold))
}

pub(super) fn abort(vehicle: u8, order: &Abort) -> Result<SurfaceRequest, OrderFault> {
    Ok(SurfaceRequest::Constraints(vehicle, Constraints { hold: false, abort: order.abort }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenecast_messages::builtin_interfaces::Time;
    use scenecast_messages::geometry_msgs::{Point, Point32};
    use scenecast_messages::scenecast_msgs::LabelUtility;
    use std::collections::BTreeMap;

    fn square(side: f32) -> Polygon {
        let corner = |x, y| Point32 { x, y, z: 0.0 };
        Polygon { points: vec![corner(0.0, 0.0), corner(side, 0.0), corner(side, side), corner(0.0, side)] }
    }

    #[test]
    fn orders_become_requests_of_the_surface() {
        let labels = vec![LabelUtility { label: 3, weight: 0.5 }];
        let sought = Utility { labels, exploration: 0.25, ..Utility::default() };
        assert_eq!(utility(2, &sought), Ok(SurfaceRequest::Utility(2, BTreeMap::from([(3, 0.5)]), (0.25, 0.0))));
        let kept = Fence {
            outline: square(9.0),
            has_return_point: true,
            return_point: Point { x: 1.0, y: 2.0, z: 0.0 },
            ..Fence::default()
        };
        let Ok(SurfaceRequest::Fence(2, order)) = fence(2, &kept) else { panic!("no fence") };
        let order = order.applied_to(|| panic!("it names every member")).unwrap();
        assert_eq!(order.fence.unwrap()[2], [9.0, 9.0]);
        assert_eq!((order.keep_outs.len(), order.return_point), (0, Some([1.0, 2.0])));
    }

    #[test]
    fn a_hold_does_not_change_an_abort() {
        let order = |hold| Hold { hold, ..Hold::default() };
        assert_eq!(hold(1, &order(true)), Ok(SurfaceRequest::Hold(1, true)));
        assert_eq!(hold(1, &order(false)), Ok(SurfaceRequest::Hold(1, false)));
        let aborted = SurfaceRequest::Constraints(1, Constraints { hold: false, abort: true });
        assert_eq!(abort(1, &Abort { abort: true, ..Abort::default() }), Ok(aborted));
    }

    #[test]
    fn old_and_future_orders_and_other_frames_are_refused() {
        let stamped = |sec| Header { stamp: Time { sec, nanosec: 0 }, ..Header::default() };
        let now = 1_000_000_000_000;
        assert_eq!(check_age(&stamped(940), now), Ok(()));
        assert_eq!(check_age(&stamped(0), now), Ok(()), "without a stamp");
        assert_eq!(check_age(&stamped(900), now), Err(OrderFault::Old { seconds: 100 }));
        assert_eq!(check_age(&stamped(1060), now), Ok(()), "of a clock that is a little ahead");
        assert_eq!(check_age(&stamped(1100), now), Err(OrderFault::Future { seconds: 100 }));
        assert!(check_age(&stamped(i32::MIN), now).is_err() && check_age(&stamped(i32::MAX), now).is_err());
        let framed = |frame: &str| Fence {
            header: Header { frame_id: frame.to_owned(), ..Header::default() },
            outline: square(1.0),
            ..Fence::default()
        };
        assert!(fence(1, &framed("map")).is_ok());
        let refused = fence(1, &framed("odom")).unwrap_err();
        assert_eq!(refused.to_string(), "it is in the frame \"odom\"; allowed: \"map\"");
        let many = Fence { keep_outs: vec![square(1.0); 16], ..Fence::default() };
        assert_eq!(fence(1, &many), Err(OrderFault::KeepOuts(16)));
    }
}
