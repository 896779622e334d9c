//! A vehicle's turn.

use super::ModemProfile;
use crate::time::Instant;
use std::time::Duration;

/// Quarter seconds on the wire, rounded up, at most `most`.
pub fn quarter_seconds(d: Duration, most: u8) -> u8 {
    (d.as_secs_f64() * 4.0).ceil().clamp(0.0, f64::from(most)) as u8
}

/// A turn that was granted to a vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grant {
    /// When the surface has finished its own turn and the vehicle may begin.
    pub begins: Instant,
    /// When its last transmission must have ended.
    pub ends: Instant,
}

impl Grant {
    /// Bits on air that one unit of what remains of the surface's turn stands for.
    const REMAINING_BITS: u64 = 32;

    /// What remains of the surface's turn, as its frames say it: rounded up, 255 is that or more.
    pub fn code_remaining(bits_on_air: u64) -> u8 {
        bits_on_air.div_ceil(Self::REMAINING_BITS).min(255) as u8
    }

    /// The turn granted by a frame heard at `now`, after which so much `remaining` of the surface's turn follows.
    pub fn heard(quarters: u8, remaining: u8, profile: &ModemProfile, now: Instant) -> Self {
        let rest = profile.time_of(u64::from(remaining) * Self::REMAINING_BITS);
        let begins = now + rest + profile.turn_around;
        Self { begins, ends: begins + Duration::from_millis(250) * u32::from(quarters) }
    }

    /// Full frames that still fit, beginning at `now`.
    pub fn frames_left(&self, profile: &ModemProfile, now: Instant) -> u32 {
        let left = self.ends.since(now.max(self.begins)).as_secs_f64();
        let frame = profile.frame_airtime().as_secs_f64();
        (left / frame + 1e-6) as u32
    }
}
