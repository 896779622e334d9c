//! What comes out of the water, and what the host is told of it.

use super::air::{After, Outgoing};
use super::config::Interpreter;
use super::frame::{Frame, Kind};
use super::send_command::Flag;
use super::{Event, Physical, S2c, timing};
use crate::{Arrival, Duration, LossReason, Onset, Outcome, Position};

/// Bit of an instant message's number that says that it opens a turn.
const IN_TURN: u32 = 0x100;

/// How a frame was heard.
#[derive(Clone, Copy, Debug)]
pub(super) struct Signal {
    pub airtime: Duration,
    pub heard_at: Duration,
    pub travel: Duration,
    pub rssi: i32,
    pub integrity: i32,
    pub sender: Position,
    pub receiver: Position,
}

/// Relative velocity in m/s: tracks are not differentiated.
pub(super) const VELOCITY: &str = "0.0000";

/// The last signal meant for this modem, as `?E`, `?I`, `?V` and `?T` tell it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct LastHeard {
    pub rssi: i32,
    pub integrity: i32,
    /// Of the last exchange in both directions, us; 0 if there was none.
    pub travel_us: u64,
}

impl Signal {
    fn of(arrival: &Arrival) -> Self {
        let flight = arrival.at.saturating_sub(arrival.sent_at).saturating_sub(arrival.airtime);
        // 20 dB down at 10 m, then 15 log10 of the range; -85 dB is as weak as it gets.
        let rssi = -20.0 - 15.0 * (arrival.range_m.max(10.0) / 10.0).log10();
        let rssi = rssi.max(-85.0) as i32;
        Self {
            airtime: arrival.airtime,
            heard_at: arrival.at,
            travel: flight,
            rssi,
            integrity: 230 + rssi,
            sender: arrival.sender,
            receiver: arrival.receiver,
        }
    }
}

impl S2c {
    /// The beginning of a signal; one of another network is not noticed.
    pub(super) fn hear_beginning(&mut self, onset: &Onset, now: Duration) {
        let foreign = Frame::decode(&onset.bytes).is_some_and(|frame| !self.network().hears(&frame.network));
        if !self.booting && self.physical == Physical::Listen && !foreign {
            self.tell_start(onset.transmission, now);
        }
    }

    /// `RECVSTART`, once for a transmission.
    fn tell_start(&mut self, transmission: u64, now: Duration) {
        if self.begun.insert(transmission) {
            self.notify_extended("RECVSTART", now);
        }
    }

    /// The end of a reception at this modem.
    pub(super) fn hear(&mut self, arrival: &Arrival, now: Duration) {
        if !self.booting && self.physical == Physical::Listen {
            self.hear_end(arrival, now);
        }
        self.begun.remove(&arrival.transmission);
    }

    fn hear_end(&mut self, arrival: &Arrival, now: Duration) {
        let signal = Signal::of(arrival);
        match &arrival.outcome {
            Outcome::Lost { reason: LossReason::Noise | LossReason::Collision, .. } => {
                self.tell_failure(arrival.transmission, &signal, now);
            }
            Outcome::Lost { .. } => {}
            Outcome::Delivered { bytes, .. } => match Frame::decode(bytes) {
                None => self.tell_failure(arrival.transmission, &signal, now),
                Some(frame) if !self.network().hears(&frame.network) => {}
                Some(frame) => {
                    self.tell_end(arrival.transmission, &signal, now);
                    self.board.plan(now + timing::PROCESSING, Event::Heard(Box::new((frame, signal))));
                }
            },
        }
    }

    fn tell_failure(&mut self, transmission: u64, signal: &Signal, now: Duration) {
        self.tell_start(transmission, now);
        self.notify_extended(format!("RECVFAILED,{VELOCITY},{},{}", signal.rssi, signal.integrity / 3), now);
    }

    fn tell_end(&mut self, transmission: u64, signal: &Signal, now: Duration) {
        let clock = self.clock_us(signal.heard_at.saturating_sub(signal.airtime));
        self.tell_start(transmission, now);
        let us = signal.airtime.as_micros();
        self.notify_extended(format!("RECVEND,{clock},{us},{},{}", signal.rssi, signal.integrity), now);
    }

    /// A frame has been decoded.
    pub(super) fn on_heard(&mut self, frame: Frame, signal: &Signal, now: Duration) {
        if frame.dst != self.address() {
            self.on_overheard(&frame, signal, now);
            return;
        }
        (self.last.rssi, self.last.integrity) = (signal.rssi, signal.integrity);
        match frame.kind {
            Kind::Instant => self.on_instant(&frame, signal, now),
            Kind::InstantAck => {
                self.note_exchange(signal);
                if self.on_instant_ack(frame.src, frame.tag, now) {
                    self.measure(frame.src, signal, now);
                }
            }
            Kind::Synchronous => self.tell_synchronous(&frame, signal, now),
            Kind::Request => self.on_request(&frame, signal, now),
            Kind::Answer => {
                self.note_exchange(signal);
                self.on_answer(&frame, signal, now);
            }
            Kind::Packet => self.on_packet(&frame, signal, now),
            Kind::Turn => {
                self.note_exchange(signal);
                self.on_peer_turn(&frame, signal, now);
                self.measure(frame.src, signal, now);
            }
            Kind::Close => self.on_close(&frame, now),
        }
        if let Some((pid, data)) = &frame.piggyback {
            self.tell_piggyback(frame.src, *pid, data, signal, now);
        }
    }

