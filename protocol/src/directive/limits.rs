//! Limits of depth, altitude, distance and time, and the reactions to a breach.

use crate::bytes::{Reader, Truncated, put24};

/// A reaction of the vehicle's failsafe.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reaction {
    /// The vehicle stays at its position.
    Hold,
    /// The vehicle goes to the return point and stays there.
    Return,
    /// The vehicle rises to the water surface.
    Surface,
}

impl Reaction {
    /// Every reaction; the number on the wire is the index plus 1.
    pub const ALL: [Self; 3] = [Self::Hold, Self::Return, Self::Surface];

    /// The name in files and in the API.
    pub fn name(self) -> &'static str {
        match self {
            Self::Hold => "hold",
            Self::Return => "return",
            Self::Surface => "surface",
        }
    }

    /// The reaction with that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|r| r.name() == name)
    }

    fn code(reaction: Option<Self>) -> u8 {
        reaction.map_or(0, |r| r as u8 + 1)
    }

    fn from_code(code: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|&r| r as u8 + 1 == code)
    }
}

/// A range of depth or altitude, in decimetres.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Band {
    /// The lowest allowed value in decimetres.
    pub low_dm: u16,
    /// The highest allowed value in decimetres.
    pub high_dm: u16,
}

impl Band {
    /// Whether a value in metres lies inside, bounds included.
    pub fn contains(self, metres: f64) -> bool {
        (f64::from(self.low_dm)..=f64::from(self.high_dm)).contains(&(metres * 10.0))
    }
}

/// Limits of depth, altitude, distance and time, and the vehicle's reactions when one is broken.
///
/// ```text
/// byte  bits  field
///  0    5     depth band, altitude band, distance, time, silence: whether each follows
///  0    3     reserved, 0
///  1    2+2+2 on silence, on a breach, on abort: 0 as configured on the vehicle, 1 hold, 2 return, 3 surface
///  1    2     reserved, 0
///  4          [depth: lowest, highest, decimetres below the surface, 0..6553.5 m]
///  4          [altitude: lowest, highest, decimetres above the sea floor]
///  3          [distance: metres travelled over ground, 1..16 777 215, the return path included]
///  3          [time: seconds, 1..16 777 215, the return path included]
///  2          [silence: seconds without a frame of the surface, 1..65 535]
/// ```
///
/// Source: surface. Distance and time count from the moment when the vehicle puts the limits in force.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Limits {
    /// Allowed depths below the water surface.
    pub depth: Option<Band>,
    /// Allowed altitudes above the sea floor.
    pub altitude: Option<Band>,
    /// Distance over ground in metres, the return path included.
    pub distance_m: Option<u32>,
    /// Duration of the survey in seconds, the return path included.
    pub time_s: Option<u32>,
    /// Seconds without a frame of the surface.
    pub silence_s: Option<u16>,
    /// The reaction to silence; `None` keeps the vehicle's configured one.
    pub on_silence: Option<Reaction>,
    /// The reaction outside the fence, in a keep-out or outside a band; `None` keeps the configured one.
    pub on_breach: Option<Reaction>,
    /// The reaction to an abort; `None` keeps the configured one.
    pub on_abort: Option<Reaction>,
}

