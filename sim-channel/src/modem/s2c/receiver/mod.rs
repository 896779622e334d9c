//! ReceptionLog: the notifications of each signal, the last signal received, and positions from the USBL head.

pub(crate) mod notices;
mod usbl;

pub(crate) use usbl::UsblReporter;

use super::base::{ReceivedSignal, S2cBase, S2cFrame, S2cTask, VELOCITY, timing};
use crate::channel::{Arrival, LossReason, Onset, ReceptionOutcome};
use std::collections::BTreeSet;
use std::time::Duration;

/// The last signal addressed to this modem, as `?E`, `?I` and `?T` report it.
#[derive(Clone, Copy, Debug, Default)]
struct LastSignal {
    rssi: i32,
    integrity: i32,
    /// Travel time of the last exchange in both directions, us; 0 if there was none.
    travel_us: u64,
}

#[derive(Debug, Default)]
pub(crate) struct ReceptionLog {
    /// Transmissions whose `RECVSTART` has been sent.
    begun: BTreeSet<u64>,
    last: LastSignal,
}

impl ReceptionLog {
    /// The beginning of a signal; one of another network is not noticed.
    pub(crate) fn on_onset(&mut self, base: &mut S2cBase, onset: &Onset, now: Duration) {
        let foreign = S2cFrame::decode(&onset.bytes).is_some_and(|frame| !base.network().receives(&frame.network));
        if base.condition.receives() && !foreign {
            self.report_start(base, onset.transmission, now);
        }
    }

    /// The end of a signal; a frame that was received is handed over after its decoding time.
    pub(crate) fn on_arrival(&mut self, base: &mut S2cBase, arrival: &Arrival, now: Duration) {
        if base.condition.receives() {
            self.on_end(base, arrival, now);
        }
        self.begun.remove(&arrival.transmission);
    }

    fn on_end(&mut self, base: &mut S2cBase, arrival: &Arrival, now: Duration) {
        let signal = ReceivedSignal::of(arrival);
        let bytes = match &arrival.outcome {
            ReceptionOutcome::Lost { reason: LossReason::Noise | LossReason::Collision, .. } => {
                return self.report_failure(base, arrival.transmission, &signal, now);
            }
            ReceptionOutcome::Lost { .. } => return,
            ReceptionOutcome::Delivered { bytes, .. } => bytes,
        };
        match S2cFrame::decode(bytes) {
            None => self.report_failure(base, arrival.transmission, &signal, now),
            Some(frame) if !base.network().receives(&frame.network) => {}
            Some(frame) => {
                self.report_end(base, arrival.transmission, &signal, now);
                base.board.schedule(now + timing::PROCESSING, S2cTask::Received(Box::new((frame, signal))));
            }
        }
    }

    /// `RECVSTART`, once for each transmission.
    fn report_start(&mut self, base: &mut S2cBase, transmission: u64, now: Duration) {
        if self.begun.insert(transmission) {
            base.notify_extended("RECVSTART", now);
        }
    }

    fn report_failure(&mut self, base: &mut S2cBase, transmission: u64, signal: &ReceivedSignal, now: Duration) {
        self.report_start(base, transmission, now);
        base.notify_extended(format!("RECVFAILED,{VELOCITY},{},{}", signal.rssi, signal.integrity / 3), now);
    }

    fn report_end(&mut self, base: &mut S2cBase, transmission: u64, signal: &ReceivedSignal, now: Duration) {
        let clock = base.clock_us(signal.received_at.saturating_sub(signal.airtime));
        self.report_start(base, transmission, now);
        let us = signal.airtime.as_micros();
        base.notify_extended(format!("RECVEND,{clock},{us},{},{}", signal.rssi, signal.integrity), now);
    }

    /// Remembers the level of a frame addressed to this modem.
    pub(crate) fn note_level(&mut self, signal: &ReceivedSignal) {
        (self.last.rssi, self.last.integrity) = (signal.rssi, signal.integrity);
    }

    /// Remembers the travel time of a frame that replied to one of ours.
    pub(crate) fn note_exchange(&mut self, signal: &ReceivedSignal) {
        self.last.travel_us = signal.one_way.as_micros() as u64;
    }

    /// The value behind `?` of the last signal.
    pub(crate) fn value(&self, key: &str) -> Option<String> {
        Some(match key {
            "T" => self.last.travel_us.to_string(),
            "E" => self.last.rssi.to_string(),
            "I" => self.last.integrity.to_string(),
            "V" => VELOCITY.to_string(),
            _ => return None,
        })
    }

    /// `AT?P`: eight paths of the last reception, delay in us and strength; LF only, 96 bytes.
    pub(crate) fn multipath(&self) -> String {
        let strength = u32::try_from(self.last.integrity).unwrap_or_default();
        (0..8u32).map(|path| format!("{:<6} {:<4}\n", path * 470, strength >> path)).collect()
    }
}
