//! Viewers: maps and states as messages of ROS 2, by the WebSocket protocol of Foxglove, which Lichtblick speaks too.
//! <https://github.com/foxglove/ws-protocol/blob/main/docs/spec.md>

use super::maps::latest;
use crate::http::access::{MAX_STREAMS, Seat};
use crate::http::response::error;
use crate::http::shared::Shared;
use axum::Extension;
use axum::extract::State;
use axum::extract::ws::rejection::WebSocketUpgradeRejection;
use axum::extract::ws::{Message as Packet, WebSocket, WebSocketUpgrade};
use axum::http::StatusCode;
use axum::response::Response;
use scenecast_messages::contents::{
    Stamps, WORLD_FRAME, cloud, exemplar_jpeg, header, layers, occupancy, pose, valid_part,
};
use scenecast_messages::geometry_msgs::PoseWithCovarianceStamped;
use scenecast_messages::grid_map_msgs::GridMap;
use scenecast_messages::nav_msgs::{OccupancyGrid, Path};
use scenecast_messages::rcl_interfaces::Log;
use scenecast_messages::scenecast_msgs::{LabelTree, Link};
use scenecast_messages::sensor_msgs::{CompressedImage, NavSatFix, PointCloud2};
use scenecast_messages::{Definition, Message, encode};
use scenecast_surface::messages::{grid, label_tree, link, place, place_on_earth, plan, track};
use scenecast_surface::state::{ExemplarImage, VehicleState, seconds};
use scenecast_surface::{Giver, Reply, Snapshot, SurfaceRequest};
use serde::Deserialize;
use serde_json::json;
use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::Arc;
use std::time::Instant;
use tokio::sync::watch;

/// The path of the WebSocket.
pub(in crate::http) const VIEWERS: &str = "/foxglove";
/// The second is its earlier name, with the same messages.
const PROTOCOLS: [&str; 2] = ["foxglove.sdk.v1", "foxglove.websocket.v1"];
const MAX_REQUEST_BYTES: usize = 64 << 10;
const MAX_SUBSCRIPTIONS: usize = 256;
const MESSAGE_DATA: u8 = 1;
/// The level of a status that tells of a wrong request.
const ERROR: u8 = 2;

/// Joins a viewer. One that does not read is dropped by the timeouts of its connection; a slow one misses states, but never
/// the last.
pub(in crate::http) async fn viewers(
    State(shared): State<Shared>,
    Extension(by): Extension<Giver>,
    upgrade: Result<WebSocketUpgrade, WebSocketUpgradeRejection>,
) -> Response {
    let Ok(upgrade) = upgrade else {
        let line = "this is a WebSocket for Foxglove and Lichtblick: open it as ws://";
        return error(StatusCode::UPGRADE_REQUIRED, line);
    };
    let Some(seat) = shared.seats.take(by.name(), Instant::now()) else {
        let line = format!("{MAX_STREAMS} streams of events are open, which is the maximum");
        return error(StatusCode::SERVICE_UNAVAILABLE, &line);
    };
    let upgrade = upgrade.protocols(PROTOCOLS).max_message_size(MAX_REQUEST_BYTES);
    upgrade.on_upgrade(|socket| async move {
        let (snapshots, channels, subscriptions) = (shared.snapshots.clone(), Vec::new(), BTreeMap::new());
        // An error here is the end of the connection.
        let _ = Viewer { shared, socket, snapshots, channels, subscriptions }.serve(seat).await;
    })
}

/// A quantity of a vehicle, or the log.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Quantity {
    Map,
    Layers,
    Cloud,
    LabelTree,
    Pose,
    Path,
    Plan,
    Fix,
    Exemplars,
    Link,
}

impl Quantity {
    const ALL: [Self; 10] = [
        Self::Map,
        Self::Layers,
        Self::Cloud,
        Self::LabelTree,
        Self::Pose,
        Self::Path,
        Self::Plan,
        Self::Fix,
        Self::Exemplars,
        Self::Link,
    ];

