//! Fields of a header: addresses, missions, sessions, and the time stamps from which each end estimates the propagation
//! time and the other end's clock.

use crate::bytes::{Reader, Truncated, put24};
use crate::time::Instant;
use std::num::NonZeroU16;
use std::time::Duration;

/// The address of an end: 0 is the surface, 1..=14 are vehicles, 15 is everybody.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Address(pub(super) u8);

impl Address {
    /// The address of the surface end.
    pub const SURFACE: Self = Self(0);
    /// All vehicles; never a sender.
    pub const EVERYBODY: Self = Self(15);

    /// The vehicle with this number; `None` outside 1..=14.
    pub fn vehicle(number: u8) -> Option<Self> {
        (1..=14).contains(&number).then_some(Self(number))
    }

    /// Whether it is the address of a vehicle.
    pub fn is_vehicle(self) -> bool {
        (1..=14).contains(&self.0)
    }

    /// The number on the wire, 0..=15.
    pub fn number(self) -> u8 {
        self.0
    }
}

/// Separates missions on one channel. It enters every seal, so a frame of another mission does not verify.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct MissionId(pub u32);

/// A random number of one run of one end; never 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SessionId(pub(super) NonZeroU16);

impl SessionId {
    /// A session id from 16 random bits; 0 becomes 65 535.
    pub fn from_random(bits: u16) -> Self {
        Self(NonZeroU16::new(bits).unwrap_or(NonZeroU16::MAX))
    }

    /// The number on the wire, never 0.
    pub fn get(self) -> u16 {
        self.0.get()
    }
}

/// The time of a transmission by the sender's clock.
///
/// ```text
/// from the surface, 5 bytes
/// byte  field
///  0-2  clock when the transmission of this frame began   milliseconds, low 24 bits
///  3-4  one-way propagation as the surface knows it       milliseconds, 0..=65 534; 65 535 = not known
///
/// from a vehicle, 6 bytes
///  0-2  clock when the transmission of this frame began   milliseconds, low 24 bits
///  3    number of the surface's last received frame, low 8 bits
///  4-5  from the end of its reception to the beginning of this frame   milliseconds, 65 535 = that or more
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stamp {
    /// A stamp in a frame of the surface.
    Surface {
        /// Clock in milliseconds, low 24 bits.
        clock_ms: u32,
        /// One-way propagation time, once it was measured.
        one_way: Option<Duration>,
    },
    /// A stamp in a frame of a vehicle.
    Vehicle {
        /// Clock in milliseconds, low 24 bits.
        clock_ms: u32,
        /// Low 8 bits of the number of the surface's last received frame.
        last_received: u8,
        /// Time since the end of that reception, at most [`Stamp::MAX_HELD`].
        held: Duration,
    },
}

impl Stamp {
    /// Length of the surface's stamp in bytes.
    pub const SURFACE_BYTES: usize = 5;
    /// The largest `held`, which stands for this time or a longer one.
    pub const MAX_HELD: Duration = Duration::from_millis(u16::MAX as u64);
    /// Length of a vehicle's stamp in bytes.
    pub const VEHICLE_BYTES: usize = 6;

    /// The clock reading at `now`, as on the wire.
    pub fn clock(now: Instant) -> u32 {
        now.clock_ms()
    }

    /// The sender's clock in milliseconds, low 24 bits.
    pub fn clock_ms(&self) -> u32 {
        match *self {
            Self::Surface { clock_ms, .. } | Self::Vehicle { clock_ms, .. } => clock_ms,
        }
    }

    pub(super) fn decode(from: Address, r: &mut Reader<'_>) -> Result<Self, Truncated> {
        let clock_ms = r.u24()?;
        if from == Address::SURFACE {
            let one_way = Some(r.u16()?).filter(|&ms| ms != u16::MAX).map(|ms| Duration::from_millis(ms.into()));
            return Ok(Self::Surface { clock_ms, one_way });
        }
        Ok(Self::Vehicle { clock_ms, last_received: r.u8()?, held: Duration::from_millis(r.u16()?.into()) })
    }

    pub(super) fn encode(&self, out: &mut Vec<u8>) {
        put24(out, self.clock_ms());
        let millis = |d: Duration, most: u16| (d.as_millis().min(u128::from(most)) as u16).to_be_bytes();
        match *self {
            Self::Surface { one_way, .. } => {
                out.extend_from_slice(&one_way.map_or(u16::MAX.to_be_bytes(), |d| millis(d, u16::MAX - 1)));
            }
            Self::Vehicle { last_received, held, .. } => {
                out.push(last_received);
                out.extend_from_slice(&millis(held, u16::MAX));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn golden_bytes_of_both_stamps() {
        let mut bytes = Vec::new();
        Stamp::Surface { clock_ms: 0x01_0203, one_way: Some(Duration::from_millis(667)) }.encode(&mut bytes);
        Stamp::Surface { clock_ms: 1, one_way: None }.encode(&mut bytes);
        Stamp::Vehicle { clock_ms: 0xFF_FFFF, last_received: 9, held: Duration::from_millis(258) }.encode(&mut bytes);
        assert_eq!(bytes, [1, 2, 3, 0x02, 0x9B, 0, 0, 1, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 9, 1, 2]);
        let mut r = Reader::new(&bytes);
        let stamp = Stamp::decode(Address::SURFACE, &mut r).unwrap();
        assert_eq!(stamp, Stamp::Surface { clock_ms: 0x01_0203, one_way: Some(Duration::from_millis(667)) });
    }
}
