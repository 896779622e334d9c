//! ROS 2 by DDS, as `rmw_fastrtps_cpp` and `rmw_cyclonedds_cpp` speak it.

use crate::inbox::Filler;
use crate::transport::{Feed, OwnId, OwnIds, Peers, Qos, Transport, failed, locked};
use futures_util::StreamExt;
use ros2_client::qos::{Durability, History, QosProfile, Reliability, WhenFull};
use ros2_client::{Context, MessageTypeName, Node, NodeName, NodeOptions, Subscription};
use rustdds::policy::ResourceLimits;
use rustdds::{DomainParticipantBuilder, GUID, QosPolicies, QosPolicyBuilder, RTPSEntity, TopicKind};
use scenecast_config::{Ros2, RosName};
use scenecast_core::UserError;
use scenecast_messages::Message;
use std::collections::BTreeSet;
use std::sync::{Arc, Mutex, MutexGuard};
use tokio::runtime::Handle;

/// The participants of this process.
static OWN: OwnIds<GUID> = OwnIds::new();

/// A participant of a domain, with one node.
pub(crate) struct Dds {
    node: Mutex<Node>,
    context: Context,
    /// Runs discovery and the subscriptions.
    runtime: Handle,
    _own: OwnId<GUID>,
}

/// A publisher of one topic.
pub(crate) struct DdsPublisher<M: Message> {
    publisher: ros2_client::Publisher<M>,
    dds: Arc<Dds>,
}

impl Dds {
    /// # Errors
    ///
    /// No socket of the domain could be opened, or the name of the node is not allowed.
    pub fn start(settings: &Ros2, name: &str, runtime: Handle) -> Result<Arc<Self>, UserError> {
        let mut builder = DomainParticipantBuilder::new(settings.domain.into());
        if !settings.networks.is_empty() {
            builder = builder.with_only_networks(settings.networks.iter().copied());
        }
        let participant = builder.build().map_err(|e| failed("DDS did not start", &e))?;
        let own = OWN.add(participant.guid());
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
        Ok(Arc::new(Self { node: Mutex::new(node), context, runtime, _own: own }))
    }

    /// A subscription that fills an inbox.
    ///
    /// # Errors
    ///
    /// DDS refuses the topic, for example since this process uses it with another type.
    pub fn subscribe<M: Message>(
        self: &Arc<Self>,
        name: &RosName,
        qos: Qos,
        filler: Filler<M>,
    ) -> Result<Feed, UserError> {
        let (topic, mut node) = self.topic::<M>(name, qos)?;
        let subscription = node.create_subscription(&topic, None).map_err(|e| failed(name.as_str(), &e))?;
        drop(node);
        let subscription = Arc::new(subscription);
        let (weak, dds) = (Arc::downgrade(&subscription), Arc::downgrade(self));
        let wanted = (name.as_str().to_owned(), M::DEFINITION.full_name());
        let publishers = move || {
            let (subscription, dds) = (weak.upgrade()?, dds.upgrade()?);
            let count = subscription.get_publisher_count(&dds.node());
            Some(if dds.peers().has_other_type(&wanted) { 0 } else { count })
        };
        let task = self.runtime.spawn(fill(subscription, filler, name.as_str().to_owned()));
        let ending = Box::new(AbortOnDrop(task.abort_handle()));
        Ok(Feed { transport: Transport::Dds, publishers: Box::new(publishers), ending })
    }

    /// # Errors
    ///
    /// DDS refuses the topic.
    pub fn publisher<M: Message>(self: &Arc<Self>, name: &RosName, qos: Qos) -> Result<DdsPublisher<M>, UserError> {
        let (topic, mut node) = self.topic::<M>(name, qos)?;
        let publisher = node.create_publisher(&topic, None).map_err(|e| failed(name.as_str(), &e))?;
        drop(node);
        Ok(DdsPublisher { publisher, dds: self.clone() })
    }

