//! What waits to be put on air, one at a time, and what is told to the host about it.

use super::frame::{Frame, Kind, Network};
use super::{Event, S2c};
use crate::Duration;
use crate::modem::Transmission;
use std::collections::VecDeque;

/// A frame that waits for the transducer.
#[derive(Clone, Debug)]
pub(super) struct Outgoing {
    pub frame: Frame,
    pub airtime: Duration,
    /// The type that `SENDSTART` and `SENDEND` tell.
    pub label: &'static str,
    /// What to do when it has been sent.
    pub then: After,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum After {
    Nothing,
    /// The instant message of that number has been sent.
    Instant(u8),
    /// The train or probe of that turn has been sent.
    Train(u64),
    /// An acknowledgement that ends that turn has been sent.
    Acknowledged(u64),
    /// A connection request of that epoch has been sent.
    Request(u32),
    /// The connection is over.
    Closed,
}

/// The transducer.
#[derive(Debug, Default)]
pub(super) struct Air {
    pub queue: VecDeque<Outgoing>,
    pub busy_until: Duration,
}

impl S2c {
    /// The properties that decide who hears this modem.
    pub(super) fn network(&self) -> Network {
        Network {
            highest: self.settings.byte("AM"),
            carrier: self.settings.byte("C"),
            packet_ms: u16::try_from(self.settings.get("ZP")).unwrap_or(u16::MAX),
        }
    }

    /// A frame to `dst` without payload.
    pub(super) fn frame(&self, kind: Kind, dst: u8) -> Frame {
        Frame {
            kind,
            src: self.address(),
            dst,
            network: self.network(),
            pid: 0,
            tag: 0,
            follow: 0,
            seq: 0,
            held: 0,
            piggyback: None,
            payload: Vec::new(),
        }
    }

    /// The frame with the piggyback message that waits for its destination, if there is one.
    pub(super) fn with_piggyback(&mut self, mut frame: Frame) -> Frame {
        if let Some(waiting) = self.piggyback.take_if(|waiting| waiting.dst == frame.dst) {
            frame.piggyback = Some((waiting.pid, waiting.data));
        }
        frame
    }

    pub(super) fn send(&mut self, frame: Frame, airtime: Duration, label: &'static str, then: After) {
        self.air.queue.push_back(Outgoing { frame, airtime, label, then });
    }

    /// The next frame, if the transducer is free and the modem awake.
    pub(super) fn begin_transmission(&mut self, now: Duration) -> Option<Transmission> {
        if now < self.air.busy_until || self.booting {
            return None;
        }
        let out = self.air.queue.pop_front()?;
        self.air.busy_until = now + out.airtime;
        let us = out.airtime.as_micros();
        self.notify_extended(format!("SENDSTART,{},{},{us},0", out.frame.dst, out.label), now);
        let bytes = out.frame.encode();
        let airtime = out.airtime;
        self.board
            .plan(self.air.busy_until, Event::Sent { dst: out.frame.dst, label: out.label, airtime, then: out.then });
        Some(Transmission { bytes, airtime })
    }

    /// A frame has left.
    pub(super) fn on_sent(&mut self, dst: u8, label: &str, airtime: Duration, then: After, now: Duration) {
        let clock = self.clock_us(now);
        self.notify_extended(format!("SENDEND,{dst},{label},{clock},{}", airtime.as_micros()), now);
        match then {
            After::Nothing => {}
            After::Instant(number) => self.on_instant_sent(number, now),
            After::Train(turn) => self.on_train_sent(turn, now),
            After::Acknowledged(turn) => self.on_acknowledgement_sent(turn, now),
            After::Request(epoch) => self.on_request_sent(epoch, now),
            After::Closed => self.on_closed(now),
        }
    }
}
