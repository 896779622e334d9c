//! Packets that wait for the transducer, and the signals of those received.

use super::packet::{FSK_MINI, PSK_MINI, Packet, PacketKind};
use crate::channel::Arrival;
use std::collections::VecDeque;
use std::time::Duration;

const MAX_QUEUED_PACKETS: usize = 8;

#[derive(Clone, Debug)]
pub(crate) struct QueuedPacket {
    pub packet: Packet,
    pub airtime: Duration,
    /// Bytes in `CATXP`: whole frames, however full they are.
    pub bytes: usize,
    /// 1 FSK, 2 FSK mini, 3 PSK, 4 PSK mini, 5 flexible.
    pub packet_type: u8,
    /// Frames that the cycle init requested.
    pub expected: u8,
    /// False for replies that the modem sends by itself: the host gets no report of them.
    pub reported: bool,
    /// Whether the modem requests data from the host after this packet.
    pub then_request_data: bool,
}

impl QueuedPacket {
    /// A minipacket by order of the host.
    pub(super) fn mini(packet: Packet) -> Self {
        let bytes = packet.bytes();
        Self { packet, airtime: FSK_MINI, bytes, packet_type: 2, expected: 0, reported: true, then_request_data: false }
    }

    /// A reply that the modem sends by itself.
    pub(super) fn reply(packet: Packet) -> Self {
        let airtime = if packet.kind == PacketKind::Ack && packet.rate > 0 { PSK_MINI } else { FSK_MINI };
        let packet_type = if packet.is_psk() { 4 } else { 2 };
        Self { airtime, packet_type, reported: false, ..Self::mini(packet) }
    }
}

/// A packet that has left.
#[derive(Clone, Debug)]
pub(crate) struct SentPacket {
    pub out: QueuedPacket,
    pub began: Duration,
}

#[derive(Debug, Default)]
pub(super) struct Transmitter {
    queue: VecDeque<QueuedPacket>,
    busy_until: Duration,
    /// Number of the last packet; continues over restarts.
    last_number: u8,
}

impl Transmitter {
    pub(super) fn push(&mut self, out: QueuedPacket) {
        self.queue.push_back(out);
    }

    pub(super) fn is_full(&self) -> bool {
        self.queue.len() >= MAX_QUEUED_PACKETS
    }

    pub(super) fn is_busy(&self, now: Duration) -> bool {
        now < self.busy_until
    }

    pub(super) fn next_number(&self) -> u8 {
        self.last_number.wrapping_add(1)
    }

    /// Numbers the next packet and occupies the transducer for its airtime; `None` while it is occupied.
    pub(super) fn begin(&mut self, now: Duration) -> Option<QueuedPacket> {
        if self.is_busy(now) {
            return None;
        }
        let mut out = self.queue.pop_front()?;
        self.last_number = self.next_number();
        out.packet.number = self.last_number;
        self.busy_until = now + out.airtime;
        Some(out)
    }

    pub(super) fn clear(&mut self) {
        self.queue.clear();
        self.busy_until = Duration::ZERO;
    }
}

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
