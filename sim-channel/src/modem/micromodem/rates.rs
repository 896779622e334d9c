//! Packets of each rate: number and size of their frames, and their airtime.

use std::time::Duration;

/// Frames and airtime of a packet at one rate, in a band of 5 kHz.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct PacketRate {
    pub number: u8,
    pub max_frames: u8,
    pub frame_bytes: usize,
    /// Airtime of a packet with all its frames, ms.
    full_ms: u64,
}

const fn rate(number: u8, max_frames: u8, frame_bytes: usize, full_ms: u64) -> PacketRate {
    PacketRate { number, max_frames, frame_bytes, full_ms }
}

const RATES: [PacketRate; 7] = [
    rate(0, 1, 32, 3200),
    rate(1, 3, 64, 3100),
    rate(2, 3, 64, 3100),
    rate(3, 2, 256, 3400),
    rate(4, 2, 256, 3150),
    rate(5, 8, 256, 3050),
    rate(6, 6, 32, 3250),
];

/// Probe and header of a PSK packet, ms.
const PSK_START_MS: u64 = 250;
/// A cycle-init, ping or user minipacket, FH-FSK.
pub(super) const FSK_MINI: Duration = Duration::from_millis(900);
/// An acknowledgement after a PSK packet.
pub(super) const PSK_MINI: Duration = Duration::from_millis(500);

impl PacketRate {
    /// `None` for a number above 6.
    pub(super) fn of(number: u8) -> Option<Self> {
        RATES.get(usize::from(number)).copied()
    }

    pub(super) fn is_fsk(&self) -> bool {
        self.number == 0
    }

    /// Airtime of a packet of `frames` frames; a frame takes the same time however full it is.
    pub(super) fn airtime(&self, frames: u8) -> Duration {
        let start = if self.is_fsk() { 0 } else { PSK_START_MS };
        let per_frame = (self.full_ms - start) / u64::from(self.max_frames);
        Duration::from_millis(start + per_frame * u64::from(frames))
    }

    /// Packet type in the statistics: 1 FSK, 3 PSK.
    pub(super) fn packet_type(&self) -> u8 {
        if self.is_fsk() { 1 } else { 3 }
    }
}

/// Bytes that fit into the minipacket of a flexible data packet, at its rates 1, 3 and 5.
pub(super) fn flexible_mini_bytes(rate: u8) -> Option<usize> {
    match rate {
        1 => Some(64),
        3 => Some(60),
        5 => Some(55),
        _ => None,
    }
}

/// Maximal bytes of a flexible data packet beyond its minipacket, and the bytes of each frame there.
pub(super) fn flexible_data(rate: u8) -> (usize, usize) {
    match rate {
        1 => (192, 64),
        3 => (100, 100),
        _ => (2048, 256),
    }
}

/// Airtime of a flexible data packet: start, and minipacket and data in proportion to their length.
pub(super) fn flexible_airtime(rate: u8, mini: usize, data: usize) -> Duration {
    let bits_per_second = match rate {
        1 => 500,
        3 => 1200,
        _ => 5300,
    };
    Duration::from_millis(PSK_START_MS + (mini + data) as u64 * 8000 / bits_per_second)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_those_of_the_table() {
        let frames: Vec<_> =
            (0..7).filter_map(PacketRate::of).map(|rate| (rate.max_frames, rate.frame_bytes)).collect();
        assert_eq!(frames, [(1, 32), (3, 64), (3, 64), (2, 256), (2, 256), (8, 256), (6, 32)]);
        assert_eq!(PacketRate::of(7), None);
    }

    #[test]
    fn full_packets_take_about_three_seconds() {
        for number in 0..7 {
            let rate = PacketRate::of(number).expect("rate");
            assert!((2900..3500).contains(&rate.airtime(rate.max_frames).as_millis()), "{number}");
        }
    }
}
