//! The node: its threads, its peers, and the subscriptions and publishers at it, on one transport or on both.

mod watch;

use crate::dds::Dds;
use crate::inbox::Inbox;
use crate::stop::Owned;
use crate::transport::{Feed, Peers, Qos, Transport, failed, locked};
use crate::zenoh::Zenoh;
use scenecast_config::{Remap, Ros2, RosName, RosTransport};
use scenecast_core::UserError;
use scenecast_messages::Message;
use scenecast_messages::contents::Health;
use scenecast_messages::grid_map_msgs::GridMap;
use scenecast_messages::nav_msgs::{OccupancyGrid, Odometry};
use scenecast_messages::sensor_msgs::{CameraInfo, CompressedImage, Image, PointCloud2};
use scenecast_messages::tf2_msgs::TFMessage;
use std::sync::atomic::AtomicU64;
use std::sync::{Arc, Mutex};
use std::time::Duration;
pub use watch::Publisher;
use watch::Wanted;

/// Time between two tries to start.
const RETRY_INTERVAL: Duration = Duration::from_secs(5);

/// A node of ROS 2 with threads of its own, which end with it.
pub struct RosNode {
    shared: Arc<Shared>,
    /// The thread of discovery and subscriptions; `None` only while it is dropped.
    runtime: Option<tokio::runtime::Runtime>,
}

/// The node, as its tasks share it.
struct Shared {
    dds: Option<Arc<Dds>>,
    zenoh: Option<Arc<Zenoh>>,
    remaps: Vec<Remap>,
    namespace: RosName,
    /// The subscriptions, to report those without a publisher.
    wanted: Mutex<Vec<Wanted>>,
}

impl RosNode {
    /// A node with this name in the domain, on the transports and networks of the settings.
    ///
    /// # Errors
    ///
    /// No socket of the domain could be opened, a thread did not start, or this build has no rmw_zenoh.
    pub fn start(settings: &Ros2, name: &str) -> Result<Self, UserError> {
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(1)
            .thread_name("ros2")
            .enable_time()
            .build()
            .map_err(|e| failed("the thread did not start", &e))?;
        let transport = settings.transport;
        let dds = (transport != RosTransport::Zenoh).then(|| Dds::start(settings, name, runtime.handle().clone()));
        let zenoh = (transport != RosTransport::Dds).then(|| Zenoh::start(settings, name));
        let shared = Arc::new(Shared {
            dds: dds.transpose()?,
            zenoh: zenoh.transpose()?,
            remaps: settings.remaps.clone(),
            namespace: settings.namespace.clone(),
            wanted: Mutex::default(),
        });
        runtime.spawn(watch::run(Arc::downgrade(&shared), settings.zenoh_router.to_string()));
        let transports: Vec<String> = shared.peers().iter().map(|(transport, _)| transport.to_string()).collect();
        tracing::info!("ROS 2: node {name} in domain {} of {}", settings.domain, transports.join(" and "));
        Ok(Self { shared, runtime: Some(runtime) })
    }

    /// As [`Self::start`], tried again at intervals until it works; `None` once the thread that waits is told to end.
    pub(crate) fn start_when_possible(settings: &Ros2, name: &str, owned: &Owned) -> Option<Self> {
        loop {
            match Self::start(settings, name) {
                Ok(node) => return Some(node),
                Err(error) => tracing::error!("{error}; the next try is in {} s", RETRY_INTERVAL.as_secs()),
            }
            if !owned.wait(RETRY_INTERVAL) {
                return None;
            }
        }
    }

    /// The topic with this name below the namespace of the settings, such as `auv_1/map`.
    ///
    /// # Errors
    ///
    /// The name is not allowed.
    pub fn own_topic(&self, name: &str) -> Result<RosName, UserError> {
        crate::topic(&format!("{}/{name}", self.shared.namespace))
    }

