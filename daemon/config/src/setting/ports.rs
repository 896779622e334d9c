//! Ports of instruments, as in `serial:DEVICE:BAUD`, and network addresses.

use super::{Setting, different, read_different};
use crate::rule::Rule;
use scenecast_core::gps::GpsLanguage;
use scenecast_core::{PortAddress, SerialLine};
use serde_json::json;
use std::fmt;
use std::path::PathBuf;
use toml::Value;

/// Speeds of serial devices, bit/s.
const BAUD: std::ops::RangeInclusive<u32> = 300..=4_000_000;

/// A host or address with a port, as in `127.0.0.1:8460`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct HostPort(String);

impl HostPort {
    /// The text with a colon between host and port; port 0 is any free port to listen on.
    pub fn parse(text: &str) -> Option<Self> {
        let (host, port) = text.rsplit_once(':')?;
        let is_port = !port.is_empty() && port.bytes().all(|b| b.is_ascii_digit()) && port.parse::<u16>().is_ok();
        (!host.is_empty() && is_port).then(|| Self(text.to_owned()))
    }

    /// The text, as system calls take it.
    pub fn as_str(&self) -> &str {
        &self.0
    }

    fn has_port(&self) -> bool {
        !self.0.ends_with(":0")
    }
}

impl fmt::Display for HostPort {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// The origin of a page (RFC 6454), as in `https://survey.example.org:8443`.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct PageOrigin(String);

impl PageOrigin {
    /// A text of `https://`, a host, and a port where it is not 443; no path. Origins without encryption are not taken.
    pub fn parse(text: &str) -> Option<Self> {
        let (host, port) = Self::split(text)?;
        let is_allowed = |b: u8| b.is_ascii_alphanumeric() || b".-:[]".contains(&b);
        let is_port = |port: &str| port.parse::<u16>().is_ok_and(|port| port > 0);
        let is_host = !host.is_empty() && host.len() <= 255 && host.bytes().all(is_allowed);
        (is_host && port.is_none_or(is_port)).then(|| Self(text.to_owned()))
    }

    fn split(text: &str) -> Option<(&str, Option<&str>)> {
        let place = text.strip_prefix("https://")?;
        // The colons of an IPv6 address stand in brackets.
        Some(match place.rsplit_once(':') {
            Some((host, port)) if !port.contains(']') => (host, Some(port)),
            _ => (place, None),
        })
    }

    /// The text as browsers send it: without the usual port.
    pub fn as_str(&self) -> &str {
        self.0.strip_suffix(":443").unwrap_or(&self.0)
    }
}

impl Setting for Vec<PageOrigin> {
    fn read(value: &Value, _: &Rule) -> Option<Self> {
        read_different(value, |v| PageOrigin::parse(v.as_str()?))
    }

    fn write(&self) -> Value {
        Value::Array(self.iter().map(|origin| Value::String(origin.0.clone())).collect())
    }

    fn allowed(_: &Rule) -> String {
        "a list of \"https://HOST\" or \"https://HOST:PORT\"".to_owned()
    }

    fn schema(_: &Rule) -> serde_json::Value {
        different(json!({ "type": "string", "pattern": r"^https://[A-Za-z0-9.:\[\]-]+$" }))
    }
}

/// Reads a text of which the empty one stands for none.
fn read_or_none<T>(value: &Value, parse: impl Fn(&str) -> Option<T>) -> Option<Option<T>> {
    match value.as_str()? {
        "" => Some(None),
        text => parse(text).map(Some),
    }
}

impl Setting for Option<HostPort> {
    fn read(value: &Value, _: &Rule) -> Option<Self> {
        read_or_none(value, HostPort::parse)
    }

    fn write(&self) -> Value {
        Value::String(self.as_ref().map(HostPort::to_string).unwrap_or_default())
    }

    fn allowed(_: &Rule) -> String {
        "\"HOST:PORT\", or \"\"".to_owned()
    }

    fn schema(_: &Rule) -> serde_json::Value {
        json!({ "type": "string", "pattern": "^(.+:[0-9]{1,5})?$" })
    }
}

/// The port of a GPS receiver, and the language on it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GpsPort {
    /// Where the receiver or the gpsd is.
    pub address: PortAddress,
    /// NMEA 0183, or gpsd's JSON.
    pub language: GpsLanguage,
}

fn parse_gps(text: &str, kinds: &[&str]) -> Option<GpsPort> {
    let language = if text.starts_with("gpsd:") { GpsLanguage::Gpsd } else { GpsLanguage::Nmea };
    parse(text, kinds).map(|address| GpsPort { address, language })
}

