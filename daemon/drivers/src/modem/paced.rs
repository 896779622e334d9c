//! A modem without reports: frames in a byte stream or in datagrams, at the pace of the channel.
//!
//! Kinds `transparent`, `tcp` and `udp`. These modems do not report the end of a transmission, so the driver computes
//! it from the bit rate.

use super::driver::{Class, Destination, Driver, Event, Reception, Refusal, Token, check_length};
use super::framing::{Deframer, encode};
use scenecast_protocol::mac::ModemProfile;
use scenecast_protocol::time::Instant;
use std::collections::VecDeque;
use std::time::Duration;

/// The longest frame that another end may be set to. Frames longer than ours are handed up all the same: the link names the
/// difference, which would otherwise look like a channel that loses half of the frames.
const MAX_FRAME_BYTES: usize = 1024;

#[derive(Debug)]
enum Shape {
    Stream(Deframer),
    Datagrams,
}

/// A driver for frames at a known pace.
#[derive(Debug)]
pub struct Paced {
    profile: ModemProfile,
    /// The slowest of the ways to the water: bits a second.
    pace_bps: f64,
    shape: Shape,
    open: bool,
    tokens: Token,
    on_air: VecDeque<(Instant, Token)>,
    output: VecDeque<Vec<u8>>,
    events: VecDeque<Event>,
}

impl Paced {
    /// Frames in a stream of bytes, no faster than `pace_bps`.
    pub fn stream(profile: ModemProfile, pace_bps: f64) -> Self {
        Self::new(profile, pace_bps, Shape::Stream(Deframer::new(MAX_FRAME_BYTES)))
    }

    /// A frame a datagram, no faster than `pace_bps`.
    pub fn datagrams(profile: ModemProfile, pace_bps: f64) -> Self {
        Self::new(profile, pace_bps, Shape::Datagrams)
    }

    fn new(profile: ModemProfile, pace_bps: f64, shape: Shape) -> Self {
        Self {
            profile,
            pace_bps: pace_bps.max(1.0),
            shape,
            open: false,
            tokens: 0,
            on_air: VecDeque::new(),
            output: VecDeque::new(),
            events: VecDeque::new(),
        }
    }

    fn hear(&mut self, bytes: Vec<u8>) {
        if (1..=MAX_FRAME_BYTES).contains(&bytes.len()) {
            let reception = Reception { src: None, bytes: bytes.into(), quality: None, range_m: None };
            self.events.push_back(Event::Received(reception));
        }
    }

    fn forget(&mut self) {
        self.output.clear();
        for (_, token) in std::mem::take(&mut self.on_air) {
            self.events.push_back(Event::Unknown(token));
        }
    }
}

impl Driver for Paced {
    fn profile(&self) -> ModemProfile {
        self.profile
    }

    fn is_ready(&self) -> bool {
        self.open
    }

    fn send(&mut self, _dst: Destination, bytes: Vec<u8>, _class: Class, now: Instant) -> Result<Token, Refusal> {
        check_length(bytes.len(), self.profile.frame_bytes)?;
        if !self.open {
            return Err(Refusal::NotReady);
        }
        self.tokens += 1;
        let begins = self.on_air.back().map_or(now, |&(ends, _)| ends.max(now));
        let seconds = self.profile.bits_on_air(bytes.len()) as f64 / self.pace_bps;
        self.on_air.push_back((begins + Duration::from_secs_f64(seconds), self.tokens));
        self.output.push_back(match self.shape {
            Shape::Stream(_) => encode(&bytes),
            Shape::Datagrams => bytes,
        });
        self.events.push_back(Event::Accepted(self.tokens));
        Ok(self.tokens)
    }

    fn handle_open(&mut self, _now: Instant) {
        self.forget();
        if let Shape::Stream(deframer) = &mut self.shape {
            *deframer = Deframer::new(MAX_FRAME_BYTES);
        }
        self.open = true;
        self.events.push_back(Event::Ready);
    }

    fn handle_closed(&mut self, _now: Instant) {
        self.forget();
        if std::mem::take(&mut self.open) {
            self.events.push_back(Event::Reset);
        }
    }

    fn handle_bytes(&mut self, bytes: &[u8], _now: Instant) {
        let mut frames = Vec::new();
        match &mut self.shape {
            Shape::Stream(deframer) => deframer.push(bytes, |frame| frames.push(frame)),
            Shape::Datagrams => frames.push(bytes.to_vec()),
        }
        frames.into_iter().for_each(|frame| self.hear(frame));
    }

    fn handle_timeout(&mut self, now: Instant) {
        while let Some(&(_, token)) = self.on_air.front().filter(|(ends, _)| *ends <= now) {
            self.on_air.pop_front();
            self.events.push_back(Event::Sent(token));
        }
    }

    fn poll_timeout(&self) -> Option<Instant> {
        self.on_air.front().map(|&(ends, _)| ends)
    }

    fn poll_output(&mut self, _now: Instant) -> Option<Vec<u8>> {
        self.output.pop_front()
    }

    fn poll_event(&mut self) -> Option<Event> {
        self.events.pop_front()
    }
}
