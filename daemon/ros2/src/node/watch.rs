//! Reports peers, and topics that nobody publishes.

use super::{Peers, Shared, locked};
use ros2_client::Node;
use std::sync::Weak;
use std::time::{Duration, Instant};

/// Time between two looks at the peers.
const INTERVAL: Duration = Duration::from_secs(1);
/// Time without a publisher after which it is logged.
const PATIENCE_TIMEOUT: Duration = Duration::from_secs(10);

/// Counts the publishers of a subscription; `None` once that has ended.
pub(crate) type Count = Box<dyn Fn(&Node) -> Option<usize> + Send>;

/// A subscription and the publishers that it has.
pub(crate) struct Wanted {
    topic: String,
    /// The full name of its type.
    message: String,
    count: Count,
    since: Instant,
    publishers: usize,
    is_reported: bool,
}

impl Wanted {
    pub fn new(topic: String, message: String, count: Count) -> Self {
        Self { topic, message, count, since: Instant::now(), publishers: 0, is_reported: false }
    }

    /// Notes the number of publishers; returns a line for people, once an outage and once at its end.
    fn handle(&mut self, publishers: usize, peers: &Peers, now: Instant) -> Option<String> {
        let (before, is_reported) = (std::mem::replace(&mut self.publishers, publishers), self.is_reported);
        match publishers {
            0 if before > 0 => {
                (self.since, self.is_reported) = (now, false);
                None
            }
            0 if !is_reported && now.duration_since(self.since) >= PATIENCE_TIMEOUT => {
                self.is_reported = true;
                Some(self.outage(peers))
            }
            0 => None,
            _ => {
                self.is_reported = false;
                (before == 0).then(|| format!("{}: {publishers} publisher(s)", self.topic))
            }
        }
    }

    /// Why there may be no publisher.
    fn outage(&self, peers: &Peers) -> String {
        let Self { topic, message, .. } = self;
        let seconds = PATIENCE_TIMEOUT.as_secs();
        let begin = format!("{topic}: no publisher of {message} for {seconds} s");
        if peers.participants == 0 {
            return format!(
                "{begin}, and no peer on DDS: is the robot in another domain (ros2.domain) or network (ros2.networks), or \
                 does it use rmw_zenoh, which DDS does not see?"
            );
        }
        if let Some((_, other)) = peers.publishers.iter().find(|(name, other)| name == topic && other != message) {
            return format!("{begin}: a peer publishes it as {other}");
        }
        if peers.publishers.iter().any(|(name, _)| name == topic) {
            return format!("{begin}: a peer publishes it with a quality of service that does not match");
        }
        let same: Vec<&str> = peers.publishers.iter().filter(|p| p.1 == *message).map(|p| p.0.as_str()).collect();
        let topics = if same.is_empty() { "no topic".to_owned() } else { same.join(", ") };
        format!(
            "{begin}; the {} peer(s) on DDS publish {topics} of this type. A robot that uses rmw_zenoh is not seen",
            peers.participants
        )
    }
}

/// Looks at the peers until the node ends.
pub(crate) async fn run(shared: Weak<Shared>) {
    let mut participants = 0;
    loop {
        tokio::time::sleep(INTERVAL).await;
        let Some(shared) = shared.upgrade() else { return };
        let peers = shared.peers();
        if peers.participants != participants {
            tracing::info!("ROS 2: {} peer(s) on DDS", peers.participants);
            participants = peers.participants;
        }
        let now = Instant::now();
        locked(&shared.wanted).retain_mut(|wanted| {
            let Some(count) = (wanted.count)(&shared.node()) else { return false };
            match wanted.handle(count, &peers, now) {
                Some(line) if count == 0 => tracing::warn!("ROS 2: {line}"),
                Some(line) => tracing::info!("ROS 2: {line}"),
                None => {}
            }
            true
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const IMAGE: &str = "sensor_msgs/msg/Image";

    fn peers(participants: usize, publishers: &[(&str, &str)]) -> Peers {
        let publishers = publishers.iter().map(|&(topic, message)| (topic.to_owned(), message.to_owned())).collect();
        Peers { participants, publishers }
    }

    /// The line after 10 s without a publisher.
    fn outage(peers: &Peers) -> String {
        let mut wanted = Wanted::new("/image".to_owned(), IMAGE.to_owned(), Box::new(|_| None));
        let start = wanted.since;
        assert_eq!(wanted.handle(0, peers, start + Duration::from_secs(9)), None);
        wanted.handle(0, peers, start + Duration::from_secs(10)).unwrap()
    }

    #[test]
    fn an_outage_is_reported_with_its_likely_cause() {
        assert!(outage(&peers(0, &[])).contains("rmw_zenoh"));
        let others = peers(2, &[("/camera/image_raw", IMAGE), ("/chatter", "std_msgs/msg/String")]);
        let line = outage(&others);
        assert!(
            line.contains("2 peer(s)") && line.contains("/camera/image_raw") && line.contains("rmw_zenoh"),
            "{line}"
        );
        assert!(!line.contains("/chatter"), "{line}");
        let compressed = peers(1, &[("/image", "sensor_msgs/msg/CompressedImage")]);
        assert!(outage(&compressed).ends_with("a peer publishes it as sensor_msgs/msg/CompressedImage"));
        assert!(outage(&peers(1, &[("/image", IMAGE)])).contains("quality of service"));
    }

    #[test]
    fn an_outage_is_reported_once_and_again_after_it_ended() {
        let none = peers(0, &[]);
        let mut wanted = Wanted::new("/image".to_owned(), IMAGE.to_owned(), Box::new(|_| None));
        let at = |wanted: &Wanted, s| wanted.since + Duration::from_secs(s);
        let (t10, t11, t20, t21) = (at(&wanted, 10), at(&wanted, 11), at(&wanted, 20), at(&wanted, 21));
        assert!(wanted.handle(0, &none, t10).is_some());
        assert_eq!(wanted.handle(0, &none, t11), None);
        assert_eq!(wanted.handle(1, &none, t11).unwrap(), "/image: 1 publisher(s)");
        assert_eq!(wanted.handle(0, &none, t11), None);
        assert_eq!(wanted.handle(0, &none, t20), None);
        assert!(wanted.handle(0, &none, t21).is_some());
    }
}
