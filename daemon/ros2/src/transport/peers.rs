//! Peers, by the transport that sees them.

use std::collections::BTreeSet;
use std::fmt;

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

#[cfg(test)]
mod tests {
    use super::*;

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
