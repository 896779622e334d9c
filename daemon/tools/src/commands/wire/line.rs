//! One frame as a line of text, or as JSON.

use super::capture::Captured;
use super::fields::{self, Fields, text_of};
use scenecast_protocol::mac::Wish;
use scenecast_protocol::wire::{Address, Chunk, Chunks, Envelope, FrameError, Header, Listener, Stamp, WIRE_VERSION};
use serde_json::{Value, json};
use std::fmt;

/// What a frame says, in fields.
#[derive(Debug)]
pub(super) struct FrameLine<'a> {
    number: usize,
    time_s: Option<f64>,
    bytes: &'a [u8],
    /// Or why there is none.
    content: Result<Content, LineFault>,
}

/// Why the bytes of a line are not shown as a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
enum LineFault {
    #[error("the capture has only the beginning of it")]
    Cut,
    #[error(transparent)]
    Frame(#[from] FrameError),
}

#[derive(Debug)]
struct Content {
    from: Address,
    to: Address,
    header: Fields,
    chunks: Vec<(&'static str, Fields, Vec<u8>)>,
    keyed: bool,
    check: Check,
}

/// Whether the CRC or tag of a frame is right.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Check {
    Right,
    Wrong,
    /// The mission, the key or the runs of both ends are not known.
    Unknown,
}

impl<'a> FrameLine<'a> {
    /// `time_s` counts from the first frame.
    pub(super) fn of(number: usize, time_s: Option<f64>, frame: &'a Captured, listener: Option<&mut Listener>) -> Self {
        let bytes = &frame.bytes[..];
        let content = match frame.is_cut {
            true => Err(LineFault::Cut),
            false => Content::read(bytes, listener).map_err(LineFault::Frame),
        };
        Self { number, time_s, bytes, content }
    }

    pub(super) fn to_json(&self) -> Value {
        let mut line = json!({ "frame": self.number, "time_s": self.time_s, "bytes": fields::hex(self.bytes) });
        match &self.content {
            Err(fault) => line["error"] = fault.to_string().into(),
            Ok(content) => {
                line["from"] = content.from.number().into();
                line["to"] = content.to.number().into();
                line["check"] = content.check_name().into();
                content.header.iter().for_each(|(name, value)| line[*name] = value.clone());
                let chunk = |(kind, fields, payload): &(&'static str, Fields, Vec<u8>)| {
                    let mut chunk = json!({ "kind": kind, "payload": fields::hex(payload) });
                    fields.iter().for_each(|(name, value)| chunk[*name] = value.clone());
                    chunk
                };
                line["chunks"] = content.chunks.iter().map(chunk).collect();
            }
        }
        line
    }
}

impl fmt::Display for FrameLine<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:5}", self.number)?;
        if let Some(time_s) = self.time_s {
            write!(f, " {time_s:10.3} s")?;
        }
        write!(f, " {:4} B  ", self.bytes.len())?;
        let content = match &self.content {
            Ok(content) => content,
            Err(error) => return write!(f, "{error}"),
        };
        write!(f, "{} > {}, {}", named(content.from), named(content.to), content.check_name())?;
        for (name, value) in &content.header {
            write!(f, ", {name} {}", text_of(value))?;
        }
        for (kind, fields, _) in &content.chunks {
            let fields: Vec<String> = fields.iter().map(|(name, value)| format!("{name} {}", text_of(value))).collect();
            write!(f, "; {kind}{}{}", if fields.is_empty() { "" } else { ": " }, fields.join(", "))?;
        }
        Ok(())
    }
}

fn named(address: Address) -> String {
    match address {
        Address::SURFACE => "surface".to_owned(),
        Address::EVERYBODY => "everybody".to_owned(),
        vehicle => format!("vehicle {}", vehicle.number()),
    }
}

impl Content {
    fn read(bytes: &[u8], listener: Option<&mut Listener>) -> Result<Self, FrameError> {
        let Some(listener) = listener else {
            return Envelope::decode(bytes, |_| true).map(|envelope| Self::unverified(&envelope, Check::Unknown));
        };
        let heard = listener.hear(bytes)?;
        Ok(match &heard.frame {
            Some(frame) => Self::of(&heard.envelope, Some(frame.number), frame.chunks(), Check::Right),
            None if heard.could_verify => Self::unverified(&heard.envelope, Check::Wrong),
            None => Self::unverified(&heard.envelope, Check::Unknown),
        })
    }

    fn check_name(&self) -> &'static str {
        match (self.check, self.keyed) {
            (Check::Right, false) => "CRC right",
            (Check::Right, true) => "tag right",
            (Check::Wrong, false) => "CRC wrong",
            (Check::Wrong, true) => "tag wrong",
            (Check::Unknown, _) => "unchecked",
        }
    }

    /// The chunks of a numbered frame with a tag may be encrypted, so they are left out.
    fn unverified(envelope: &Envelope<'_>, check: Check) -> Self {
        let may_be_encrypted = envelope.header.keyed && envelope.header.session.is_none();
        let chunks = if may_be_encrypted { Chunks::default() } else { envelope.unverified_chunks() };
        Self::of(envelope, None, chunks, check)
    }

    /// `number` is the whole number of a verified frame.
    fn of(envelope: &Envelope<'_>, number: Option<u64>, chunks: Chunks<'_>, check: Check) -> Self {
        let Header { from, to, keyed, .. } = envelope.header;
        let mut header = header_fields(&envelope.header, number);
        if envelope.version != WIRE_VERSION {
            header.push(("version", envelope.version.into()));
        }
        if !chunks.are_sound() {
            header.push(("error", "a chunk ends after the frame".into()));
        }
        let read = |chunk: Chunk<'_>| (fields::kind(chunk.kind), fields::of(&chunk), chunk.payload.to_vec());
        Self { from, to, header, chunks: chunks.map(read).collect(), keyed, check }
    }
}

fn header_fields(header: &Header, number: Option<u64>) -> Fields {
    let mut fields = Fields::new();
    match header.session {
        Some(session) => fields.push(("hello", format!("{:04x}", session.get()).into())),
        None => {
            fields.push(("number", number.unwrap_or(header.number.into()).into()));
            fields.push(("base", header.base.into()));
        }
    }
    if header.keyed {
        fields.push(("keyed", true.into()));
    }
    fields.extend(header.nonce.map(|nonce| ("nonce", format!("{nonce:016x}").into())));
    if header.remaining > 0 {
        fields.push(("remaining", header.remaining.into()));
    }
    fields.extend(header.turn.map(|turn| match (header.from.is_vehicle(), turn) {
        (true, turn) => ("turn_s", Wish::of_bits(turn).wait().as_secs_f64().into()),
        (false, turn) => ("turn_s", (f64::from(turn) / 4.0).into()),
    }));
    match header.stamp {
        None => {}
        Some(Stamp::Surface { clock_ms, one_way }) => {
            let one_way_s = one_way.map_or(Value::Null, |time| time.as_secs_f64().into());
            fields.extend([("clock_ms", clock_ms.into()), ("one_way_s", one_way_s)]);
        }
        Some(Stamp::Vehicle { clock_ms, last_received, held }) => fields.extend([
            ("clock_ms", clock_ms.into()),
            ("last_received", last_received.into()),
            ("held_s", held.as_secs_f64().into()),
        ]),
    }
    if let Some(ack) = &header.ack {
        fields.extend([("ack", ack.horizon.low().into()), ("ack_bits", ack.horizon.bits().into())]);
        if !ack.lost.is_empty() {
            fields.push(("lost_before", ack.lost.clone().into()));
        }
    }
    fields
}
