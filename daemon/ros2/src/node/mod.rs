//! The node: its threads, its peers, and the subscriptions and publishers at it, on one transport or on both.

mod watch;

pub use watch::Publisher;

use crate::dds::Dds;
use crate::inbox::Inbox;
use crate::names::remapped;
use crate::stop::Owned;
use crate::transport::{Feed, Peers, Qos, Transport, failed, locked};
use crate::zenoh::Zenoh;
use scenecast_config::{Remap, Ros2, RosName, RosTransport};
use scenecast_core::UserError;
use scenecast_messages::Message;
use scenecast_messages::contents::Health;
use std::sync::atomic::AtomicU64;
use std::sync::{Arc, Mutex};
use std::time::Duration;
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
