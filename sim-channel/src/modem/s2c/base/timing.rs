//! Durations on air.

use std::time::Duration;

/// Time from the end of a signal to its content, and from there to the beginning of a reply.
pub(crate) const PROCESSING: Duration = Duration::from_millis(90);
/// Airtime of an acknowledgement of an instant message or of a train.
pub(crate) const ACK: Duration = Duration::from_millis(139);
/// Airtime of a connection request, a grant or a disconnection.
pub(crate) const HEADER: Duration = Duration::from_millis(250);
/// Time from the end of a signal to the next turn of a connection.
pub(crate) const TURN_AROUND: Duration = Duration::from_millis(130);

/// Airtime of an instant message of `bytes`: 161 ms + 10.9 ms a byte.
///
/// Source: a fit to the table of measured durations shipped with a fielded driver.
pub(crate) fn instant(bytes: usize) -> Duration {
    Duration::from_micros(161_000 + 10_900 * bytes as u64)
}

/// Payload of one data packet: nine tenths of the raw bits, at least one byte.
pub(crate) fn packet_capacity(bit_rate: u32, packet_ms: u32) -> usize {
    let raw_bits = u64::from(bit_rate) * u64::from(packet_ms) / 1000;
    usize::try_from(raw_bits * 9 / 80).unwrap_or(usize::MAX).max(1)
}

/// Airtime of a data packet that carries `bytes` of its `capacity`; at least 50 ms.
pub(crate) fn packet(bytes: usize, capacity: usize, packet_ms: u32) -> Duration {
    let full = Duration::from_millis(u64::from(packet_ms));
    full.mul_f64((bytes as f64 / capacity as f64).min(1.0)).max(Duration::from_millis(50))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn instant_airtime_matches_the_measured_table() {
        // Bytes and milliseconds of the measured table.
        for (bytes, ms) in [(1, 172), (8, 238), (20, 369), (32, 500), (48, 688), (64, 860)] {
            assert!(instant(bytes).as_millis().abs_diff(ms) <= 12, "{bytes}");
        }
    }

    #[test]
    fn a_full_train_carries_about_eleven_kilobytes() {
        let train = 10 * packet_capacity(13_000, 750);
        assert!((10_500..11_500).contains(&train), "{train}");
    }
}
