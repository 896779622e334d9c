//! Publishers that never wait.

use crate::dds::DdsPublisher;
use crate::zenoh::ZenohPublisher;
use scenecast_messages::{Message, encode};
use std::sync::atomic::{AtomicU64, Ordering};

/// A publisher of one topic, on every transport of the node.
pub struct Publisher<M: Message> {
    pub(super) dds: Option<DdsPublisher<M>>,
    pub(super) zenoh: Option<ZenohPublisher>,
    pub(super) refused: AtomicU64,
}

impl<M: Message> Publisher<M> {
    /// The number of subscribers now.
    pub fn subscribers(&self) -> usize {
        let dds = self.dds.as_ref().map_or(0, DdsPublisher::subscribers);
        dds + self.zenoh.as_ref().map_or(0, ZenohPublisher::subscribers)
    }

    /// Publishes a message; returns whether every transport took it. DDS refuses one while its window to a slow subscriber is
    /// full.
    pub fn publish(&self, message: M) -> bool {
        let by_zenoh = self.zenoh.as_ref().is_none_or(|zenoh| !zenoh.is_wanted() || zenoh.publish(encode(&message)));
        let is_published = self.dds.as_ref().is_none_or(|dds| dds.publish(message)) && by_zenoh;
        if !is_published {
            self.refused.fetch_add(1, Ordering::Relaxed);
        }
        is_published
    }

    /// Messages that a transport refused.
    pub fn refused(&self) -> u64 {
        self.refused.load(Ordering::Relaxed)
    }
}
