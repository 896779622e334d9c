//! Keys of topics, liveliness tokens of nodes, publishers and subscriptions, and what each sample carries beside its message.
//!
//! ```text
//! topic   <domain>/<topic>/<type>/<type hash>
//! token   @ros2_lv/<domain>/<session>/<node id>/<id>/<kind>/<enclave>/<namespace>/<node>
//!             and, but for nodes, /<topic>/<type>/<type hash>/<quality of service>
//! ```
//!
//! In tokens a `%` stands for each slash of a name, and for an empty one. Source: rmw_zenoh, `docs/design.md`.
//!
//! ```text
//!  0           8           16   17          33
//! +-----------+-----------+----+-----------+
//! | sequence  | time      | 16 | gid       |
//! | i64, from | i64, ns   |    | XXH3-128  |
//! | 1 on      | UTC       |    | of token  |
//! +-----------+-----------+----+-----------+
//! ```
//!
//! Numbers are little-endian. Source: rmw_zenoh, `docs/design.md` and `attachment_helpers.cpp`.

use crate::transport::Qos;

/// The first chunk of tokens.
const SPACE: &str = "@ros2_lv";
/// Stands for the type hash in Humble, which has none.
pub(super) const NO_HASH: &str = "TypeHashNotSupported";
/// Characters of a token at most: names of ROS 2 have at most 255.
const MAX_TOKEN: usize = 2048;

/// What a token announces. Services are not followed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Node,
    Publisher,
    Subscription,
}

impl Kind {
    fn chunk(self) -> &'static str {
        match self {
            Self::Node => "NN",
            Self::Publisher => "MP",
            Self::Subscription => "MS",
        }
    }
}

/// The topic of a publisher or a subscription.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Endpoint {
    /// Name in ROS 2, such as `/camera/image_raw`.
    pub topic: String,
    /// Name of the type on DDS, such as `sensor_msgs::msg::dds_::Image_`.
    pub dds_type: String,
    /// Such as `RIHS01_d31d...`, or [`NO_HASH`].
    pub hash: String,
}

impl Endpoint {
    /// The key of its samples, whose type hash is `hash`, or any if that is `*`.
    pub fn key(&self, domain: u8, hash: &str) -> String {
        format!("{domain}/{}/{}/{hash}", self.topic.trim_start_matches('/'), self.dds_type)
    }
}

/// The key of all tokens of a domain.
pub(super) fn all_tokens(domain: u8) -> String {
    format!("{SPACE}/{domain}/**")
}

/// Makes the tokens of one node.
#[derive(Debug)]
pub(super) struct TokenMaker {
    pub domain: u8,
    /// The id of the session, in hexadecimal digits.
    pub session: String,
    pub node: String,
}

impl TokenMaker {
    /// The token of the node, which is the first of its session.
    pub fn node(&self) -> String {
        self.begin(0, Kind::Node)
    }

    /// The token of an endpoint whose `id` is new in the session.
    pub fn endpoint(&self, id: u32, kind: Kind, endpoint: &Endpoint, qos: Qos) -> String {
        let Endpoint { topic, dds_type, hash } = endpoint;
        let topic = topic.replace('/', "%");
        format!("{}/{topic}/{dds_type}/{hash}/{}", self.begin(id, kind), qos_chunk(qos))
    }

    fn begin(&self, id: u32, kind: Kind) -> String {
        let Self { domain, session, node } = self;
        format!("{SPACE}/{domain}/{session}/0/{id}/{}/%/%/{node}", kind.chunk())
    }
}

/// `reliability:durability:history,depth:deadline:lifespan:liveliness`, by the numbers of `rmw/types.h`; what is the default
/// of rmw_zenoh is left out.
fn qos_chunk(qos: Qos) -> String {
    let (reliability, durability, depth) = match qos {
        Qos::Sensor(depth) => ("2", "", depth),
        Qos::Reliable(depth) => ("", "", depth),
        Qos::Latched(depth) => ("", "1", depth),
    };
    format!("{reliability}:{durability}:,{depth}:,:,:,,")
}

/// A token of a node, a publisher or a subscription.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Token {
    pub session: String,
    pub kind: Kind,
    /// Topic and type; `None` for a node.
    pub endpoint: Option<Endpoint>,
}

impl Token {
    /// `None` for a key that is none of these tokens.
    pub fn parse(key: &str) -> Option<Self> {
        let mut chunks = Some(key).filter(|key| key.len() <= MAX_TOKEN)?.split('/');
        let mut next = || chunks.next().filter(|chunk| !chunk.is_empty());
        if next()? != SPACE {
            return None;
        }
        let (_domain, session, _node_id, _id, kind) = (next()?, next()?, next()?, next()?, next()?);
        let kind = [Kind::Node, Kind::Publisher, Kind::Subscription].into_iter().find(|k| k.chunk() == kind)?;
        let (_enclave, _namespace, _node) = (next()?, next()?, next()?);
        let endpoint = match kind {
            Kind::Node => None,
            _ => {
                let (topic, dds_type, hash, _qos) = (next()?, next()?, next()?, next()?);
                let (topic, dds_type) = (topic.replace('%', "/"), dds_type.to_owned());
                Some(Endpoint { topic, dds_type, hash: hash.to_owned() })
            }
        };
        Some(Self { session: session.to_owned(), kind, endpoint })
    }
}

