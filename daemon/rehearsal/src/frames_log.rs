//! The log of a mission's frames, one line a frame.

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