    /// The last part of its topic, as in ROS 2, and the type of its messages.
    fn topic(self) -> (&'static str, &'static Definition) {
        match self {
            Self::Map => ("map", OccupancyGrid::DEFINITION),
            Self::Layers => ("layers", GridMap::DEFINITION),
            Self::Cloud => ("cloud", PointCloud2::DEFINITION),
            Self::LabelTree => ("label_tree", LabelTree::DEFINITION),
            Self::Pose => ("pose", PoseWithCovarianceStamped::DEFINITION),
            Self::Path => ("path", Path::DEFINITION),
            Self::Plan => ("plan", Path::DEFINITION),
            Self::Fix => ("fix", NavSatFix::DEFINITION),
            Self::Exemplars => ("exemplars", CompressedImage::DEFINITION),
            Self::Link => ("link", Link::DEFINITION),
        }
    }

    /// A number that changes when its message would; `None` while there is none.
    fn state(self, vehicle: &VehicleState, now_s: f64) -> Option<u64> {
        let mut hasher = DefaultHasher::new();
        let reported = vehicle.status.as_ref().map(|status| status.at_s.to_bits());
        match self {
            Self::Map | Self::Layers | Self::Cloud => {
                let (map, (east_m, north_m)) = (&vehicle.map, vehicle.map.shift_m());
                (map.version, map.epoch, east_m.to_bits(), north_m.to_bits()).hash(&mut hasher);
                vehicle.label_book.hash(&mut hasher);
                if map.width == 0 {
                    return None;
                }
            }
            Self::LabelTree => (vehicle.map.epoch, &vehicle.label_tree.as_ref()?.merges).hash(&mut hasher),
            Self::Pose | Self::Path | Self::Plan | Self::Fix => reported?.hash(&mut hasher),
            Self::Exemplars => {
                let (label, image) = newest_image(vehicle)?;
                (vehicle.map.epoch, label, image.number).hash(&mut hasher);
            }
            Self::Link => (now_s as u64).hash(&mut hasher),
        }
        Some(hasher.finish())
    }
}

/// The image that came in last, with its label.
fn newest_image(vehicle: &VehicleState) -> Option<(u8, &ExemplarImage)> {
    let images = vehicle.labels.iter().flat_map(|label| label.exemplar.images.iter().map(|image| (label.id, image)));
    images.max_by(|a, b| a.1.at_s.total_cmp(&b.1.at_s))
}

/// A channel that was advertised; its place in the list is its number.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Channel {
    Log,
    /// Of the vehicle with this address.
    Vehicle(u8, Quantity),
}

/// What was sent to a subscription last.
#[derive(Debug, Default, Clone, Copy)]
struct Sent {
    channel: usize,
    /// The state of the quantity.
    state: Option<u64>,
    /// The number of the entry of the log.
    entry: u64,
}

#[derive(Debug, Deserialize)]
#[serde(tag = "op", rename_all = "camelCase")]
enum ViewerRequest {
    Subscribe {
        subscriptions: Vec<Subscription>,
    },
    #[serde(rename_all = "camelCase")]
    Unsubscribe {
        subscription_ids: Vec<u32>,
    },
    #[serde(other)]
    Other,
}

/// Why a viewer does not get a subscription; as text one line for its user.
#[derive(Debug, thiserror::Error)]
enum SubscriptionFault {
    #[error("there is no channel {0}")]
    NoChannel(usize),
    #[error("there is a subscription {0} already")]
    Taken(u32),
    #[error("there are {MAX_SUBSCRIPTIONS} subscriptions, which is the most")]
    Most,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
struct Subscription {
    id: u32,
    channel_id: usize,
}

struct Viewer {
    shared: Shared,
    socket: WebSocket,
    snapshots: watch::Receiver<Arc<Snapshot>>,
    channels: Vec<Channel>,
    subscriptions: BTreeMap<u32, Sent>,
}

impl Viewer {
    async fn serve(mut self, mut seat: Seat) -> Result<(), axum::Error> {
        let info = json!({ "op": "serverInfo", "name": "scenecast", "capabilities": [], "supportedEncodings": [], "metadata": {} });
        self.socket.send(Packet::text(info.to_string())).await?;
        self.publish().await?;
        loop {
            tokio::select! {
                changed = self.snapshots.changed() => match changed {
                    Ok(()) => self.publish().await?,
                    Err(_) => return Ok(()),
                },
                packet = self.socket.recv() => match packet {
                    Some(Ok(Packet::Text(text))) => {
                        for refusal in self.handle(&text) {
                            self.refuse(&refusal).await?;
                        }
                        self.publish().await?;
                    }
                    Some(Ok(Packet::Binary(_))) => self.refuse("this server takes no data of clients").await?,
                    Some(Ok(_)) => {}
                    Some(Err(_)) | None => return Ok(()),
                },
                _ = &mut seat.end => return Ok(()),
            }
        }
    }