const BYTES: usize = 33;

/// By which peers tell the publishers of a topic apart.
pub(super) type Gid = [u8; 16];

/// The gid of the publisher with this liveliness token.
pub(super) fn gid(token: &str) -> Gid {
    twox_hash::XxHash3_128::oneshot(token.as_bytes()).to_le_bytes()
}

/// `sequence` counts the samples of the publisher from 1 on.
pub(super) fn attachment(sequence: i64, nanos: i64, gid: &Gid) -> [u8; BYTES] {
    let mut bytes = [0; BYTES];
    bytes[..8].copy_from_slice(&sequence.to_le_bytes());
    bytes[8..16].copy_from_slice(&nanos.to_le_bytes());
    bytes[16] = gid.len() as u8;
    bytes[17..].copy_from_slice(gid);
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    const HASH: &str = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18";

    fn chatter() -> Endpoint {
        let dds_type = "std_msgs::msg::dds_::String_".to_owned();
        Endpoint { topic: "/chatter".to_owned(), dds_type, hash: HASH.to_owned() }
    }

    #[test]
    fn keys_and_tokens_are_those_of_the_document() {
        // The examples of rmw_zenoh's docs/design.md.
        assert_eq!(chatter().key(0, HASH), format!("0/chatter/std_msgs::msg::dds_::String_/{HASH}"));
        let session = "aac3178e146ba6f1fc6e6a4085e77f21".to_owned();
        let listener = TokenMaker { domain: 0, session, node: "listener".to_owned() };
        assert_eq!(listener.node(), "@ros2_lv/0/aac3178e146ba6f1fc6e6a4085e77f21/0/0/NN/%/%/listener");
        let session = "8b20917502ee955ac4476e0266340d5c".to_owned();
        let talker = TokenMaker { domain: 0, session, node: "talker".to_owned() };
        let expected = format!(
            "@ros2_lv/0/8b20917502ee955ac4476e0266340d5c/0/10/MP/%/%/talker/%chatter/std_msgs::msg::dds_::String_/{HASH}/::,7:,:,:,,"
        );
        assert_eq!(talker.endpoint(10, Kind::Publisher, &chatter(), Qos::Reliable(7)), expected);
        assert_eq!(qos_chunk(Qos::Sensor(5)), "2::,5:,:,:,,");
        assert_eq!(qos_chunk(Qos::Latched(1)), ":1:,1:,:,:,,");
    }

    #[test]
    fn tokens_of_peers_are_read() {
        let maker = TokenMaker { domain: 7, session: "ab1".to_owned(), node: "camera".to_owned() };
        let own = maker.endpoint(3, Kind::Subscription, &chatter(), Qos::Latched(1));
        let token = Token::parse(&own).unwrap();
        assert_eq!((token.session.as_str(), token.kind, token.endpoint), ("ab1", Kind::Subscription, Some(chatter())));
        // Later versions append a chunk for some types.
        assert_eq!(Token::parse(&format!("{own}/cpu")).unwrap().endpoint, Some(chatter()));
        let nested = "@ros2_lv/0/ab1/0/4/MP/%/%robot/camera/%robot%image/sensor_msgs::msg::dds_::Image_/TypeHashNotSupported/2::,5:,:,:,,";
        let endpoint = Token::parse(nested).unwrap().endpoint.unwrap();
        assert_eq!((endpoint.topic.as_str(), endpoint.hash.as_str()), ("/robot/image", NO_HASH));
        for other in ["@ros2_lv/0/ab1/0/4/SS/%/%/n/%s/t/h/q", "@ros2_lv/0/ab1/0/4/MP/%/%/n/%t", "@ros2_lv", "", "a/b"] {
            assert_eq!(Token::parse(other), None, "{other}");
        }
        assert_eq!(Token::parse(&format!("{own}{}", "x".repeat(MAX_TOKEN))), None);
    }

    #[test]
    fn attachments_have_thirty_three_known_bytes() {
        let bytes = attachment(1, 0x0102_0304_0506_0708, &[0xab; 16]);
        let expected = [[1, 0, 0, 0, 0, 0, 0, 0], [8, 7, 6, 5, 4, 3, 2, 1]].concat();
        assert_eq!(bytes[..16], expected);
        assert_eq!((bytes[16], &bytes[17..]), (16, [0xab; 16].as_slice()));
    }

    #[test]
    fn a_gid_is_the_hash_of_the_token() {
        // As the package xxhash of PyPI computes it.
        let token = concat!(
            "@ros2_lv/0/8b20917502ee955ac4476e0266340d5c/0/10/MP/%/%/talker/%chatter/std_msgs::msg::dds_::String_/",
            "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18/::,7:,:,:,,"
        );
        let expected = 0x62d0_0a89_0145_8a44_dc46_783b_88fa_85eb_u128;
        assert_eq!(u128::from_le_bytes(gid(token)), expected);
    }
}
