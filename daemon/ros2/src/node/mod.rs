//! The node: its threads, its peers, and the subscriptions and publishers at it.

mod publisher;
mod watch;

pub use publisher::Publisher;

use crate::inbox::{Filler, Inbox};
use crate::names::remapped;
use crate::qos::Qos;
use crate::stop::Owned;
use futures_util::StreamExt;
use ros2_client::{Context, MessageTypeName, Node, NodeName, NodeOptions, Subscription};
use rustdds::{DomainParticipantBuilder, RTPSEntity, TopicKind};
use scenecast_config::{Remap, Ros2, RosName};
use scenecast_core::UserError;
use scenecast_messages::Message;
use std::collections::BTreeSet;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
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
pub(crate) struct Shared {
    node: Mutex<Node>,
    context: Context,
    remaps: Vec<Remap>,
    namespace: RosName,
    /// The subscriptions, to report those without a publisher.
    pub(crate) wanted: Mutex<Vec<Wanted>>,
}

/// What DDS has found on its networks.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Peers {
    /// Processes other than this one.
    pub participants: usize,
    /// Topic and type of their publishers, such as `/camera/image_raw` and `sensor_msgs/msg/Image`.
    pub publishers: BTreeSet<(String, String)>,
}

pub(crate) fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn failed(action: &str, error: &dyn std::fmt::Display) -> UserError {
    UserError::Failed(format!("ROS 2: {action}: {error}"))
}

