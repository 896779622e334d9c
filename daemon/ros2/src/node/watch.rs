//! Publishers that never wait, reports of peers, and topics that nobody publishes.

use super::Shared;
use crate::dds::DdsPublisher;
use crate::transport::{Peers, Transport, counts, locked};
use crate::zenoh::ZenohPublisher;
use scenecast_messages::contents::Health;
use scenecast_messages::diagnostic_msgs::DiagnosticStatus;
use scenecast_messages::{Message, encode};
use std::sync::Weak;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// Time between two looks at the peers.
const INTERVAL: Duration = Duration::from_secs(1);
/// Time without a publisher, or without a router, after which it is logged.
const PEER_TIMEOUT: Duration = Duration::from_secs(10);

/// Counts the publishers of a subscription; `None` once that has ended.
type Count = Box<dyn Fn() -> Option<usize> + Send>;

/// A subscription and the publishers that it has.
pub(super) struct Wanted {
    topic: String,
    /// The full name of its type.
    message: String,
    counts: Vec<(Transport, Count)>,
    since: Instant,
    publishers: usize,
    is_reported: bool,
}

impl Wanted {
    pub fn new(topic: String, message: String, counts: Vec<(Transport, Count)>) -> Self {
        Self { topic, message, counts, since: Instant::now(), publishers: 0, is_reported: false }
    }

    /// The publishers on each transport; `None` once the subscription has ended.
    fn count(&self) -> Option<Vec<(Transport, usize)>> {
        self.counts.iter().map(|(transport, count)| Some((*transport, count()?))).collect()
    }

    /// Notes the number of publishers; returns a line for people, once an outage and once at its end.
    fn handle(&mut self, count: &[(Transport, usize)], peers: &[(Transport, Peers)], now: Instant) -> Option<String> {
        let publishers = count.iter().map(|(_, n)| n).sum();
        let (before, is_reported) = (std::mem::replace(&mut self.publishers, publishers), self.is_reported);
        match publishers {
            0 if before > 0 => {
                (self.since, self.is_reported) = (now, false);
                None
            }
            0 if !is_reported && now.duration_since(self.since) >= PEER_TIMEOUT => {
                self.is_reported = true;
                Some(self.outage(peers))
            }
            0 => None,
            _ => {
                self.is_reported = false;
                let on = count.iter().filter(|(_, n)| *n > 0).map(|(transport, n)| format!("{n} on {transport}"));
                (before == 0).then(|| format!("{}: publishers: {}", self.topic, on.collect::<Vec<_>>().join(", ")))
            }
        }
    }

    /// Why there may be no publisher.
    fn outage(&self, by_transport: &[(Transport, Peers)]) -> String {
        let Self { topic, message, .. } = self;
        let begin = format!("{topic}: no publisher of {message} for {} s", PEER_TIMEOUT.as_secs());
        for (transport, peers) in by_transport {
            let other = peers.publishers.iter().find(|(name, other)| name == topic && other != message);
            if let Some((_, other)) = other {
                return format!("{begin}: a peer on {transport} publishes it as {other}");
            }
            if peers.publishers.contains(&(topic.clone(), message.clone())) {
                let cause = match transport {
                    Transport::Dds => "with a quality of service that does not match",
                    Transport::Zenoh => "with another definition of this type: their type hashes differ",
                };
                return format!("{begin}: a peer on {transport} publishes it {cause}");
            }
        }
        let seeing = by_transport.iter().filter(|(_, peers)| peers.participants > 0);
        let seen: Vec<String> = seeing.map(|(transport, peers)| self.seen(*transport, peers)).collect();
        if seen.is_empty() {
            return format!("{begin}, and no peer{}", nobody(by_transport.iter().map(|(t, _)| *t).collect()));
        }
        let unused = match by_transport {
            [(Transport::Dds, _)] => ". A robot that uses rmw_zenoh is not seen: ros2.transport",
            [(Transport::Zenoh, _)] => ". A robot that uses DDS is not seen: ros2.transport",
            _ => "",
        };
        let blind: String = by_transport
            .iter()
            .filter(|(_, peers)| peers.participants == 0)
            .map(|(transport, _)| format!("; no peer on {transport}: is {} the robot's?", setting(*transport)))
            .collect();
        format!("{begin}; {}{blind}{unused}", seen.join("; "))
    }

    /// The topics of the wanted type that peers publish.
    fn seen(&self, transport: Transport, peers: &Peers) -> String {
        let same: Vec<&str> = peers.publishers.iter().filter(|p| p.1 == self.message).map(|p| p.0.as_str()).collect();
        let topics = if same.is_empty() { "no topic".to_owned() } else { same.join(", ") };
        format!("the {} peer(s) on {transport} publish {topics} of this type", peers.participants)
    }
}

