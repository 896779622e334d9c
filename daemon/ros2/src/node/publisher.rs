//! Publishers that never wait.

use super::Shared;
use scenecast_messages::Message;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// A publisher of one topic.
pub struct Publisher<M: Message> {
    publisher: ros2_client::Publisher<M>,
    shared: Arc<Shared>,
    refused: AtomicU64,
}

impl<M: Message> Publisher<M> {
    pub(crate) fn new(publisher: ros2_client::Publisher<M>, shared: Arc<Shared>) -> Self {
        Self { publisher, shared, refused: AtomicU64::new(0) }
    }

    /// The number of subscribers now.
    pub fn subscribers(&self) -> usize {
        self.publisher.get_subscription_count(&self.shared.node())
    }

    /// Publishes a message; returns whether DDS took it. It refuses one while its window to a slow subscriber is full.
    pub fn publish(&self, message: M) -> bool {
        let published = self.publisher.publish(message);
        if published.is_err() {
            self.refused.fetch_add(1, Ordering::Relaxed);
        }
        published.is_ok()
    }

    /// Messages that DDS refused.
    pub fn refused(&self) -> u64 {
        self.refused.load(Ordering::Relaxed)
    }
}