fn parse(text: &str, kinds: &[&str]) -> Option<PortAddress> {
    let (kind, rest) = text.split_once(':').filter(|(kind, rest)| kinds.contains(kind) && !rest.is_empty())?;
    let host_port = || HostPort::parse(rest).filter(HostPort::has_port).map(|address| address.0);
    Some(match kind {
        "serial" => {
            let (device, baud) = rest.rsplit_once(':')?;
            let baud = baud.parse().ok().filter(|b| BAUD.contains(b))?;
            PortAddress::Serial(device.to_owned(), SerialLine::of_speed(baud))
        }
        "udp" => PortAddress::Datagrams(host_port()?, String::new()),
        "udp-to" => PortAddress::Datagrams(String::new(), host_port()?),
        "file" => PortAddress::File(PathBuf::from(rest)),
        _ => PortAddress::Connect(host_port()?),
    })
}

fn form(kind: &str) -> String {
    match kind {
        "serial" => "serial:DEVICE:BAUD".to_owned(),
        "file" => "file:PATH".to_owned(),
        "udp" => "udp:ADDRESS:PORT".to_owned(),
        kind => format!("{kind}:HOST:PORT"),
    }
}

fn allowed(rule: &Rule) -> String {
    let forms: Vec<String> = rule.ports.iter().map(|kind| form(kind)).collect();
    format!("{}, or \"\"", forms.join(", "))
}

fn schema(rule: &Rule) -> serde_json::Value {
    json!({ "type": "string", "pattern": format!("^(({}):.+)?$", rule.ports.join("|")) })
}

/// The text of a port that was read with the prefix `connect` for connections.
fn text(address: &PortAddress, connect: &str) -> String {
    match address {
        PortAddress::Serial(device, line) => format!("serial:{device}:{}", line.baud),
        PortAddress::Listen(address) | PortAddress::Connect(address) => format!("{connect}:{address}"),
        PortAddress::Datagrams(own, remote) if remote.is_empty() => format!("udp:{own}"),
        PortAddress::Datagrams(_, remote) => format!("udp-to:{remote}"),
        PortAddress::File(path) => format!("file:{}", path.display()),
    }
}

impl Setting for Option<PortAddress> {
    fn read(value: &Value, rule: &Rule) -> Option<Self> {
        read_or_none(value, |text| parse(text, rule.ports))
    }

    fn write(&self) -> Value {
        Value::String(self.as_ref().map(|port| text(port, "tcp")).unwrap_or_default())
    }

    fn allowed(rule: &Rule) -> String {
        allowed(rule)
    }

    fn schema(rule: &Rule) -> serde_json::Value {
        schema(rule)
    }
}

impl Setting for Option<GpsPort> {
    fn read(value: &Value, rule: &Rule) -> Option<Self> {
        read_or_none(value, |text| parse_gps(text, rule.ports))
    }

    fn write(&self) -> Value {
        let connect = |port: &GpsPort| if port.language == GpsLanguage::Gpsd { "gpsd" } else { "tcp" };
        Value::String(self.as_ref().map(|port| text(&port.address, connect(port))).unwrap_or_default())
    }

    fn allowed(rule: &Rule) -> String {
        allowed(rule)
    }

    fn schema(rule: &Rule) -> serde_json::Value {
        schema(rule)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ports_are_read_and_wrong_ones_refused() {
        let kinds = ["serial", "tcp", "gpsd"];
        let read = |text| parse(text, &kinds);
        assert_eq!(
            read("serial:/dev/ttyUSB0:4800").unwrap(),
            PortAddress::Serial("/dev/ttyUSB0".to_owned(), SerialLine::of_speed(4800))
        );
        assert_eq!(read("gpsd:localhost:2947").unwrap(), PortAddress::Connect("localhost:2947".to_owned()));
        for wrong in ["", "gpsd", "tcp:", "tcp:host", "tcp:host:99999", "serial:/dev/x", "serial:/dev/x:1", "udp:a:1"] {
            assert_eq!(read(wrong), None, "{wrong}");
        }
        let refused = crate::load(None, &["position.gps=tcp:host".to_owned()]).unwrap_err().to_string();
        assert!(refused.contains("position.gps") && refused.contains("serial:DEVICE:BAUD, tcp:HOST:PORT"), "{refused}");
    }

    #[test]
    fn a_host_without_port_is_refused() {
        for wrong in ["localhost", ":8460", "host:", "host:65536", "host:+1"] {
            assert_eq!(HostPort::parse(wrong), None, "{wrong}");
        }
        assert_eq!(HostPort::parse("[::1]:8460").unwrap().as_str(), "[::1]:8460");
        assert!(HostPort::parse("127.0.0.1:0").is_some());
    }

    #[test]
    fn a_port_is_written_as_it_was_read() {
        let rule = crate::rule::ports(&["serial", "udp", "udp-to", "tcp", "gpsd", "file"]);
        for text in ["serial:/dev/x:9600", "udp:0.0.0.0:1", "udp-to:host:2", "tcp:host:3", "file:a/b", "gpsd:h:4", ""] {
            let value = Value::String(text.to_owned());
            assert_eq!(Option::<GpsPort>::read(&value, &rule).unwrap().write(), value);
        }
    }
}
