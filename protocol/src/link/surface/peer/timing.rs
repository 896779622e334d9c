//! The clock of a vehicle, and the times at which frames to it left the modem.

use crate::link::FrameNumber;
use crate::mac::ClockMap;
use crate::time::Instant;
use crate::wire::Stamp;
use std::collections::VecDeque;
use std::time::Duration;

/// Timing of a vehicle as seen by the surface.
#[derive(Debug, Default)]
pub(super) struct VehicleTiming {
    clock: Option<ClockMap>,
    /// When frames left the modem, by number; a stamp of the vehicle refers to one of them.
    sent: VecDeque<(FrameNumber, Instant)>,
}

impl VehicleTiming {
    const MAX_SENT: usize = 64;

    pub(super) fn clock(&self) -> Option<&ClockMap> {
        self.clock.as_ref()
    }

    pub(super) fn handle_sent(&mut self, number: FrameNumber, now: Instant) {
        self.sent.push_back((number, now));
        if self.sent.len() > Self::MAX_SENT {
            self.sent.pop_front();
        }
    }

    /// The two-way propagation time, from a frame that began at `began` and whose stamp names the low byte of our
    /// frame `last_received`, received `held` before.
    pub(super) fn round_trip(&self, last_received: u8, held: Duration, began: Instant) -> Option<Duration> {
        let sent = self.sent.iter().rev().find(|(number, _)| *number as u8 == last_received).map(|(_, at)| *at)?;
        let is_exact = held < Stamp::MAX_HELD;
        (is_exact && sent + held <= began).then(|| began.since(sent).saturating_sub(held))
    }

    /// Takes the vehicle's clock reading at the start of a transmission that began `ago` before `now`.
    pub(super) fn measure(&mut self, clock_ms: u32, ago: Duration, now: Instant) {
        self.clock.get_or_insert_default().measure(clock_ms, ago, now);
    }
}
