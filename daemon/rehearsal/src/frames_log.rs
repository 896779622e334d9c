//! The log of a mission's frames, one line a frame, and the bytes of the vehicle's transmissions.

use scenecast_protocol::link::{DropReason, LinkStats, PeerView, TransmitKind};
use scenecast_protocol::map::StateReplica;
use scenecast_protocol::schedule::Class;
use serde::Serialize;
use sim_channel::Arrival;
use std::collections::BTreeMap;
use std::fmt::Write;

/// A frame whose outcome is not known yet.
#[derive(Debug, Clone)]
struct Sent {
    at_s: f64,
    direction: &'static str,
    bytes: usize,
    kind: &'static str,
}

impl Sent {
    fn write(&self, fate: &str, text: &mut String) {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{:.3} {} {} {} {fate}", self.at_s, self.direction, self.bytes, self.kind);
    }
}

/// The log of a mission's frames.
///
/// One line a frame, in the order of their outcomes: time of transmission in seconds, `up` or `down`, bytes, kind, and
/// the outcome: `ok`, `lost` with the reason, or `open` for a frame that is still in transit at the end.
#[derive(Debug)]
pub struct FramesLog {
    open: BTreeMap<u64, Sent>,
    text: String,
    /// Number of frames sent, up and down.
    pub sent: [u64; 2],
    /// Number of frames lost in the channel, up and down.
    pub lost: [u64; 2],
    /// The vehicle's frames by their kind.
    pub up: BTreeMap<&'static str, FrameSum>,
}

/// The number of the frames of one kind, and the sum of their bytes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct FrameSum {
    pub frames: u64,
    pub bytes: u64,
}

impl Default for FramesLog {
    fn default() -> Self {
        let text = "# time_s direction bytes kind fate [reason]\n".to_owned();
        Self { open: BTreeMap::new(), text, sent: [0; 2], lost: [0; 2], up: BTreeMap::new() }
    }
}

impl FramesLog {
    /// A frame went on air.
    pub fn handle_sent(&mut self, transmission: u64, up: bool, bytes: usize, kind: &'static str, at_s: f64) {
        let direction = if up { "up" } else { "down" };
        self.sent[usize::from(!up)] += 1;
        if up {
            let sum = self.up.entry(kind).or_default();
            (sum.frames, sum.bytes) = (sum.frames + 1, sum.bytes + bytes as u64);
        }
        self.open.insert(transmission, Sent { at_s, direction, bytes, kind });
    }

    /// The outcome of a frame is known; later copies are not logged again.
    pub fn handle_fate(&mut self, arrival: &Arrival) {
        let Some(sent) = self.open.remove(&arrival.transmission) else { return };
        let fate = match &arrival.outcome {
            sim_channel::ReceptionOutcome::Lost { reason, .. } => {
                self.lost[usize::from(sent.direction == "down")] += 1;
                format!("lost {reason:?}").to_lowercase()
            }
            sim_channel::ReceptionOutcome::Delivered { .. } => "ok".to_owned(),
        };
        sent.write(&fate, &mut self.text);
    }

    /// The log so far; frames in transit are `open`.
    pub fn text(&self) -> String {
        let mut text = self.text.clone();
        for sent in self.open.values() {
            sent.write("open", &mut text);
        }
        text
    }
}

/// Bytes that the vehicle put on air, by use.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Uplink {
    pub map: u64,
    pub status: u64,
    /// Headers, acknowledgement statements and integrity checks.
    pub overhead: u64,
    /// Copies of frames that were sent before.
    pub repeated: u64,
    /// Everything else: layers of the map and exemplars.
    pub other: u64,
}

impl Uplink {
    /// The bytes by the counters of the vehicle's end.
    pub fn of(stats: &LinkStats) -> Self {
        let of = |class| stats.bytes_by_class.get(&class).copied().unwrap_or(0);
        let [map, status, overhead] = [Class::Map, Class::Status, Class::Overhead].map(of);
        let all: u64 = stats.bytes_by_class.values().sum();
        Self { map, status, overhead, repeated: stats.repeated_bytes, other: all - map - status - overhead }
    }

    pub fn all(&self) -> u64 {
        self.map + self.status + self.overhead + self.repeated + self.other
    }

    /// The part of all bytes that is map, 0..=1.
    pub fn map_share(&self) -> f64 {
        self.map as f64 / self.all().max(1) as f64
    }
}

/// Copies of the vehicle's frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Repeats {
    /// Number of copies that the vehicle put on air.
    pub frames: u64,
    /// Number of frames that the surface received although it had them, copies by the channel included.
    pub arrived_twice: u64,
}

impl Repeats {
    /// The copies by the surface's view of the vehicle and by the log of the frames.
    pub fn of<R: StateReplica>(view: Option<PeerView<'_, R>>, frames: &FramesLog) -> Self {
        let twice = view.and_then(|v| v.stats().dropped.get(&DropReason::Duplicate).copied());
        let frames = frames.up.get(TransmitKind::Repeat.name()).map_or(0, |sum| sum.frames);
        Self { frames, arrived_twice: twice.unwrap_or(0) }
    }
}
