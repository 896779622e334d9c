//! How the vehicle's last camera frames were placed on the map.

use crate::bytes::{Reader, Truncated};

/// What places the last camera frame on the map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum FrameTie {
    /// Odometry and compass alone: its image shows no overlap with an earlier one.
    #[default]
    Odometry,
    /// Its overlap with the frame before.
    FrameBefore,
    /// Its overlap with a frame of an earlier track, which closes a loop.
    EarlierTrack,
    /// Odometry and compass alone: the registration of frames is off.
    Off,
}

impl FrameTie {
    const ALL: [Self; 4] = [Self::Odometry, Self::FrameBefore, Self::EarlierTrack, Self::Off];
}

/// How the last camera frames were placed on the map.
///
/// ```text
/// byte  bits  field                        unit, range
///  0    2     tie of the last frame        0 odometry, 1 frame before, 2 earlier track, 3 registration is off
///  0    6     recent frames that images    1/63 of the last 32 frames, rounded down
///             placed
///  1    8     standard deviation of the    2 cm, rounded up; 255 = 5.1 m or more
///             last frame's place against
///             earlier parts of the map
///  2-3  16    frames that closed a loop    65535 = that or more
///             since the mission's start
/// ```
///
/// Source: vehicle, among the [`super::PoseDetails`], where frames are or were registered.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct RegistrationReport {
    /// What places the last frame.
    pub tie: FrameTie,
    /// The part of the last 32 frames that images placed, 0..=1.
    pub share: f64,
    /// Standard deviation of the last frame's place against earlier parts of the map, metres, at most 5.1.
    pub sigma_m: f64,
    /// Frames that closed a loop since the mission's start.
    pub closed: u16,
}

/// Metres for each unit of the standard deviation.
const SIGMA_UNIT_M: f64 = 0.02;
/// Units of a whole share.
const WHOLE: f64 = 63.0;

impl RegistrationReport {
    /// Bytes on the wire, of which the last two are the closed loops.
    pub const BYTES: usize = 4;

    /// The bytes on the wire.
    pub fn encode(&self) -> [u8; Self::BYTES] {
        let tie = FrameTie::ALL.iter().position(|tie| *tie == self.tie).unwrap_or_default() as u8;
        let share = (self.share * WHOLE + 1e-9).clamp(0.0, WHOLE) as u8;
        let sigma = (self.sigma_m / SIGMA_UNIT_M - 1e-9).ceil().clamp(0.0, 255.0) as u8;
        let [high, low] = self.closed.to_be_bytes();
        [tie << 6 | share, sigma, high, low]
    }

    /// Reads a report; each has exactly one encoding.
    pub fn decode(bytes: [u8; Self::BYTES]) -> Self {
        let [head, sigma, high, low] = bytes;
        Self {
            tie: FrameTie::ALL.get(usize::from(head >> 6)).copied().unwrap_or_default(),
            share: f64::from(head & 63) / WHOLE,
            sigma_m: f64::from(sigma) * SIGMA_UNIT_M,
            closed: u16::from_be_bytes([high, low]),
        }
    }

    /// Reads a report; the rest stays in `r`.
    pub(super) fn read(r: &mut Reader<'_>) -> Result<Self, Truncated> {
        Ok(Self::decode([r.u8()?, r.u8()?, r.u8()?, r.u8()?]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn golden_bytes_of_a_registration_report() {
        let report = |tie, share, sigma_m, closed| RegistrationReport { tie, share, sigma_m, closed };
        for (report, bytes) in [
            (RegistrationReport::default(), [0x00, 0, 0, 0]),
            (report(FrameTie::FrameBefore, 1.0, 0.02, 1), [0x7f, 1, 0, 1]),
            (report(FrameTie::EarlierTrack, 21.0 / 63.0, 0.1, 258), [0x95, 5, 1, 2]),
            (report(FrameTie::Off, 0.0, 5.1, u16::MAX), [0xc0, 255, 255, 255]),
        ] {
            assert_eq!(report.encode(), bytes);
            assert_eq!(RegistrationReport::decode(bytes).encode(), bytes);
        }
        let beyond = report(FrameTie::Odometry, 2.0, 80.0, 0);
        assert_eq!(beyond.encode(), [0x3f, 255, 0, 0]);
    }
}
