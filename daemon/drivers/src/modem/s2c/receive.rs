//! Handling of the lines of an S2C modem, and its received burst data.

use super::dialogue::Pending;
use super::notice::{Heard, Notice, Place, Position, Service};
use super::setup::{BURST_FRAME_BYTES, BURST_OVERHEAD_BITS};
use super::{EVERYBODY, Line, Phase, S2c};
use crate::modem::driver::{Event, Reception};
use crate::modem::framing::Deframer;
use bytes::Bytes;
use scenecast_core::{ModemAddress, UsblLine};
use scenecast_protocol::time::Instant;
use std::collections::BTreeMap;
use std::time::Duration;

/// Speed of sound in m/s, for positions that carry only a travel time.
const SOUND_SPEED_M_S: f64 = 1500.0;
/// An accuracy of so much of the range means that only the range is good.
const RANGE_ONLY: f64 = 0.8;

impl S2c {
    pub(super) fn is_at_work(&self) -> bool {
        self.phase == Phase::Ready
    }

    pub(super) fn handle_line(&mut self, line: Line, now: Instant) {
        match line {
            Line::Reply(name, text) => self.handle_reply(name.as_deref(), &text, now),
            Line::Notice(notice) => {
                self.supervision.note_reply(now);
                self.handle_notice(notice, now);
            }
            // A port of the AT interpreter does not say whose data it is.
            Line::Raw(bytes) => self.handle_stream(None, &bytes, None, None, now),
        }
    }

    fn handle_reply(&mut self, name: Option<&str>, text: &str, now: Instant) {
        // A reply that nobody waits for is one that came too late.
        let Some(pending) = self.dialogue.take_answered_by(name) else { return };
        self.supervision.note_reply(now);
        match &pending {
            Pending::Interpreter | Pending::Mode => self.handle_interpreter(&pending, text, now),
            Pending::Setup(step) | Pending::Beat(step) => self.handle_step(step, text, now),
            _ => self.handle_send_reply(pending, text, now),
        }
    }

    fn handle_notice(&mut self, notice: Notice, now: Instant) {
        match notice {
            Notice::Heard(heard) => self.handle_heard(heard, now),
            Notice::InstantDone { delivered, .. } => self.handle_message_done(delivered),
            Notice::InstantCanceled => self.handle_message_done(false),
            Notice::BurstDone { delivered, count } => {
                if let Some((token, _)) = self.jobs.pool.remove(&count) {
                    self.events.push_back(if delivered { Event::Delivered(token) } else { Event::Failed(token) });
                }
            }
            Notice::SendEnd(kind, us) => match kind.as_str() {
                "im" => self.handle_message_sent(),
                "data" => self.handle_aired(us),
                _ => {}
            },
            Notice::LocalRate(bps) => self.airtime.set_local_rate(bps),
            Notice::Usbl(position) => self.handle_position(&position),
            Notice::Dropped | Notice::Other => {}
        }
    }

    /// Data was on air for `us` microseconds; bits beyond those given are the modem's own repeats.
    fn handle_aired(&mut self, us: u32) {
        self.events.extend(self.airtime.air(us, self.config.burst_bps).map(Event::Repeated));
    }

    fn handle_heard(&mut self, heard: Heard, now: Instant) {
        if heard.src == self.config.address {
            let ours = self.config.address;
            return self.refuse(format!("another modem in the water has our address {ours}"));
        }
        if heard.dst != self.config.address && heard.dst != EVERYBODY {
            return;
        }
        heard.travel_us.into_iter().for_each(|us| self.supervision.handle_travel(us));
        let range_m = heard.travel_us.map(|us| f64::from(us) * 1e-6 * SOUND_SPEED_M_S);
        let quality = Some(heard.integrity);
        match heard.service {
            Service::Burst => {
                self.streams.note(heard.src, now);
                self.handle_stream(Some(heard.src), &heard.data, quality, range_m, now);
            }
            Service::Message => self.receive(Some(heard.src), heard.data, quality, range_m),
        }
    }

    fn receive(&mut self, src: Option<ModemAddress>, bytes: Vec<u8>, quality: Option<i32>, range_m: Option<f64>) {
        let reception = Reception { src, bytes: Bytes::from(bytes), quality, range_m };
        self.events.push_back(Event::Received(reception));
    }

    /// A piece of a framed stream.
    fn handle_stream(
        &mut self,
        src: Option<ModemAddress>,
        bytes: &[u8],
        quality: Option<i32>,
        range_m: Option<f64>,
        _now: Instant,
    ) {
        for frame in self.streams.push(src, bytes) {
            self.receive(src, frame, quality, range_m);
        }
    }

    fn handle_position(&mut self, position: &Position) {
        if position.accuracy < 0.0 {
            return;
        }
        let (range_m, direction_rad) = match position.place {
            Place::Enu([east, north, up], travel_us) => {
                let range = f64::from(travel_us) * 1e-6 * SOUND_SPEED_M_S;
                let direction = (east.atan2(north), up.atan2(east.hypot(north)));
                (Some(range), (position.accuracy < RANGE_ONLY * range).then_some(direction))
            }
            Place::Angles(bearing, elevation) => (None, Some((bearing, elevation))),
        };
        let accuracy = position.accuracy;
        let line =
            UsblLine { remote: position.remote, range_m, direction_rad, accuracy, age_s: position.age_s.max(0.0) };
        self.events.push_back(Event::Usbl(line));
    }
}

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
