//! The surface in ROS 2: the operator's map and each vehicle's state, and orders.
//!
//! A thread of its own reads the snapshots that the page shows, and makes requests as the page does. So the link waits for no
//! subscriber, and orders pass the same checks.

mod health;
mod map;
mod orders;
mod vehicle_topics;

use crate::node::RosNode;
use crate::stop::{self, Owned, Owner};
use scenecast_config::Ros2;
use scenecast_core::{ClientName, Giver, Principal, UserError};
use scenecast_messages::contents::Stamps;
use scenecast_surface::{ClientRequest, Reply, Snapshot};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, SystemTime, UNIX_EPOCH};
use tokio::sync::{mpsc, oneshot, watch};
use vehicle_topics::{Parts, VehicleTopics};

fn nanos(time: SystemTime) -> i64 {
    time.duration_since(UNIX_EPOCH).map_or(0, |since| since.as_nanos() as i64)
}

/// Time between two looks at snapshots, subscribers and orders.
const TICK: Duration = Duration::from_millis(100);
/// Requests that may wait for the surface.
const MAX_PENDING: usize = 4;

/// A request, and the place for its reply.
type PendingRequest = (ClientRequest, oneshot::Sender<Reply>);

/// The host's end of ROS 2 at the surface, of the same form as the console's.
#[derive(Debug)]
pub struct SurfaceOutlet {
    /// Requests for maps and exemplars, and orders, to be handled between two steps.
    pub requests: mpsc::Receiver<PendingRequest>,
    /// The state that is published.
    pub snapshots: watch::Sender<Arc<Snapshot>>,
    _thread: Owner,
}

/// Joins ROS 2, as soon as its transports start: the surface does not wait for them. Orders are taken in the name of `principal`; without
/// one, none are. `vehicles` are those of the configuration, by address and name.
///
/// # Errors
///
/// Two vehicles whose names give the same topics, or the thread did not start.
pub fn start_surface(
    settings: &Ros2,
    principal: Option<Principal>,
    vehicles: impl IntoIterator<Item = (u8, String)>,
) -> Result<SurfaceOutlet, UserError> {
    let parts = Parts::new(vehicles)?;
    let (sender, requests) = mpsc::channel(MAX_PENDING);
    let (snapshots, receiver) = watch::channel(Arc::new(Snapshot::default()));
    let (owner, owned) = stop::ends();
    let giver = principal.map(|principal| Giver { principal, client: ClientName::of_program("ros2") });
    let desk = Desk { requests: sender, giver };
    let settings = settings.clone();
    let run = move || {
        if let Some(node) = RosNode::start_when_possible(&settings, "scenecast_surface", &owned) {
            Worker { node, desk, snapshots: receiver, parts, vehicles: BTreeMap::new() }.run(&owned);
        }
    };
    let thread = std::thread::Builder::new().name("ros2-surface".to_owned());
    thread.spawn(run).map_err(|e| UserError::Failed(format!("ROS 2: no thread: {e}")))?;
    Ok(SurfaceOutlet { requests, snapshots, _thread: owner })
}

/// Makes requests of the surface.
struct Desk {
    requests: mpsc::Sender<PendingRequest>,
    giver: Option<Giver>,
}

impl Desk {
    /// The reply of the surface; `None` once it has ended, or while it is busy.
    fn request(&self, request: ClientRequest) -> Option<Reply> {
        let (sender, reply) = oneshot::channel();
        self.requests.try_send((request, sender)).ok()?;
        reply.blocking_recv().ok()
    }
}

struct Worker {
    node: RosNode,
    desk: Desk,
    snapshots: watch::Receiver<Arc<Snapshot>>,
    parts: Parts,
    /// By address; `None` if a topic was refused, or another vehicle has its topics.
    vehicles: BTreeMap<u8, Option<VehicleTopics>>,
}

impl Worker {
    fn run(mut self, owned: &Owned) {
        let mut stamps = Stamps::default();
        let mut snapshot = Arc::default();
        while owned.wait(TICK) {
            if self.snapshots.has_changed().unwrap_or(false) {
                snapshot = self.snapshots.borrow_and_update().clone();
                stamps = snapshot.stamps.clone();
            }
            self.handle(&snapshot, &stamps);
        }
    }

    fn handle(&mut self, snapshot: &Snapshot, stamps: &Stamps) {
        for vehicle in &snapshot.state.vehicles {
            let topics = self.vehicles.entry(vehicle.id).or_insert_with(|| {
                let part = self.parts.claim(vehicle.id, &vehicle.name);
                let topics = part.and_then(|part| VehicleTopics::new(&self.node, &part, self.desk.giver.is_some()));
                topics.inspect_err(|e| tracing::error!("{e}; {} is not published", vehicle.name)).ok()
            });
            if let Some(topics) = topics {
                topics.handle_orders(&self.desk, vehicle, stamps);
                topics.publish(&self.node, &self.desk, &snapshot.state, vehicle, stamps);
            }
        }
    }
}