    /// Tells what is wrong with a request.
    async fn refuse(&mut self, message: &str) -> Result<(), axum::Error> {
        self.socket.send(Packet::text(json!({ "op": "status", "level": ERROR, "message": message }).to_string())).await
    }

    /// What is wrong with a request, a line each.
    fn handle(&mut self, text: &str) -> Vec<String> {
        match serde_json::from_str(text) {
            Ok(ViewerRequest::Subscribe { subscriptions }) => {
                let refused = |subscription: Subscription| self.subscribe(&subscription).err();
                subscriptions.into_iter().filter_map(refused).map(|fault| fault.to_string()).collect()
            }
            Ok(ViewerRequest::Unsubscribe { subscription_ids }) => {
                let unknown = |id: &u32| {
                    self.subscriptions.remove(id).is_none().then(|| format!("there is no subscription {id}"))
                };
                subscription_ids.iter().filter_map(unknown).collect()
            }
            Ok(ViewerRequest::Other) => vec!["the operations are subscribe and unsubscribe".to_owned()],
            Err(e) => vec![format!("it cannot be read: {e}")],
        }
    }

    fn subscribe(&mut self, &Subscription { id, channel_id }: &Subscription) -> Result<(), SubscriptionFault> {
        if channel_id >= self.channels.len() {
            return Err(SubscriptionFault::NoChannel(channel_id));
        }
        if self.subscriptions.contains_key(&id) {
            return Err(SubscriptionFault::Taken(id));
        }
        if self.subscriptions.len() >= MAX_SUBSCRIPTIONS {
            return Err(SubscriptionFault::Most);
        }
        self.subscriptions.insert(id, Sent { channel: channel_id, ..Sent::default() });
        Ok(())
    }

    /// Sends what has changed, for those that subscribe.
    async fn publish(&mut self) -> Result<(), axum::Error> {
        let snapshot = self.snapshots.borrow_and_update().clone();
        if snapshot.json.is_empty() {
            return Ok(());
        }
        self.advertise(&snapshot).await?;
        let stamps = snapshot.stamps.clone();
        let subscribed: Vec<(u32, Sent)> = self.subscriptions.iter().map(|(id, sent)| (*id, *sent)).collect();
        for (id, sent) in subscribed {
            match self.channels.get(sent.channel).copied() {
                Some(Channel::Log) => self.send_log(id, sent, &stamps).await?,
                Some(Channel::Vehicle(address, quantity)) => {
                    let Some(vehicle) = snapshot.vehicle(address) else { continue };
                    let state = quantity.state(vehicle, snapshot.state.now_s);
                    if state.is_none() || state == sent.state {
                        continue;
                    }
                    if let Some(message) = message(&self.shared, &snapshot, vehicle, quantity, &stamps).await {
                        self.send(id, &stamps, &message).await?;
                    }
                    self.subscriptions.insert(id, Sent { state, ..sent });
                }
                None => {}
            }
        }
        Ok(())
    }

    /// Tells the channels of vehicles that are new.
    async fn advertise(&mut self, snapshot: &Snapshot) -> Result<(), axum::Error> {
        let mut new = Vec::new();
        if self.channels.is_empty() {
            self.channels.push(Channel::Log);
            new.push(channel(0, "/scenecast/log", Log::DEFINITION));
        }
        for vehicle in &snapshot.state.vehicles {
            if self.channels.contains(&Channel::Vehicle(vehicle.id, Quantity::Map)) {
                continue;
            }
            for quantity in Quantity::ALL {
                let (name, definition) = quantity.topic();
                let topic = format!("/scenecast/{}/{name}", valid_part(&vehicle.name));
                new.push(channel(self.channels.len(), &topic, definition));
                self.channels.push(Channel::Vehicle(vehicle.id, quantity));
            }
        }
        if new.is_empty() {
            return Ok(());
        }
        self.socket.send(Packet::text(json!({ "op": "advertise", "channels": new }).to_string())).await
    }

