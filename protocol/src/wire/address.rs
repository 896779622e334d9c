//! The ends of a link: addresses, missions and runs.

use std::num::NonZeroU16;

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