impl RosNode {
    /// A node with this name in the domain and on the networks of the settings.
    ///
    /// # Errors
    ///
    /// No socket of the domain could be opened, or a thread did not start.
    pub fn start(settings: &Ros2, name: &str) -> Result<Self, UserError> {
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(1)
            .thread_name("ros2")
            .enable_time()
            .build()
            .map_err(|e| failed("the thread did not start", &e))?;
        let mut builder = DomainParticipantBuilder::new(settings.domain.into());
        if !settings.networks.is_empty() {
            builder = builder.with_only_networks(settings.networks.iter().copied());
        }
        let participant = builder.build().map_err(|e| failed("DDS did not start", &e))?;
        let context = Context::from_domain_participant(participant).map_err(|e| failed("DDS did not start", &e))?;
        let node_name = NodeName::new("/", name).map_err(|e| failed("the name of the node", &e))?;
        let options = NodeOptions::new().enable_rosout(false);
        let mut node = context.new_node(node_name, options).map_err(|e| failed("the node did not start", &e))?;
        let spinner = node.spinner().map_err(|e| failed("the node did not start", &e))?;
        runtime.spawn(async move {
            if let Err(error) = spinner.spin().await {
                tracing::error!("ROS 2: discovery ended: {error}");
            }
        });
        let shared = Arc::new(Shared {
            node: Mutex::new(node),
            context,
            remaps: settings.remaps.clone(),
            namespace: settings.namespace.clone(),
            wanted: Mutex::default(),
        });
        runtime.spawn(watch::run(Arc::downgrade(&shared)));
        tracing::info!("ROS 2: node {name} in domain {} of DDS", settings.domain);
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

    /// What DDS has found.
    pub fn peers(&self) -> Peers {
        self.shared.peers()
    }

    /// Subscribes to a topic; its messages wait in the inbox, at most `capacity` of them.
    ///
    /// # Errors
    ///
    /// DDS refuses the topic, for example since this process uses it with another type.
    pub fn subscribe<M: Message>(&self, topic: &RosName, qos: Qos, capacity: usize) -> Result<Inbox<M>, UserError> {
        let name = remapped(topic, &self.shared.remaps);
        let subscription = Arc::new(self.shared.subscription::<M>(name, qos)?);
        let (mut inbox, filler) = Inbox::new(capacity);
        let weak = Arc::downgrade(&subscription);
        let publishers = move |node: &Node| Some(weak.upgrade()?.get_publisher_count(node));
        let wanted = Wanted::new(name.as_str().to_owned(), M::DEFINITION.full_name(), Box::new(publishers));
        locked(&self.shared.wanted).push(wanted);
        let task = fill(subscription, filler, name.as_str().to_owned());
        let runtime = self.runtime.as_ref().ok_or_else(|| UserError::Failed("ROS 2 has ended".to_owned()))?;
        inbox.filler = Some(runtime.spawn(task).abort_handle());
        Ok(inbox)
    }

    /// A publisher of a topic.
    ///
    /// # Errors
    ///
    /// DDS refuses the topic.
    pub fn publisher<M: Message>(&self, topic: &RosName, qos: Qos) -> Result<Publisher<M>, UserError> {
        let name = remapped(topic, &self.shared.remaps);
        let (dds_topic, mut node) = self.shared.topic::<M>(name, qos)?;
        let publisher = node.create_publisher(&dds_topic, None).map_err(|e| failed(name.as_str(), &e))?;
        drop(node);
        Ok(Publisher::new(publisher, self.shared.clone()))
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
    pub(crate) fn node(&self) -> MutexGuard<'_, Node> {
        locked(&self.node)
    }

    fn topic<M: Message>(&self, name: &RosName, qos: Qos) -> Result<(rustdds::Topic, MutexGuard<'_, Node>), UserError> {
        let definition = M::DEFINITION;
        let (dds_name, message) =
            (format!("rt{}", name.as_str()), MessageTypeName::new(definition.package, definition.name));
        let participant = self.context.domain_participant();
        let topic = participant.create_topic(dds_name, message.dds_msg_type(), &qos.policies(), TopicKind::NoKey);
        let topic = topic.map_err(|e| failed(name.as_str(), &e))?;
        let node = self.node();
        Ok((topic, node))
    }

    fn subscription<M: Message>(&self, name: &RosName, qos: Qos) -> Result<Subscription<M>, UserError> {
        let (topic, mut node) = self.topic::<M>(name, qos)?;
        node.create_subscription(&topic, None).map_err(|e| failed(name.as_str(), &e))
    }

    pub(crate) fn peers(&self) -> Peers {
        let participant = self.context.domain_participant();
        let own = participant.guid_prefix();
        let (writers, readers) = (participant.discovered_writers(), participant.discovered_readers());
        let writers = || writers.iter().map(|w| &w.publication_topic_data).filter(|w| w.key.prefix != own);
        let reading = readers.iter().map(|r| r.subscription_topic_data.key().prefix).filter(|prefix| *prefix != own);
        let participants: BTreeSet<_> = writers().map(|w| w.key.prefix).chain(reading).collect();
        let publishers = writers().filter_map(|w| Some((ros_topic(&w.topic_name)?, ros_type(&w.type_name))));
        Peers { participants: participants.len(), publishers: publishers.collect() }
    }
}

/// `rt/map` as `/map`; `None` for what is no topic of messages.
fn ros_topic(dds_name: &str) -> Option<String> {
    dds_name.strip_prefix("rt").filter(|name| name.starts_with('/')).map(str::to_owned)
}

/// `std_msgs::msg::dds_::Header_` as `std_msgs/msg/Header`.
fn ros_type(dds_name: &str) -> String {
    dds_name.trim_end_matches('_').replace("::dds_::", "::").replace("::", "/")
}

async fn fill<M: Message>(subscription: Arc<Subscription<M>>, filler: Filler<M>, topic: String) {
    let mut samples = std::pin::pin!(subscription.async_stream());
    while let Some(sample) = samples.next().await {
        match sample {
            Ok((message, _)) => filler.put(message),
            Err(error) => {
                let count = filler.put_malformed();
                // 1, 2, 4, 8, ...: a publisher of another type must not fill the log.
                if count.is_power_of_two() {
                    tracing::warn!("ROS 2: {topic}: {count} samples are no {}: {error}", M::DEFINITION.full_name());
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_on_dds_become_names_of_ros() {
        assert_eq!(ros_topic("rt/camera/image_raw").as_deref(), Some("/camera/image_raw"));
        assert_eq!(ros_topic("rq/get_parametersRequest"), None);
        assert_eq!(ros_topic("ros_discovery_info"), None);
        assert_eq!(ros_type("sensor_msgs::msg::dds_::Image_"), "sensor_msgs/msg/Image");
    }
}
