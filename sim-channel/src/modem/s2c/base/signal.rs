//! Measurements of a received frame.

use crate::channel::Arrival;
use crate::nodes::NodePosition;
use crate::usbl::UsblFix;
use std::time::Duration;

/// Relative velocity in m/s: the emulator does not differentiate tracks.
pub(crate) const VELOCITY: &str = "0.0000";

/// How a frame was received.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ReceivedSignal {
    pub airtime: Duration,
    pub received_at: Duration,
    pub one_way: Duration,
    /// Received level, dB; -20 within 10 m, -85 at the least.
    pub rssi: i32,
    pub integrity: i32,
    pub sender: NodePosition,
    pub receiver: NodePosition,
}

impl ReceivedSignal {
    pub(crate) fn of(arrival: &Arrival) -> Self {
        let flight = arrival.at.saturating_sub(arrival.sent_at).saturating_sub(arrival.airtime);
        let rssi = -20.0 - 15.0 * (arrival.range_m.max(10.0) / 10.0).log10();
        let rssi = rssi.max(-85.0) as i32;
        Self {
            airtime: arrival.airtime,
            received_at: arrival.at,
            one_way: flight,
            rssi,
            integrity: 230 + rssi,
            sender: arrival.sender,
            receiver: arrival.receiver,
        }
    }
}

/// A USBL fix that the head is still computing.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PendingFix {
    pub remote: u8,
    pub fix: UsblFix,
    pub travel: Duration,
    pub rssi: i32,
    pub integrity: i32,
}
