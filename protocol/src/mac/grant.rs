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
    /// The turn granted by a frame heard at `now`, after which the surface sends `remaining` more.
    pub fn heard(quarters: u8, remaining: u8, profile: &ModemProfile, now: Instant) -> Self {
        let begins = now + profile.frame_airtime() * u32::from(remaining) + profile.turn_around;
        Self { begins, ends: begins + Duration::from_millis(250) * u32::from(quarters) }
    }

    /// Full frames that still fit, beginning at `now`.
    pub fn frames_left(&self, profile: &ModemProfile, now: Instant) -> u32 {
        let left = self.ends.since(now.max(self.begins)).as_secs_f64();
        let frame = profile.frame_airtime().as_secs_f64();
        (left / frame + 1e-6) as u32
    }
}
