//! Publishers, which keep the last samples of latched topics for later subscribers, and subscriptions.

use super::keys::{Endpoint, Gid, Kind, NO_HASH, attachment, gid};
use super::{Graph, Zenoh};
use crate::inbox::Filler;
use crate::transport::{Qos, locked};
use scenecast_messages::{CdrError, Message, decode};
use std::any::Any;
use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, AtomicI64, Ordering};
use std::sync::{Arc, Mutex, OnceLock};
use std::time::{Duration, SystemTime};
use zenoh::bytes::ZBytes;
use zenoh::liveliness::LivelinessToken;
use zenoh::qos::CongestionControl;
use zenoh::sample::{Sample, SampleKind};
use zenoh::{Session, Wait};
use zenoh_ext::{
    AdvancedPublisher, AdvancedPublisherBuilderExt, AdvancedSubscriberBuilderExt, CacheConfig, HistoryConfig,
    MissDetectionConfig, RecoveryConfig,
};

/// Time after a sample at which the publisher of a latched topic announces its number, so that a lost one is noticed.
const HEARTBEAT_INTERVAL: Duration = Duration::from_secs(1);

/// A publisher of one topic.
pub(crate) struct ZenohPublisher {
    zenoh: Arc<Zenoh>,
    endpoint: Endpoint,
    qos: Qos,
    main: Channel,
    /// For subscribers of Humble, whose keys have no type hash; made with the first of them.
    without_hash: OnceLock<Option<Channel>>,
    /// The last samples of a latched topic, for `without_hash`; they share their bytes with those that Zenoh keeps.
    kept: Mutex<VecDeque<ZBytes>>,
    _token: LivelinessToken,
}

/// The samples of one key.
struct Channel {
    publisher: AdvancedPublisher<'static>,
    gid: Gid,
    published: AtomicI64,
}

impl ZenohPublisher {
    pub(super) fn declare(zenoh: &Arc<Zenoh>, endpoint: Endpoint, qos: Qos) -> zenoh::Result<Self> {
        let (token, token_key) = zenoh.announce(Kind::Publisher, &endpoint, qos)?;
        let key = endpoint.key(zenoh.tokens.domain, &endpoint.hash);
        let main = Channel::declare(zenoh, key, qos, gid(&token_key))?;
        let (without_hash, kept) = (OnceLock::new(), Mutex::default());
        Ok(Self { zenoh: zenoh.clone(), endpoint, qos, main, without_hash, kept, _token: token })
    }

    fn graph(&self) -> &Graph {
        &self.zenoh.graph
    }

    pub fn subscribers(&self) -> usize {
        self.serve_humble();
        self.graph().count(Kind::Subscription, &self.endpoint)
    }

    /// Whether a message has a subscriber, or is kept for later ones.
    pub fn is_wanted(&self) -> bool {
        matches!(self.qos, Qos::Latched(_)) || self.subscribers() > 0
    }

    /// Publishes the bytes of a message; returns whether the session took them. While a peer is slow, they are dropped for it.
    pub fn publish(&self, bytes: Vec<u8>) -> bool {
        let bytes = ZBytes::from(bytes);
        let humble = self.serve_humble();
        if let Qos::Latched(depth) = self.qos {
            let mut kept = locked(&self.kept);
            while kept.len() >= depth.max(1) {
                kept.pop_front();
            }
            kept.push_back(bytes.clone());
        }
        let by_humble = humble.is_none_or(|channel| channel.put(bytes.clone()));
        self.main.put(bytes) && by_humble
    }

