//! Subscriptions, which take samples with the own type hash and those without one.

use super::keys::{Endpoint, NO_HASH};
use crate::inbox::Filler;
use crate::transport::Qos;
use scenecast_messages::{CdrError, Message, decode};
use std::any::Any;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use zenoh::sample::{Sample, SampleKind};
use zenoh::{Session, Wait};
use zenoh_ext::{AdvancedSubscriberBuilderExt, HistoryConfig, RecoveryConfig};

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
pub(super) fn reader<M: Message>(filler: Filler<M>, endpoint: &Endpoint) -> impl Fn(Sample) + Send + Sync + 'static {
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
pub(super) fn declare(
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
