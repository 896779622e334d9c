//! A vehicle's turn, as the surface grants it, and whether the vehicle may transmit now.

use super::{Access, ModemProfile};
use crate::time::Instant;
use std::time::Duration;

/// A vehicle's right to transmit, and the number of its frames in the modem.
#[derive(Debug, Clone, Default)]
pub struct Floor {
    grant: Option<Grant>,
    /// Frames that the modem has requested and not received yet.
    polled: u32,
    /// Frames handed to the modem that are not on air yet.
    in_modem: u32,
}

impl Floor {
    /// The surface grants a turn, or withdraws it with `None`.
    pub fn handle_grant(&mut self, grant: Option<Grant>) {
        self.grant = grant;
    }

    /// The modem requests `frames` frames now.
    pub fn handle_poll(&mut self, frames: u32) {
        self.polled = frames;
    }

    /// Frames handed to the modem that are not on air yet.
    pub fn in_modem(&self) -> u32 {
        self.in_modem
    }

    /// The oldest frame in the modem has been transmitted.
    pub fn handle_sent(&mut self) {
        self.in_modem = self.in_modem.saturating_sub(1);
    }

    /// How many frames may be handed to the modem now, one after the other.
    pub fn frames(&self, profile: &ModemProfile, now: Instant) -> u32 {
        match profile.access {
            Access::Shared if self.in_modem > 0 => 0,
            Access::Shared => self.grant.filter(|g| now >= g.begins).map_or(0, |g| g.frames_left(profile, now)),
            Access::Polled => self.polled,
            access => access.pool_frames().unwrap_or(0).saturating_sub(self.in_modem),
        }
    }

    /// Whether a turn is open that is too short for any further frame.
    pub fn is_over(&self, profile: &ModemProfile, now: Instant) -> bool {
        self.in_modem == 0 && self.grant.is_some_and(|g| now >= g.begins) && self.frames(profile, now) == 0
    }

    /// A frame was handed to the modem; the turn ends after the `last` one.
    pub fn spend(&mut self, last: bool) {
        self.in_modem += 1;
        self.polled = if last { 0 } else { self.polled.saturating_sub(1) };
        if last {
            self.grant = None;
        }
    }

    /// Ends the turn before its time.
    pub fn give_up(&mut self) {
        (self.grant, self.polled) = (None, 0);
    }

    /// When a granted turn begins; `None` while a frame is in the modem.
    pub fn next_wakeup(&self) -> Option<Instant> {
        self.grant.filter(|_| self.in_modem == 0).map(|g| g.begins)
    }
}

/// A duration in the wire's unit of a quarter second, rounded up, at most `most`.
pub fn quarter_seconds(d: Duration, most: u8) -> u8 {
    (d.as_secs_f64() * 4.0).ceil().clamp(0.0, f64::from(most)) as u8
}

/// When a vehicle would use another turn, in the 5 bits of its turn byte: the value itself up to 7, above it a number of 3 bits, the
/// first of which is 1 and not sent, shifted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Wish(u8);

impl Wish {
    const LAST: u8 = 31;

    /// The soonest one that is not before `wait`, or the last, 112 s or later.
    pub fn after(wait: Duration) -> Self {
        (0..Self::LAST).map(Self).find(|wish| wish.wait() >= wait).unwrap_or(Self(Self::LAST))
    }

    /// The one with these 5 bits.
    pub fn of_bits(bits: u8) -> Self {
        Self(bits & Self::LAST)
    }

    /// The low 5 bits of the vehicle's turn byte that carry it.
    pub fn bits(self) -> u8 {
        self.0
    }

    /// The time from the end of the turn.
    pub fn wait(self) -> Duration {
        let quarters = match self.0 >> 2 {
            0 => u32::from(self.0),
            exponent => u32::from(4 + (self.0 & 3)) << (exponent - 1),
        };
        Duration::from_millis(250) * quarters
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wish_is_the_soonest_that_is_not_too_soon() {
        let s = Duration::from_secs_f64;
        let mut waits = (0..32).map(|bits| Wish::of_bits(bits).wait());
        assert!(waits.clone().is_sorted_by(|a, b| a < b) && waits.next_back() == Some(s(112.0)));
        for (wait, told) in [(0.0, 0.0), (1.6, 1.75), (2.1, 2.5), (5.9, 6.0), (6.1, 7.0), (90.0, 96.0), (500.0, 112.0)]
        {
            assert_eq!(Wish::after(s(wait)).wait(), s(told), "{wait} s");
        }
    }
}