/// The settings by which a transport finds peers.
fn setting(transport: Transport) -> &'static str {
    match transport {
        Transport::Dds => "the domain (ros2.domain) or the network (ros2.networks)",
        Transport::Zenoh => "the domain (ros2.domain) or the router (ros2.zenoh_router)",
    }
}

/// Where a robot may be that no transport sees.
fn nobody(transports: Vec<Transport>) -> String {
    match transports.as_slice() {
        [Transport::Dds] => " on DDS: is the robot in another domain (ros2.domain) or network (ros2.networks), or does it use \
                             rmw_zenoh (ros2.transport), which DDS does not see?"
            .to_owned(),
        [Transport::Zenoh] => " on rmw_zenoh: is the robot in another domain (ros2.domain) or at another router \
                               (ros2.zenoh_router), or does it use DDS (ros2.transport), which rmw_zenoh does not see?"
            .to_owned(),
        _ => " on DDS nor on rmw_zenoh: is the robot in another domain (ros2.domain), network (ros2.networks) or at another \
              router (ros2.zenoh_router)?"
            .to_owned(),
    }
}

/// What is reported of rmw_zenoh's router.
struct Router {
    endpoint: String,
    since: Instant,
    /// `None` before the first report.
    reported: Option<bool>,
}

impl Router {
    /// Notes whether there is a router; returns a line for people about a change.
    fn handle(&mut self, is_there: bool, now: Instant) -> Option<String> {
        if self.reported == Some(is_there) {
            self.since = now;
            return None;
        }
        if is_there {
            self.reported = Some(true);
            return Some(format!("connected to the router of Zenoh at {}", self.endpoint));
        }
        if now.duration_since(self.since) < PEER_TIMEOUT {
            return None;
        }
        self.reported = Some(false);
        let advice = "nodes of rmw_zenoh find each other by it; start one with `ros2 run rmw_zenoh_cpp rmw_zenohd`";
        Some(format!("no router of Zenoh at {} (ros2.zenoh_router): {advice}", self.endpoint))
    }
}

/// Looks at the peers until the node ends.
pub(super) async fn run(shared: Weak<Shared>, endpoint: String) {
    let mut seen = None;
    let mut router = Router { endpoint, since: Instant::now(), reported: None };
    loop {
        tokio::time::sleep(INTERVAL).await;
        let Some(shared) = shared.upgrade() else { return };
        let (peers, now) = (shared.peers(), Instant::now());
        let numbers = counts(&peers);
        let is_new = seen.as_ref() != Some(&numbers);
        if is_new && (seen.is_some() || peers.iter().any(|(_, peers)| peers.participants > 0)) {
            tracing::info!("ROS 2: peers: {numbers}");
        }
        seen = Some(numbers);
        match shared.has_router().and_then(|is_there| Some((is_there, router.handle(is_there, now)?))) {
            Some((true, line)) => tracing::info!("ROS 2: {line}"),
            Some((false, line)) => tracing::warn!("ROS 2: {line}"),
            None => {}
        }
        locked(&shared.wanted).retain_mut(|wanted| {
            let Some(count) = wanted.count() else { return false };
            let line = wanted.handle(&count, &peers, now);
            match line {
                Some(line) if wanted.publishers == 0 => tracing::warn!("ROS 2: {line}"),
                Some(line) => tracing::info!("ROS 2: {line}"),
                None => {}
            }
            true
        });
    }
}

/// `has_router` is `None` if rmw_zenoh is not used.
pub(super) fn health(by_transport: &[(Transport, Peers)], has_router: Option<bool>) -> Health {
    let level = if has_router == Some(false) { DiagnosticStatus::WARN } else { DiagnosticStatus::OK };
    let router = if has_router == Some(false) { "; no router of Zenoh" } else { "" };
    let message = format!("peers: {}{router}", counts(by_transport));
    let mut values: Vec<(&'static str, String)> =
        by_transport.iter().map(|(transport, peers)| (key(*transport), peers.participants.to_string())).collect();
    values.extend(has_router.map(|has| ("zenoh_router", has.to_string())));
    Health { level, part: "ros2", message, values }
}

fn key(transport: Transport) -> &'static str {
    match transport {
        Transport::Dds => "dds_peers",
        Transport::Zenoh => "zenoh_peers",
    }
}

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

#[cfg(test)]
mod tests {
    use super::Transport::{Dds, Zenoh};
    use super::*;

    const IMAGE: &str = "sensor_msgs/msg/Image";

    fn peers(participants: usize, publishers: &[(&str, &str)]) -> Peers {
        let publishers = publishers.iter().map(|&(topic, message)| (topic.to_owned(), message.to_owned())).collect();
        Peers { participants, publishers }
    }

    fn wanted() -> Wanted {
        Wanted::new("/image".to_owned(), IMAGE.to_owned(), Vec::new())
    }