    /// A frame for somebody else: messages to everybody, or to anybody in promiscuous mode; connections mean back-off.
    fn on_overheard(&mut self, frame: &Frame, signal: &Signal, now: Duration) {
        let wanted = frame.dst == 255 || self.settings.get("RP") == 1;
        match frame.kind {
            Kind::Instant if wanted => self.tell_instant(frame, signal, now),
            Kind::Synchronous if wanted => self.tell_synchronous(frame, signal, now),
            Kind::Request | Kind::Answer | Kind::Packet | Kind::Turn => {
                let rest = self.packet_time(frame.follow) + Duration::from_secs(3);
                self.burst.backoff_until = self.burst.backoff_until.max(now + rest);
            }
            Kind::Close => self.burst.backoff_until = now,
            _ => {}
        }
    }

    fn note_exchange(&mut self, signal: &Signal) {
        self.last.travel_us = signal.travel.as_micros() as u64;
    }

    fn on_instant(&mut self, frame: &Frame, signal: &Signal, now: Duration) {
        self.tell_instant(frame, signal, now);
        if Flag::ALL.get(usize::from(frame.tag)) != Some(&Flag::Ack) {
            return;
        }
        let mut ack = self.frame(Kind::InstantAck, frame.src);
        ack.tag = frame.seq as u8;
        let ack = self.with_piggyback(ack);
        let out = Outgoing { frame: ack, airtime: timing::ACK, label: "ack", then: After::Nothing };
        if frame.seq & IN_TURN == 0 || !self.connected_to(frame.src) {
            self.air.queue.push_front(out);
        } else {
            self.defer(out);
            self.guard_turn(self.packet_time(frame.follow) + Duration::from_secs(1), now);
        }
    }

    /// `RECVIM`
    fn tell_instant(&mut self, frame: &Frame, signal: &Signal, now: Duration) {
        let flag = Flag::ALL.get(usize::from(frame.tag)).map_or("noack", |flag| flag.name());
        let between = format!("{flag},{}", signal.airtime.as_micros());
        self.tell_message("RECVIM", frame, &between, signal, now);
    }

    /// `RECVIMS`
    fn tell_synchronous(&mut self, frame: &Frame, signal: &Signal, now: Duration) {
        let clock = self.clock_us(signal.heard_at.saturating_sub(signal.airtime));
        let between = format!("{clock},{}", signal.airtime.as_micros());
        self.tell_message("RECVIMS", frame, &between, signal, now);
    }

    fn tell_message(&mut self, keyword: &str, frame: &Frame, between: &str, signal: &Signal, now: Duration) {
        let len = self.length_field(frame.pid, frame.payload.len());
        let head = format!(
            "{keyword},{len},{},{},{between},{},{},{VELOCITY},",
            frame.src, frame.dst, signal.rssi, signal.integrity
        );
        self.notify([head.as_bytes(), &frame.payload].concat(), now);
    }

    /// `RECVPBM`
    fn tell_piggyback(&mut self, src: u8, pid: u8, data: &[u8], signal: &Signal, now: Duration) {
        let len = self.length_field(pid, data.len());
        let us = signal.airtime.as_micros();
        let own = self.address();
        let head = format!("RECVPBM,{len},{src},{own},{us},{},{},{VELOCITY},", signal.rssi, signal.integrity);
        self.notify([head.as_bytes(), data].concat(), now);
    }

    /// `RECV`, or raw bytes on a port of the AT interpreter.
    pub(super) fn deliver_record(&mut self, src: u8, pid: u8, data: &[u8], signal: &Signal, now: Duration) {
        if self.config.interpreter == Interpreter::At {
            self.board.tell_all(data, now);
            return;
        }
        let len = self.length_field(pid, data.len());
        let (own, rate, travel) = (self.address(), self.config.bit_rate, signal.travel.as_micros());
        let head = format!("RECV,{len},{src},{own},{rate},{},{},{travel},{VELOCITY},", signal.rssi, signal.integrity);
        self.notify([head.as_bytes(), data].concat(), now);
    }

    /// The length, after the protocol id in extended networking.
    fn length_field(&self, pid: u8, len: usize) -> String {
        if self.options.networking { format!("p{pid},{len}") } else { len.to_string() }
    }
}