    /// The peers on all transports.
    pub fn peers(&self) -> Peers {
        Peers::joined(self.shared.peers())
    }

    /// The peers on each transport of the node.
    pub fn peers_by_transport(&self) -> Vec<(Transport, Peers)> {
        self.shared.peers()
    }

    /// Which transports see peers, as a part of diagnostics.
    pub fn health(&self) -> Health {
        watch::health(&self.shared.peers(), self.shared.has_router())
    }

    /// Subscribes to a topic; its messages wait in the inbox, at most `capacity` of them.
    ///
    /// # Errors
    ///
    /// A transport refuses the topic, for example since this process uses it with another type.
    pub fn subscribe<M: Message>(&self, topic: &RosName, qos: Qos, capacity: usize) -> Result<Inbox<M>, UserError> {
        let (inbox, wanted) = self.inbox(topic, qos, capacity)?;
        locked(&self.shared.wanted).push(wanted);
        Ok(inbox)
    }

    /// As [`Self::subscribe`], for a topic that need not have a publisher: the lack of one is not reported.
    ///
    /// # Errors
    ///
    /// As [`Self::subscribe`].
    pub fn subscribe_if_there<M: Message>(
        &self,
        topic: &RosName,
        qos: Qos,
        capacity: usize,
    ) -> Result<Inbox<M>, UserError> {
        Ok(self.inbox(topic, qos, capacity)?.0)
    }

    fn inbox<M: Message>(&self, topic: &RosName, qos: Qos, capacity: usize) -> Result<(Inbox<M>, Wanted), UserError> {
        let name = remapped(topic, &self.shared.remaps);
        let (mut inbox, filler) = Inbox::new(capacity);
        let mut counts = Vec::new();
        let dds = self.shared.dds.as_ref().map(|dds| dds.subscribe(name, qos, filler.clone())).transpose()?;
        let zenoh = self.shared.zenoh.as_ref().map(|zenoh| zenoh.subscribe(name, qos, filler)).transpose()?;
        for Feed { transport, publishers, ending } in dds.into_iter().chain(zenoh) {
            counts.push((transport, publishers));
            inbox.feeds.push(ending);
        }
        let wanted = Wanted::new(name.as_str().to_owned(), M::DEFINITION.full_name(), counts);
        Ok((inbox, wanted))
    }

    /// A publisher of a topic.
    ///
    /// # Errors
    ///
    /// A transport refuses the topic.
    pub fn publisher<M: Message>(&self, topic: &RosName, qos: Qos) -> Result<Publisher<M>, UserError> {
        let name = remapped(topic, &self.shared.remaps);
        Ok(Publisher {
            dds: self.shared.dds.as_ref().map(|dds| dds.publisher(name, qos)).transpose()?,
            zenoh: self.shared.zenoh.as_ref().map(|zenoh| zenoh.publisher(M::DEFINITION, name, qos)).transpose()?,
            refused: AtomicU64::new(0),
        })
    }
}

impl Drop for RosNode {
    fn drop(&mut self) {
        if let Some(runtime) = self.runtime.take() {
            // Waits for no peer.
            runtime.shutdown_background();
        }
    }
}

impl Shared {
    fn peers(&self) -> Vec<(Transport, Peers)> {
        let dds = self.dds.iter().map(|dds| (Transport::Dds, dds.peers()));
        dds.chain(self.zenoh.iter().map(|zenoh| (Transport::Zenoh, zenoh.peers()))).collect()
    }

    /// Whether rmw_zenoh has its router; `None` if it is not used.
    fn has_router(&self) -> Option<bool> {
        self.zenoh.as_ref().map(|zenoh| zenoh.has_router())
    }
}

/// A topic by its whole name, such as `/camera/image_raw`.
///
/// # Errors
///
/// One line that gives the name and the allowed form.
pub fn topic(name: &str) -> Result<RosName, UserError> {
    let rule = "a topic of ROS 2 is such as /camera/image_raw: parts of letters, digits and underscores after slashes";
    RosName::parse(name).ok_or_else(|| UserError::Input(format!("{name:?}: {rule}")))
}