    /// The channel for subscribers of Humble, once there was one.
    fn serve_humble(&self) -> Option<&Channel> {
        if self.without_hash.get().is_none() && self.graph().count_without_hash(Kind::Subscription, &self.endpoint) == 0
        {
            return None;
        }
        let declare = || {
            let topic = &self.endpoint.topic;
            tracing::info!("ROS 2: {topic}: a subscriber of Humble without type hash; it is published without one too");
            let key = self.endpoint.key(self.zenoh.tokens.domain, NO_HASH);
            let channel = Channel::declare(&self.zenoh, key, self.qos, self.main.gid);
            let channel = channel.inspect_err(|e| tracing::error!("ROS 2: {topic} without type hash: {e}")).ok()?;
            for bytes in locked(&self.kept).iter() {
                channel.put(bytes.clone());
            }
            Some(channel)
        };
        self.without_hash.get_or_init(declare).as_ref()
    }
}

impl Channel {
    fn declare(zenoh: &Zenoh, key: String, qos: Qos, gid: Gid) -> zenoh::Result<Self> {
        // Its thread must not wait for a peer.
        let builder = zenoh.session.declare_publisher(key).congestion_control(CongestionControl::Drop).advanced();
        let publisher = match qos {
            Qos::Latched(depth) => builder
                .publisher_detection()
                .cache(CacheConfig::default().max_samples(depth))
                .sample_miss_detection(MissDetectionConfig::default().sporadic_heartbeat(HEARTBEAT_INTERVAL))
                .wait()?,
            Qos::Sensor(_) | Qos::Reliable(_) => builder.wait()?,
        };
        Ok(Self { publisher, gid, published: AtomicI64::new(0) })
    }

    fn put(&self, bytes: ZBytes) -> bool {
        let sequence = 1 + self.published.fetch_add(1, Ordering::Relaxed);
        let nanos = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).map_or(0, |since| since.as_nanos() as i64);
        let attachment = attachment(sequence, nanos, &self.gid).to_vec();
        let put = self.publisher.put(bytes).attachment(attachment).wait();
        put.inspect_err(|e| tracing::debug!("ROS 2: {e}")).is_ok()
    }
}

/// Time in which publishers must send what they keep.
const HISTORY_TIMEOUT: Duration = Duration::from_secs(60);

/// A sample that is not taken.
#[derive(Debug, thiserror::Error)]
enum Unreadable {
    #[error("its publisher has another definition of this type, with the hash {0}")]
    OtherDefinition(String),
    #[error("{0}")]
    Cdr(#[from] CdrError),
}

/// Reads samples into an inbox.
pub(super) fn subscription_reader<M: Message>(
    filler: Filler<M>,
    endpoint: &Endpoint,
) -> impl Fn(Sample) + Send + Sync + 'static {
    let Endpoint { topic, hash, .. } = endpoint.clone();
    let is_told = AtomicBool::new(false);
    move |sample| {
        if sample.kind() != SampleKind::Put {
            return;
        }
        let key = sample.key_expr().as_str();
        let theirs = key.rsplit('/').next().unwrap_or_default();
        if theirs == NO_HASH && !is_told.swap(true, Ordering::Relaxed) {
            let message = M::DEFINITION.full_name();
            tracing::info!(
                "ROS 2: {topic}: a publisher of Humble without type hash; its {message} is taken as this build's"
            );
        }
        let read = match theirs == NO_HASH || theirs == hash {
            true => decode::<M>(&sample.payload().to_bytes()).map_err(Unreadable::from),
            false => Err(Unreadable::OtherDefinition(theirs.chars().take(80).collect())),
        };
        filler.put_read(read, &topic);
    }
}

/// Declares a subscription, which ends when it is dropped.
pub(super) fn declare_subscription(
    session: &Session,
    key: String,
    qos: Qos,
    read: impl Fn(Sample) + Send + Sync + 'static,
) -> zenoh::Result<Box<dyn Any + Send + Sync>> {
    let builder = session.declare_subscriber(key).callback(read);
    let Qos::Latched(depth) = qos else { return Ok(Box::new(builder.wait()?)) };
    let advanced = builder
        .advanced()
        .subscriber_detection()
        .query_timeout(HISTORY_TIMEOUT)
        .history(HistoryConfig::default().detect_late_publishers().max_samples(depth))
        .recovery(RecoveryConfig::default().heartbeat());
    Ok(Box::new(advanced.wait()?))
}