/// Why limits are refused; the name of the limit comes first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum LimitsFault {
    /// The lowest value is not below the highest.
    #[error("{0}: the lowest value must be below the highest")]
    EmptyBand(&'static str),
    /// A limit of 0, or one that the layout cannot state.
    #[error("{0}: it takes 1 to {1}")]
    OutOfRange(&'static str, u32),
}

impl Limits {
    /// The largest distance in metres, and the longest time in seconds.
    pub const MAX: u32 = 0xFF_FFFF;

    /// Checks whether a vehicle could obey the limits.
    pub fn check(&self) -> Result<(), LimitsFault> {
        for (name, band) in [("depth_m", self.depth), ("altitude_m", self.altitude)] {
            if band.is_some_and(|b| b.low_dm >= b.high_dm) {
                return Err(LimitsFault::EmptyBand(name));
            }
        }
        for (name, limit, most) in [
            ("distance_m", self.distance_m, Self::MAX),
            ("time_s", self.time_s, Self::MAX),
            ("silence_s", self.silence_s.map(u32::from), u32::from(u16::MAX)),
        ] {
            if limit.is_some_and(|l| !(1..=most).contains(&l)) {
                return Err(LimitsFault::OutOfRange(name, most));
            }
        }
        Ok(())
    }

    /// Encodes the payload of the slot.
    pub fn to_bytes(&self) -> Vec<u8> {
        let given = [
            self.depth.is_some(),
            self.altitude.is_some(),
            self.distance_m.is_some(),
            self.time_s.is_some(),
            self.silence_s.is_some(),
        ];
        let flags = given.iter().fold(0u8, |flags, &g| flags << 1 | u8::from(g)) << 3;
        let reactions = [self.on_silence, self.on_breach, self.on_abort];
        let reactions = reactions.iter().fold(0u8, |codes, &r| codes << 2 | Reaction::code(r)) << 2;
        let mut out = vec![flags, reactions];
        for edge in [self.depth, self.altitude].into_iter().flatten().flat_map(|b| [b.low_dm, b.high_dm]) {
            out.extend_from_slice(&edge.to_be_bytes());
        }
        for limit in [self.distance_m, self.time_s].into_iter().flatten() {
            put24(&mut out, limit.min(Self::MAX));
        }
        out.extend(self.silence_s.into_iter().flat_map(u16::to_be_bytes));
        out
    }

    /// Decodes a payload; `None` if it has another layout. [`Self::check`] must still be called.
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let mut r = Reader::new(bytes);
        let read = Self::read(&mut r).ok().flatten()?;
        r.rest().is_empty().then_some(read)
    }

    fn read(r: &mut Reader<'_>) -> Result<Option<Self>, Truncated> {
        let (flags, reactions) = (r.u8()?, r.u8()?);
        if flags & 0b111 != 0 || reactions & 0b11 != 0 {
            return Ok(None);
        }
        let follows = |place: u8| flags & 0x80 >> place != 0;
        let reaction = |shift: u8| Reaction::from_code(reactions >> shift & 3);
        let mut band = |place: u8| -> Result<Option<Band>, Truncated> {
            if !follows(place) {
                return Ok(None);
            }
            Ok(Some(Band { low_dm: r.u16()?, high_dm: r.u16()? }))
        };
        Ok(Some(Self {
            depth: band(0)?,
            altitude: band(1)?,
            distance_m: follows(2).then(|| r.u24()).transpose()?,
            time_s: follows(3).then(|| r.u24()).transpose()?,
            silence_s: follows(4).then(|| r.u16()).transpose()?,
            on_silence: reaction(6),
            on_breach: reaction(4),
            on_abort: reaction(2),
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const ALL: Limits = Limits {
        depth: Some(Band { low_dm: 50, high_dm: 400 }),
        altitude: Some(Band { low_dm: 15, high_dm: 60 }),
        distance_m: Some(3000),
        time_s: Some(7200),
        silence_s: Some(600),
        on_silence: Some(Reaction::Return),
        on_breach: Some(Reaction::Hold),
        on_abort: Some(Reaction::Surface),
    };

    #[test]
    fn golden_bytes_of_limits() {
        let bytes = ALL.to_bytes();
        let golden = [0xF8, 0x9C, 0, 50, 1, 144, 0, 15, 0, 60, 0, 0x0B, 0xB8, 0, 0x1C, 0x20, 0x02, 0x58];
        assert_eq!(bytes, golden);
        assert_eq!(Limits::from_bytes(&bytes), Some(ALL));
        assert_eq!(Limits::default().to_bytes(), [0, 0]);
        assert_eq!(Limits::from_bytes(&[1, 0]), None, "a reserved bit");
        assert_eq!(Limits::from_bytes(&golden[..17]), None, "too short");
        assert_eq!(Limits::from_bytes(&[0, 0, 0]), None, "too long");
    }

    #[test]
    fn contradictory_limits_are_refused_by_name() {
        assert_eq!(ALL.check(), Ok(()));
        let band = Some(Band { low_dm: 60, high_dm: 15 });
        assert_eq!(Limits { depth: band, ..ALL }.check(), Err(LimitsFault::EmptyBand("depth_m")));
        assert_eq!(Limits { altitude: band, ..ALL }.check(), Err(LimitsFault::EmptyBand("altitude_m")));
        let fault = Limits { distance_m: Some(0), ..ALL }.check().unwrap_err();
        assert_eq!(fault.to_string(), "distance_m: it takes 1 to 16777215");
        assert!(Limits { silence_s: Some(0), ..ALL }.check().is_err());
    }

    proptest! {
        #[test]
        fn any_bytes_that_are_read_are_written_again(bytes in proptest::collection::vec(any::<u8>(), 0..24)) {
            if let Some(limits) = Limits::from_bytes(&bytes) {
                prop_assert_eq!(limits.to_bytes(), bytes);
            }
        }
    }
}