/// The name under which a topic is used.
pub(crate) fn remapped<'a>(name: &'a RosName, remaps: &'a [Remap]) -> &'a RosName {
    remaps.iter().find(|remap| remap.from == *name).map_or(name, |remap| &remap.to)
}

/// Images that wait at most.
const IMAGES: usize = 5;
/// Poses and transforms that wait at most: 4 s at 50 a second.
const POSES: usize = 200;

impl RosNode {
    /// Images without compression: best effort, depth 5.
    pub fn subscribe_images(&self, topic: &RosName) -> Result<Inbox<Image>, UserError> {
        self.subscribe(topic, Qos::Sensor(5), IMAGES)
    }

    /// Compressed images: best effort, depth 5.
    pub fn subscribe_compressed_images(&self, topic: &RosName) -> Result<Inbox<CompressedImage>, UserError> {
        self.subscribe(topic, Qos::Sensor(5), IMAGES)
    }

    /// Clouds of points: best effort, depth 5.
    pub fn subscribe_clouds(&self, topic: &RosName) -> Result<Inbox<PointCloud2>, UserError> {
        self.subscribe(topic, Qos::Sensor(5), IMAGES)
    }

    /// Calibrations, if a camera has one: best effort, depth 5.
    pub fn subscribe_camera_info(&self, topic: &RosName) -> Result<Inbox<CameraInfo>, UserError> {
        self.subscribe_if_there(topic, Qos::Sensor(5), IMAGES)
    }

    /// Estimates of pose and speed: best effort.
    pub fn subscribe_odometry(&self, topic: &RosName) -> Result<Inbox<Odometry>, UserError> {
        self.subscribe(topic, Qos::Sensor(50), POSES)
    }

    /// Transforms that change, usually on `/tf`: best effort.
    pub fn subscribe_tf(&self, topic: &RosName) -> Result<Inbox<TFMessage>, UserError> {
        self.subscribe(topic, Qos::Sensor(100), POSES)
    }

    /// Transforms that stay, if there are any, usually on `/tf_static`; those before the subscription are included.
    pub fn subscribe_static_tf(&self, topic: &RosName) -> Result<Inbox<TFMessage>, UserError> {
        self.subscribe_if_there(topic, Qos::Latched(100), POSES)
    }

    /// Whole grids of labels: the last one, and each new one of a publisher that keeps its last message.
    pub fn subscribe_label_map(&self, topic: &RosName) -> Result<Inbox<OccupancyGrid>, UserError> {
        self.subscribe(topic, Qos::Latched(1), 1)
    }

    /// Grids with several layers: the last one, and each new one of a publisher that keeps its last message.
    pub fn subscribe_grid_map(&self, topic: &RosName) -> Result<Inbox<GridMap>, UserError> {
        self.subscribe(topic, Qos::Latched(1), 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenecast_messages::contents::valid_part;

    #[test]
    fn vehicle_names_become_parts_of_topics() {
        assert_eq!(valid_part("auv-1"), "auv_1");
        assert_eq!(valid_part("2nd"), "_2nd");
        assert_eq!(valid_part(""), "_");
        assert!(topic(&format!("/scenecast/{}/map", valid_part("Möwe 3"))).is_ok());
        assert!(topic("map").unwrap_err().to_string().contains("/camera/image_raw"));
    }

    #[test]
    fn a_remap_replaces_a_whole_name() {
        let remaps = [Remap { from: topic("/a/map").unwrap(), to: topic("/map").unwrap() }];
        assert_eq!(remapped(&topic("/a/map").unwrap(), &remaps).as_str(), "/map");
        assert_eq!(remapped(&topic("/a/map2").unwrap(), &remaps).as_str(), "/a/map2");
    }
}
