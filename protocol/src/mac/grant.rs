//! A vehicle's turn, as the surface grants it.

use super::ModemProfile;
use crate::time::Instant;
use std::time::Duration;

/// A duration in the wire's unit of a quarter second, rounded up, at most `most`.
pub fn quarter_seconds(d: Duration, most: u8) -> u8 {
    (d.as_secs_f64() * 4.0).ceil().clamp(0.0, f64::from(most)) as u8
}

/// A turn granted to a vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grant {
    /// When the surface's own turn ends and the vehicle may begin.
    pub begins: Instant,
    /// When the vehicle's last transmission must have ended.
    pub ends: Instant,
}

impl Grant {
    /// Bits on air for each unit of the header's `remaining` byte from the surface.
    const REMAINING_BITS: u64 = 32;

    /// The header's `remaining` byte for a surface turn of which `bits_on_air` follow: rounded up,
    /// 255 means that or more.
    pub fn code_remaining(bits_on_air: u64) -> u8 {
        bits_on_air.div_ceil(Self::REMAINING_BITS).min(255) as u8
    }

    /// The turn granted by a frame received at `now`, after which `remaining` of the surface's turn follows.
    pub fn received(quarters: u8, remaining: u8, profile: &ModemProfile, now: Instant) -> Self {
        let rest = profile.time_of(u64::from(remaining) * Self::REMAINING_BITS);
        let begins = now + rest + profile.turn_around;
        Self { begins, ends: begins + Duration::from_millis(250) * u32::from(quarters) }
    }

    /// Full frames that still fit into the turn, beginning at `now`.
    pub fn frames_left(&self, profile: &ModemProfile, now: Instant) -> u32 {
        let left = self.ends.since(now.max(self.begins)).as_secs_f64();
        let frame = profile.frame_airtime().as_secs_f64();
        (left / frame + 1e-6) as u32
    }
}
