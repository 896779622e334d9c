//! Names and networks of ROS 2.

use super::{Setting, different, read_different};
use crate::rule::Rule;
use serde_json::json;
use std::fmt;
use std::net::IpAddr;
use toml::Value;

/// Characters in a name of ROS 2 at most. DDS allows 255 with its own prefixes.
const MAX_NAME: usize = 200;

/// A name of ROS 2 from the root on, as in `/scenecast/map`: parts of letters, digits and underscores.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct RosName(String);

impl RosName {
    pub fn parse(text: &str) -> Option<Self> {
        let is_part = |part: &str| {
            let is_allowed = |b: u8| b.is_ascii_alphanumeric() || b == b'_';
            part.bytes().all(is_allowed) && part.bytes().next().is_some_and(|b| !b.is_ascii_digit())
        };
        let parts = text.strip_prefix('/').filter(|_| text.len() <= MAX_NAME)?;
        parts.split('/').all(is_part).then(|| Self(text.to_owned()))
    }

    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl fmt::Display for RosName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl Setting for RosName {
    fn read(value: &Value, _: &Rule) -> Option<Self> {
        Self::parse(value.as_str()?)
    }

    fn write(&self) -> Value {
        Value::String(self.0.clone())
    }

    fn allowed(_: &Rule) -> String {
        "a name of ROS 2 such as \"/scenecast\"".to_owned()
    }

    fn schema(_: &Rule) -> serde_json::Value {
        json!({ "type": "string", "pattern": "^(/[A-Za-z_][A-Za-z0-9_]*)+$", "maxLength": MAX_NAME })
    }
}

/// Another name for a topic.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Remap {
    pub from: RosName,
    pub to: RosName,
}

impl Remap {
    fn parse(text: &str) -> Option<Self> {
        let (from, to) = text.split_once(":=")?;
        Some(Self { from: RosName::parse(from)?, to: RosName::parse(to)? })
    }
}

impl Setting for Vec<Remap> {
    fn read(value: &Value, _: &Rule) -> Option<Self> {
        read_different(value, |v| Remap::parse(v.as_str()?))
    }

    fn write(&self) -> Value {
        Value::Array(self.iter().map(|Remap { from, to }| Value::String(format!("{from}:={to}"))).collect())
    }

    fn allowed(_: &Rule) -> String {
        "a list of \"/NAME:=/OTHER\"".to_owned()
    }

    fn schema(_: &Rule) -> serde_json::Value {
        different(json!({ "type": "string", "pattern": "^/[A-Za-z0-9_/]+:=/[A-Za-z0-9_/]+$" }))
    }
}

/// The endpoint of a router of Zenoh, such as `tcp/localhost:7447`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ZenohEndpoint(String);

impl ZenohEndpoint {
    pub fn parse(text: &str) -> Option<Self> {
        let (host, port) = text.strip_prefix("tcp/")?.rsplit_once(':')?;
        // Other characters have a meaning in endpoints.
        let is_allowed = |b: u8| b.is_ascii_alphanumeric() || b".-_:[]".contains(&b);
        let is_host = !host.is_empty() && host.len() <= MAX_NAME && host.bytes().all(is_allowed);
        let is_port = port.parse::<u16>().is_ok_and(|port| port > 0);
        (is_host && is_port).then(|| Self(text.to_owned()))
    }
}

impl fmt::Display for ZenohEndpoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl Setting for ZenohEndpoint {
    fn read(value: &Value, _: &Rule) -> Option<Self> {
        Self::parse(value.as_str()?)
    }

    fn write(&self) -> Value {
        Value::String(self.0.clone())
    }

    fn allowed(_: &Rule) -> String {
        "\"tcp/HOST:PORT\"".to_owned()
    }

    fn schema(_: &Rule) -> serde_json::Value {
        json!({ "type": "string", "pattern": r"^tcp/[A-Za-z0-9._:\[\]-]+:[0-9]+$" })
    }
}

impl Setting for Vec<IpAddr> {
    fn read(value: &Value, _: &Rule) -> Option<Self> {
        read_different(value, |v| v.as_str()?.parse().ok())
    }

    fn write(&self) -> Value {
        Value::Array(self.iter().map(|address| Value::String(address.to_string())).collect())
    }

    fn allowed(_: &Rule) -> String {
        "a list of IP addresses in quotes".to_owned()
    }

    fn schema(_: &Rule) -> serde_json::Value {
        different(json!({ "type": "string" }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_ros_are_absolute_and_have_few_characters() {
        let is_name = |text: &str| RosName::parse(text).is_some();
        assert!(is_name("/scenecast") && is_name("/scenecast/auv_1/map"));
        assert!(!is_name("") && !is_name("/") && !is_name("map") && !is_name("/a//b") && !is_name("/a/"));
        assert!(!is_name("/1a") && !is_name("/a-b") && !is_name("/é") && !is_name(&format!("/{}", "a".repeat(200))));
        let remap = Remap::parse("/scenecast/map:=/map").unwrap();
        assert_eq!((remap.from.as_str(), remap.to.as_str()), ("/scenecast/map", "/map"));
        assert!(Remap::parse("/a=/b").is_none() && Remap::parse("/a:=b").is_none());
    }

    #[test]
    fn an_endpoint_of_zenoh_is_a_host_and_a_port() {
        let is_endpoint = |text: &str| ZenohEndpoint::parse(text).is_some();
        assert!(is_endpoint("tcp/localhost:7447") && is_endpoint("tcp/192.168.2.2:7447") && is_endpoint("tcp/[::1]:1"));
        assert!(!is_endpoint("localhost:7447") && !is_endpoint("udp/a:7447") && !is_endpoint("tcp/a"));
        assert!(!is_endpoint("tcp/:7447") && !is_endpoint("tcp/a:0") && !is_endpoint("tcp/a#iface=b:1"));
    }
}
