//! Received burst data, and the airtime that the modem reports for its own.

use super::config::{BURST_FRAME_BYTES, BURST_OVERHEAD_BITS};
use crate::modem::framing::Deframer;
use scenecast_core::ModemAddress;
use scenecast_protocol::time::Instant;
use std::collections::BTreeMap;
use std::time::Duration;

/// Modems whose streams are kept.
const MAX_STREAMS: usize = 16;
/// Share of a burst's raw bits that carries data.
const DATA_SHARE: f64 = 0.9;
/// After burst data of a modem, the connection carries a piggyback to it for this long.
const RIDE: Duration = Duration::from_secs(15);

/// The framed streams of the other modems.
#[derive(Debug, Default)]
pub(super) struct BurstStreams {
    streams: BTreeMap<ModemAddress, Deframer>,
    received_at: BTreeMap<ModemAddress, Instant>,
}

impl BurstStreams {
    pub(super) fn clear(&mut self) {
        self.streams.clear();
    }

    pub(super) fn note(&mut self, src: ModemAddress, now: Instant) {
        self.received_at.insert(src, now);
    }

    /// Whether the modem will soon send something to this one anyway.
    pub(super) fn carries_piggyback_to(&self, dst: ModemAddress, now: Instant) -> bool {
        self.received_at.get(&dst).is_some_and(|&at| now.since(at) < RIDE)
    }

    /// The frames that end in a piece of a stream.
    pub(super) fn push(&mut self, src: Option<ModemAddress>, bytes: &[u8]) -> Vec<Vec<u8>> {
        let key = src.unwrap_or(0);
        if !self.streams.contains_key(&key) && self.streams.len() >= MAX_STREAMS {
            self.streams.clear();
        }
        let deframer = self.streams.entry(key).or_insert_with(|| Deframer::new(BURST_FRAME_BYTES));
        let mut frames = Vec::new();
        deframer.push(bytes, |frame| frames.push(frame));
        frames
    }
}

/// Bits of bursts given to the modem, and bits that it put on air.
#[derive(Debug, Default)]
pub(super) struct BurstAirtime {
    given_bits: u64,
    aired_bits: u64,
    /// Raw bit rate that the modem reports; 0: none yet.
    local_bps: u32,
}

impl BurstAirtime {
    pub(super) fn give(&mut self, bytes: usize) {
        self.given_bits += bytes as u64 * 8 + BURST_OVERHEAD_BITS;
    }

    pub(super) fn set_local_rate(&mut self, bps: u32) {
        self.local_bps = bps;
    }

    /// Data was on air for `us` microseconds; returns the bits beyond those given, which are the modem's own repeats.
    pub(super) fn air(&mut self, us: u32, burst_bps: f64) -> Option<u64> {
        let rate = if self.local_bps > 0 { f64::from(self.local_bps) * DATA_SHARE } else { burst_bps };
        self.aired_bits += (f64::from(us) * rate / 1e6) as u64;
        let more = self.aired_bits.checked_sub(self.given_bits).filter(|&more| more > 0)?;
        self.given_bits = self.aired_bits;
        Some(more)
    }
}