    /// The line after 10 s without a publisher.
    fn outage(peers: &[(Transport, Peers)]) -> String {
        let mut wanted = wanted();
        let start = wanted.since;
        assert_eq!(wanted.handle(&[(Dds, 0)], peers, start + Duration::from_secs(9)), None);
        wanted.handle(&[(Dds, 0)], peers, start + Duration::from_secs(10)).unwrap()
    }

    #[test]
    fn an_outage_is_reported_with_its_likely_cause() {
        assert!(outage(&[(Dds, peers(0, &[]))]).contains("rmw_zenoh"));
        let others = peers(2, &[("/camera/image_raw", IMAGE), ("/chatter", "std_msgs/msg/String")]);
        let line = outage(&[(Dds, others)]);
        assert!(
            line.contains("2 peer(s)") && line.contains("/camera/image_raw") && line.contains("rmw_zenoh"),
            "{line}"
        );
        assert!(!line.contains("/chatter"), "{line}");
        let compressed = peers(1, &[("/image", "sensor_msgs/msg/CompressedImage")]);
        assert!(outage(&[(Dds, compressed)]).ends_with("publishes it as sensor_msgs/msg/CompressedImage"));
        assert!(outage(&[(Dds, peers(1, &[("/image", IMAGE)]))]).contains("quality of service"));
        assert!(outage(&[(Zenoh, peers(1, &[("/image", IMAGE)]))]).contains("type hashes differ"));
    }

    #[test]
    fn an_outage_names_the_transport_that_sees_nobody() {
        let none = || peers(0, &[]);
        let line = outage(&[(Zenoh, none())]);
        assert!(line.contains("no peer on rmw_zenoh") && line.contains("does it use DDS (ros2.transport)"), "{line}");
        let line = outage(&[(Dds, none()), (Zenoh, none())]);
        assert!(line.contains("no peer on DDS nor on rmw_zenoh"), "{line}");
        let other = || peers(1, &[("/front/image", IMAGE)]);
        let line = outage(&[(Dds, none()), (Zenoh, other())]);
        assert!(line.contains("1 peer(s) on rmw_zenoh publish /front/image"), "{line}");
        assert!(line.contains("no peer on DDS: is the domain"), "{line}");
        let line = outage(&[(Dds, other()), (Zenoh, none())]);
        assert!(line.contains("1 peer(s) on DDS publish /front/image"), "{line}");
        assert!(line.contains("no peer on rmw_zenoh: is the domain (ros2.domain) or the router"), "{line}");
    }

    #[test]
    fn an_outage_is_reported_once_and_again_after_it_ended() {
        let none = [(Dds, peers(0, &[])), (Zenoh, peers(0, &[]))];
        let mut wanted = wanted();
        let at = |wanted: &Wanted, s| wanted.since + Duration::from_secs(s);
        let (t10, t11, t20, t21) = (at(&wanted, 10), at(&wanted, 11), at(&wanted, 20), at(&wanted, 21));
        let (nobody, one) = ([(Dds, 0), (Zenoh, 0)], [(Dds, 0), (Zenoh, 1)]);
        assert!(wanted.handle(&nobody, &none, t10).is_some());
        assert_eq!(wanted.handle(&nobody, &none, t11), None);
        assert_eq!(wanted.handle(&one, &none, t11).unwrap(), "/image: publishers: 1 on rmw_zenoh");
        assert_eq!(wanted.handle(&nobody, &none, t11), None);
        assert_eq!(wanted.handle(&nobody, &none, t20), None);
        assert!(wanted.handle(&nobody, &none, t21).is_some());
    }

    #[test]
    fn a_missing_router_is_reported_once_after_a_while() {
        let start = Instant::now();
        let after = |s| start + Duration::from_secs(s);
        let mut router = Router { endpoint: "tcp/localhost:7447".to_owned(), since: start, reported: None };
        assert_eq!(router.handle(false, after(9)), None);
        assert!(router.handle(false, after(10)).unwrap().contains("rmw_zenohd"));
        assert_eq!(router.handle(false, after(11)), None);
        assert!(router.handle(true, after(12)).unwrap().starts_with("connected"));
        assert_eq!(router.handle(true, after(30)), None);
        assert_eq!(router.handle(false, after(31)), None, "it may come back soon");
        assert!(router.handle(false, after(40)).is_some());
    }

    #[test]
    fn diagnostics_name_the_transport_that_sees_peers() {
        let peers = |participants| Peers { participants, ..Peers::default() };
        let both = [(Transport::Dds, peers(0)), (Transport::Zenoh, peers(2))];
        let seen = health(&both, Some(true));
        assert_eq!((seen.level, seen.message.as_str()), (DiagnosticStatus::OK, "peers: 0 on DDS, 2 on rmw_zenoh"));
        assert!(seen.values.contains(&("zenoh_peers", "2".to_owned())));
        assert_eq!(health(&both, Some(false)).level, DiagnosticStatus::WARN);
        assert_eq!(health(&both[..1], None).message, "peers: 0 on DDS");
    }
}
