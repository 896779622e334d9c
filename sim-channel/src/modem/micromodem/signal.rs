//! Measurements of a received packet.

use crate::channel::Arrival;
use std::time::Duration;

#[derive(Clone, Copy, Debug)]
pub(crate) struct PacketSignal {
    pub began: Duration,
    pub one_way: Duration,
    /// Input signal-to-noise ratio, dB; falls with range.
    pub snr_db: f64,
}

impl PacketSignal {
    pub(super) fn of(arrival: &Arrival) -> Self {
        let began = arrival.at.saturating_sub(arrival.airtime);
        let snr_db = (40.0 - 10.0 * (arrival.range_m.max(10.0) / 10.0).log10()).max(0.0);
        Self { began, one_way: began.saturating_sub(arrival.sent_at), snr_db }
    }
}