    fn node(&self) -> MutexGuard<'_, Node> {
        locked(&self.node)
    }

    fn topic<M: Message>(&self, name: &RosName, qos: Qos) -> Result<(rustdds::Topic, MutexGuard<'_, Node>), UserError> {
        let definition = M::DEFINITION;
        let message = MessageTypeName::new(definition.package, definition.name);
        let (dds_name, dds_type) = (dds_topic(name.as_str()), message.dds_msg_type());
        let participant = self.context.domain_participant();
        let topic = participant.create_topic(dds_name, dds_type, &policies(qos), TopicKind::NoKey);
        Ok((topic.map_err(|e| failed(name.as_str(), &e))?, self.node()))
    }

    /// What DDS has found on its networks, without this process.
    pub fn peers(&self) -> Peers {
        let participant = self.context.domain_participant();
        let own = OWN.all();
        let is_other = |guid: &GUID| own.iter().all(|own| own.prefix != guid.prefix);
        let (writers, readers) = (participant.discovered_writers(), participant.discovered_readers());
        let writers = || writers.iter().map(|w| &w.publication_topic_data).filter(|w| is_other(&w.key));
        let reading = readers.iter().map(|r| r.subscription_topic_data.key()).filter(|key| is_other(key));
        let participants: BTreeSet<_> = writers().map(|w| w.key.prefix).chain(reading.map(|key| key.prefix)).collect();
        let publishers = writers().filter_map(|w| Some((ros_topic(&w.topic_name)?, ros_type(&w.type_name))));
        Peers { participants: participants.len(), publishers: publishers.collect() }
    }
}

impl<M: Message> DdsPublisher<M> {
    pub fn subscribers(&self) -> usize {
        self.publisher.get_subscription_count(&self.dds.node())
    }

    /// Returns whether DDS took the message. It refuses one while its window to a slow subscriber is full.
    pub fn publish(&self, message: M) -> bool {
        self.publisher.publish(message).is_ok()
    }
}

struct AbortOnDrop(tokio::task::AbortHandle);

impl Drop for AbortOnDrop {
    fn drop(&mut self) {
        self.0.abort();
    }
}

async fn fill<M: Message>(subscription: Arc<Subscription<M>>, filler: Filler<M>, topic: String) {
    let mut samples = std::pin::pin!(subscription.async_stream());
    while let Some(sample) = samples.next().await {
        filler.put_read(sample.map(|(message, _)| message), &topic);
    }
}

/// The name of a topic on DDS: `/map` becomes `rt/map`.
pub(super) fn dds_topic(name: &str) -> String {
    format!("rt{name}")
}

/// `rt/map` as `/map`; `None` for what is no topic of messages.
pub(super) fn ros_topic(dds_name: &str) -> Option<String> {
    dds_name.strip_prefix("rt").filter(|name| name.starts_with('/')).map(str::to_owned)
}

/// The name of a type in ROS 2: `std_msgs::msg::dds_::Header_` becomes `std_msgs/msg/Header`.
pub(crate) fn ros_type(dds_name: &str) -> String {
    dds_name.trim_end_matches('_').replace("::dds_::", "::").replace("::", "/")
}

/// Bound of what RustDDS keeps of a topic of sensors: by its default, 64 images of 1360 x 1024 would take 270 MB.
const SENSOR_SAMPLES: i32 = 8;

/// The policies of a topic.
pub(super) fn policies(qos: Qos) -> QosPolicies {
    let policies = QosPolicies::from(&profile(qos));
    let Qos::Sensor(depth) = qos else { return policies };
    let max_samples = i32::try_from(depth).unwrap_or(i32::MAX).max(SENSOR_SAMPLES);
    let limits = ResourceLimits { max_samples, max_instances: 1, max_samples_per_instance: max_samples };
    policies.modify_by(&QosPolicyBuilder::new().resource_limits(limits).build())
}

fn profile(qos: Qos) -> QosProfile {
    // A publisher with a full window drops: its thread must not wait for a peer.
    let reliable = Reliability::Reliable { when_full: WhenFull::Fail };
    let (reliability, durability, depth) = match qos {
        Qos::Sensor(depth) => (Reliability::BestEffort, Durability::Volatile, depth),
        Qos::Reliable(depth) => (reliable, Durability::Volatile, depth),
        Qos::Latched(depth) => (reliable, Durability::TransientLocal, depth),
    };
    let profile = QosProfile::subscription_default().reliability(reliability).durability(durability);
    profile.history(History::KeepLast { depth })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_on_dds_become_names_of_ros() {
        assert_eq!(ros_topic("rt/camera/image_raw").as_deref(), Some("/camera/image_raw"));
        assert_eq!(dds_topic("/camera/image_raw"), "rt/camera/image_raw");
        assert_eq!(ros_topic("rq/get_parametersRequest"), None);
        assert_eq!(ros_topic("ros_discovery_info"), None);
        assert_eq!(ros_type("sensor_msgs::msg::dds_::Image_"), "sensor_msgs/msg/Image");
    }
}
