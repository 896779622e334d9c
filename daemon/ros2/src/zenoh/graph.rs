//! Sessions as the default settings of rmw_zenoh open them, and the nodes, publishers and subscriptions of others, by their
//! liveliness.

use super::keys::{Endpoint, Kind, NO_HASH, Token};
use crate::dds::ros_type;
use crate::transport::{OwnId, OwnIds, Peers, locked};
use scenecast_config::Ros2;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Mutex;
use zenoh::{Config, Session, Wait};

/// Tokens that are kept at most; a large robot has some hundred.
const MAX_TOKENS: usize = 20_000;

/// The sessions of this process.
static OWN: OwnIds<String> = OwnIds::new();

/// What the tokens of a domain say, without those of this session.
pub(super) struct Graph {
    own_session: String,
    tokens: Mutex<BTreeMap<String, Token>>,
    _own: OwnId<String>,
}

impl Graph {
    pub fn new(own_session: String) -> Self {
        let own = OWN.add(own_session.clone());
        Self { own_session, tokens: Mutex::default(), _own: own }
    }

    /// A token appeared; those of this session are left out.
    pub fn insert(&self, key: &str) {
        let Some(token) = Token::parse(key).filter(|token| token.session != self.own_session) else { return };
        let mut tokens = locked(&self.tokens);
        if tokens.len() < MAX_TOKENS {
            tokens.insert(key.to_owned(), token);
        }
    }

    /// A token disappeared, and what it stands for is forgotten.
    pub fn remove(&self, key: &str) {
        locked(&self.tokens).remove(key);
    }

    /// The sessions of other processes.
    pub fn peers(&self) -> Peers {
        let (tokens, own) = (locked(&self.tokens), OWN.all());
        let others = || tokens.values().filter(|token| !own.contains(&token.session));
        let sessions: BTreeSet<&str> = others().map(|token| token.session.as_str()).collect();
        let publishers = others().filter(|token| token.kind == Kind::Publisher);
        let publishers = publishers.filter_map(|token| token.endpoint.as_ref());
        let publishers = publishers.map(|endpoint| (endpoint.topic.clone(), ros_type(&endpoint.dds_type)));
        Peers { participants: sessions.len(), publishers: publishers.collect() }
    }

    /// The endpoints of this kind at the same topic, with the same type and definition or without a type hash.
    pub fn count(&self, kind: Kind, at: &Endpoint) -> usize {
        self.matching(kind, at, &[&at.hash, NO_HASH])
    }

    /// Those of them that have no type hash.
    pub fn count_without_hash(&self, kind: Kind, at: &Endpoint) -> usize {
        self.matching(kind, at, &[NO_HASH])
    }

    fn matching(&self, kind: Kind, at: &Endpoint, hashes: &[&str]) -> usize {
        let tokens = locked(&self.tokens);
        let endpoints = tokens.values().filter(|token| token.kind == kind).filter_map(|token| token.endpoint.as_ref());
        let same = |other: &&Endpoint| other.topic == at.topic && other.dds_type == at.dds_type;
        endpoints.filter(same).filter(|other| hashes.contains(&other.hash.as_str())).count()
    }
}

/// Bytes of a received message at most: an image of 20 megapixels.
const MAX_MESSAGE: usize = 64 << 20;

/// A session that connects to the router in the background, and again whenever the connection ends.
pub(super) fn open_session(settings: &Ros2) -> zenoh::Result<Session> {
    let router = format!("[\"{}\"]", settings.zenoh_router);
    let max_message = MAX_MESSAGE.to_string();
    let mut config = Config::default();
    for (key, value) in [
        ("mode", r#""peer""#),
        ("connect/endpoints", &router),
        ("connect/timeout_ms", "-1"),
        ("connect/exit_on_failure", "false"),
        // Peers on this machine send their samples without the router.
        ("listen/endpoints", r#"["tcp/localhost:0"]"#),
        ("open/return_conditions/connect_scouted", "false"),
        ("scouting/multicast/enabled", "false"),
        ("scouting/gossip/target", r#"{ router: ["router", "peer"], peer: ["router"] }"#),
        ("scouting/gossip/autoconnect_strategy", r#"{ peer: { to_router: "always", to_peer: "greater-zid" } }"#),
        // Samples that are kept for later subscribers are told apart by their times.
        ("timestamping/enabled", "true"),
        ("transport/link/rx/max_message_size", &max_message),
    ] {
        config.insert_json5(key, value)?;
    }
    zenoh::open(config).wait()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn token(session: &str, id: u32, kind: &str, topic: &str, hash: &str) -> String {
        format!("@ros2_lv/0/{session}/0/{id}/{kind}/%/%/node/{topic}/sensor_msgs::msg::dds_::Image_/{hash}/::,5:,:,:,,")
    }

    fn endpoint(topic: &str) -> Endpoint {
        let dds_type = "sensor_msgs::msg::dds_::Image_".to_owned();
        Endpoint { topic: topic.to_owned(), dds_type, hash: "RIHS01_a".to_owned() }
    }

    #[test]
    fn the_graph_has_the_publishers_of_other_sessions() {
        let graph = Graph::new("own".to_owned());
        let tokens = [
            token("own", 1, "MP", "%image", "RIHS01_a"),
            token("b", 1, "MP", "%image", "RIHS01_a"),
            token("b", 2, "MP", "%front%image", "RIHS01_a"),
            token("c", 1, "MS", "%image", NO_HASH),
            "@ros2_lv/0/c/0/0/NN/%/%/node".to_owned(),
        ];
        tokens.iter().for_each(|token| graph.insert(token));
        let second_of_this_process = Graph::new("d".to_owned());
        graph.insert(&token("d", 1, "MP", "%map", "RIHS01_a"));
        let peers = graph.peers();
        assert_eq!(peers.participants, 2);
        assert_eq!(graph.count(Kind::Publisher, &endpoint("/map")), 1, "it is no peer, but a publisher");
        drop(second_of_this_process);
        assert_eq!(graph.peers().participants, 3);
        graph.remove(&token("d", 1, "MP", "%map", "RIHS01_a"));
        let image = "sensor_msgs/msg/Image";
        let expected = ["/front/image", "/image"].map(|topic| (topic.to_owned(), image.to_owned()));
        assert_eq!(peers.publishers.into_iter().collect::<Vec<_>>(), expected);
        tokens.iter().for_each(|token| graph.remove(token));
        assert_eq!(graph.peers(), Peers::default());
    }

    #[test]
    fn publishers_of_another_definition_do_not_count() {
        let graph = Graph::new("own".to_owned());
        for (id, hash) in [(1, "RIHS01_a"), (2, "RIHS01_b"), (3, NO_HASH)] {
            graph.insert(&token("b", id, "MP", "%image", hash));
        }
        assert_eq!(graph.count(Kind::Publisher, &endpoint("/image")), 2);
        assert_eq!(graph.count_without_hash(Kind::Publisher, &endpoint("/image")), 1);
        assert_eq!(graph.count(Kind::Publisher, &endpoint("/other")), 0);
        assert_eq!(graph.count(Kind::Subscription, &endpoint("/image")), 0);
    }

    #[test]
    fn the_graph_is_bounded() {
        let graph = Graph::new("own".to_owned());
        (0..MAX_TOKENS as u32 + 5).for_each(|id| graph.insert(&token("b", id, "MP", "%image", "RIHS01_a")));
        assert_eq!(graph.count(Kind::Publisher, &endpoint("/image")), MAX_TOKENS);
    }
}
