//! The terms that all transports share: quality of service, peers, and a subscription's end.

use scenecast_core::UserError;
use std::any::Any;
use std::collections::BTreeSet;
use std::fmt;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// A subscription on one transport.
pub(crate) struct Feed {
    pub transport: Transport,
    /// The number of its publishers now; `None` once it has ended.
    pub publishers: Box<dyn Fn() -> Option<usize> + Send>,
    /// Ends the subscription when it is dropped.
    pub ending: Box<dyn Any + Send + Sync>,
}

pub(crate) fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

pub(crate) fn failed(action: &str, error: &dyn std::fmt::Display) -> UserError {
    UserError::Failed(format!("ROS 2: {action}: {error}"))
}

/// The ids of this process on one transport.
pub(crate) struct OwnIds<T: 'static>(Mutex<Vec<T>>);

/// An id, which is in the list as long as this exists.
pub(crate) struct OwnId<T: PartialEq + 'static> {
    ids: &'static OwnIds<T>,
    id: T,
}

impl<T: PartialEq + Clone> OwnIds<T> {
    pub const fn new() -> Self {
        Self(Mutex::new(Vec::new()))
    }

    pub fn add(&'static self, id: T) -> OwnId<T> {
        locked(&self.0).push(id.clone());
        OwnId { ids: self, id }
    }

    pub fn all(&self) -> Vec<T> {
        locked(&self.0).clone()
    }
}

impl<T: PartialEq> Drop for OwnId<T> {
    fn drop(&mut self) {
        locked(&self.ids.0).retain(|id| *id != self.id);
    }
}

/// What carries the messages of ROS 2.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Transport {
    /// DDS, by which `rmw_fastrtps_cpp`, `rmw_cyclonedds_cpp` and others are reached.
    Dds,
    /// Zenoh in the form of `rmw_zenoh_cpp`.
    Zenoh,
}

impl fmt::Display for Transport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Dds => "DDS",
            Self::Zenoh => "rmw_zenoh",
        })
    }
}

/// The other processes that were found, and what they publish.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Peers {
    /// Processes other than this one.
    pub participants: usize,
    /// Topic and type of their publishers, such as `/camera/image_raw` and `sensor_msgs/msg/Image`.
    pub publishers: BTreeSet<(String, String)>,
}

impl Peers {
    /// Whether the topic is published, and with another type than the wanted one alone.
    pub(crate) fn has_other_type(&self, wanted: &(String, String)) -> bool {
        let has_topic = self.publishers.iter().any(|(topic, _)| *topic == wanted.0);
        has_topic && !self.publishers.contains(wanted)
    }

    /// The peers of all transports together.
    pub(crate) fn joined(by_transport: Vec<(Transport, Self)>) -> Self {
        by_transport.into_iter().fold(Self::default(), |mut all, (_, peers)| {
            all.participants += peers.participants;
            all.publishers.extend(peers.publishers);
            all
        })
    }
}

/// The number of peers for people, such as `2 on DDS, 0 on rmw_zenoh`.
pub(crate) fn counts(by_transport: &[(Transport, Peers)]) -> String {
    let counts: Vec<String> =
        by_transport.iter().map(|(by, peers)| format!("{} on {by}", peers.participants)).collect();
    counts.join(", ")
}

/// The quality of service of a topic, by its use.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Qos {
    /// Sensors: best effort, with this depth. It matches every publisher.
    Sensor(usize),
    /// States and orders: reliable, not kept for later subscribers, with this depth.
    Reliable(usize),
    /// Latched: reliable, and the last ones are kept for later subscribers, with this depth.
    Latched(usize),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_id_is_listed_as_long_as_its_node_exists() {
        static IDS: OwnIds<u8> = OwnIds::new();
        let (first, second) = (IDS.add(1), IDS.add(2));
        assert_eq!(IDS.all(), [1, 2]);
        drop(first);
        assert_eq!(IDS.all(), [2]);
        drop(second);
        assert!(IDS.all().is_empty());
    }

    #[test]
    fn a_topic_of_another_type_is_not_the_wanted_one() {
        let pair = |topic: &str, message: &str| (topic.to_owned(), message.to_owned());
        let image = pair("/camera", "sensor_msgs/msg/Image");
        let peers = |pairs: &[(String, String)]| Peers { participants: 1, publishers: pairs.iter().cloned().collect() };
        assert!(!peers(&[]).has_other_type(&image), "nobody publishes it");
        assert!(!peers(std::slice::from_ref(&image)).has_other_type(&image));
        let odometry = pair("/camera", "nav_msgs/msg/Odometry");
        assert!(peers(std::slice::from_ref(&odometry)).has_other_type(&image));
        assert!(!peers(&[odometry, image.clone()]).has_other_type(&image));
    }
}