    async fn send(&mut self, subscription: u32, stamps: &Stamps, message: &[u8]) -> Result<(), axum::Error> {
        let nanos = stamps.now().nanos().max(0) as u64;
        let mut packet = vec![MESSAGE_DATA];
        packet.extend(subscription.to_le_bytes());
        packet.extend(nanos.to_le_bytes());
        packet.extend(message);
        self.socket.send(Packet::binary(packet)).await
    }

    async fn send_log(&mut self, id: u32, sent: Sent, stamps: &Stamps) -> Result<(), axum::Error> {
        let last = self.snapshots.borrow().state.log;
        if last == sent.entry {
            return Ok(());
        }
        let Ok(Reply::Log(entries)) = self.shared.request(SurfaceRequest::Log).await else { return Ok(()) };
        for entry in entries.iter().filter(|entry| entry.number > sent.entry) {
            let (stamp, name) = (stamps.at(seconds(entry.at)), entry.kind.name().to_owned());
            let message = Log { stamp, level: Log::INFO, name, msg: entry.line(), ..Log::default() };
            self.send(id, stamps, &encode(&message)).await?;
        }
        self.subscriptions.insert(id, Sent { entry: last, ..sent });
        Ok(())
    }
}

/// The message of a quantity; `None` if there is none now.
async fn message(
    shared: &Shared,
    snapshot: &Snapshot,
    vehicle: &VehicleState,
    quantity: Quantity,
    stamps: &Stamps,
) -> Option<Vec<u8>> {
    let world = |at_s: f64| header(stamps.at(at_s), WORLD_FRAME);
    let shift = vehicle.map.shift_m();
    let status = vehicle.status.as_ref();
    Some(match quantity {
        Quantity::Map | Quantity::Layers | Quantity::Cloud => {
            let cached = latest(shared, vehicle.id).await.ok()?;
            let header = world(vehicle.map.updated_s.unwrap_or(snapshot.state.now_s));
            let book = vehicle.label_book.clone();
            let made = tokio::task::spawn_blocking(move || {
                let grid = grid(cached.map.cells(), shift)?;
                Some(match quantity {
                    Quantity::Map => encode(&occupancy(&grid, header)),
                    Quantity::Layers => encode(&layers(&grid, header)),
                    _ => encode(&cloud(&grid, header, |label| book.class_colour(label))),
                })
            });
            made.await.ok()??
        }
        Quantity::LabelTree => encode(&label_tree(vehicle, vehicle.label_tree.as_ref()?, world(snapshot.state.now_s))),
        Quantity::Pose => {
            let status = status?;
            encode(&pose(&place(status, shift, stamps), status.pose.sigma_m, WORLD_FRAME))
        }
        Quantity::Path => encode(&track(vehicle, status?, stamps)),
        Quantity::Plan => encode(&plan(vehicle, status?, stamps)),
        Quantity::Fix => {
            let status = status?;
            encode(&place_on_earth(&snapshot.state, &place(status, shift, stamps), status.pose.sigma_m)?)
        }
        Quantity::Exemplars => {
            let (label, image) = newest_image(vehicle)?;
            let request = SurfaceRequest::Exemplar(vehicle.id, label, Some(image.number));
            let Ok(Reply::File(_, webp)) = shared.request(request).await else { return None };
            encode(&exemplar_jpeg(
                &webp,
                header(stamps.at(image.taken_s.unwrap_or(image.at_s)), &format!("label_{label}")),
            )?)
        }
        Quantity::Link => encode(&link(&snapshot.state, vehicle, stamps)),
    })
}

fn channel(id: usize, topic: &str, definition: &Definition) -> serde_json::Value {
    json!({ "id": id, "topic": topic, "encoding": "cdr", "schemaName": definition.full_name(),
            "schemaEncoding": "ros2msg", "schema": definition.ros2msg() })
}
