//! The values of settings: choices, and numbers of few decimal digits.

use crate::bytes::{Reader, Truncated};
use std::fmt;

/// An order about one setting.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Change<T> {
    /// The setting stays as it is.
    #[default]
    Keep,
    /// The setting returns to the vehicle's configured value.
    Configured,
    /// The setting gets this value.
    To(T),
}

impl<T: Copy> Change<T> {
    /// The combination of this order and a later one: the later one, unless it keeps the setting.
    pub fn then(self, later: Self) -> Self {
        if matches!(later, Self::Keep) { self } else { later }
    }

    /// The ordered value; `None` if the configured value is in force.
    pub fn value(self) -> Option<T> {
        match self {
            Self::To(value) => Some(value),
            Self::Keep | Self::Configured => None,
        }
    }

    pub(super) fn code(self, index: impl FnOnce(T) -> u8) -> u8 {
        match self {
            Self::Keep => 0,
            Self::Configured => 1,
            Self::To(value) => index(value) + 2,
        }
    }

    pub(super) fn from_code(code: u8, value: impl FnOnce(u8) -> Option<T>) -> Result<Self, Truncated> {
        match code {
            0 => Ok(Self::Keep),
            1 => Ok(Self::Configured),
            _ => value(code - 2).map(Self::To).ok_or(Truncated),
        }
    }
}

/// The planner that chooses the next waypoints.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlannerKind {
    /// Parallel legs over the whole survey.
    Lawnmower,
    /// Always the place with the highest gain for each metre of path.
    Greedy,
    /// The best path over the whole remaining distance and time.
    Horizon,
}

impl PlannerKind {
    /// Every planner, in wire order.
    pub const ALL: [Self; 3] = [Self::Lawnmower, Self::Greedy, Self::Horizon];

    /// Name in files and in the API.
    pub fn name(self) -> &'static str {
        match self {
            Self::Lawnmower => "lawnmower",
            Self::Greedy => "greedy",
            Self::Horizon => "horizon",
        }
    }

    /// The planner of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|p| p.name() == name)
    }
}

/// What an adaptive survey does once no look pays any more.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AtEnd {
    /// It explores the rest of the area, then looks at the favoured labels again, as if it had not seen them.
    Repeat,
    /// It explores the rest of the area, then holds.
    Explore,
    /// It holds, and does not explore the rest of the area first.
    Hold,
}

impl AtEnd {
    /// Every choice, in wire order.
    pub const ALL: [Self; 3] = [Self::Repeat, Self::Explore, Self::Hold];

    /// Name in files and in the API.
    pub fn name(self) -> &'static str {
        match self {
            Self::Repeat => "repeat",
            Self::Explore => "explore",
            Self::Hold => "hold",
        }
    }

    /// The choice of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|choice| choice.name() == name)
    }
}

/// Whether the images of the camera place its frames on the map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Registration {
    /// Odometry and compass place them.
    Off,
    /// Their overlap with earlier frames places them too.
    On,
}

impl Registration {
    /// Every choice, in wire order.
    pub const ALL: [Self; 2] = [Self::Off, Self::On];

    /// Name in files and in the API.
    pub fn name(self) -> &'static str {
        match self {
            Self::Off => "off",
            Self::On => "on",
        }
    }

    /// The choice of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|choice| choice.name() == name)
    }
}

/// The cells of the map that a vehicle sends. The cells of its scene model do not change.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CellBand {
    /// Every cell of the map, in no order of size.
    Fine,
    /// Where the backlog is long, every fourth cell in both directions first; then every cell.
    CoarseToFine,
    /// Every fourth cell in both directions. Other cells that the surface already knows stay up to date.
    Coarse,
}

impl CellBand {
    /// Every band, in wire order.
    pub const ALL: [Self; 3] = [Self::Fine, Self::CoarseToFine, Self::Coarse];

    /// Name in files and in the API.
    pub fn name(self) -> &'static str {
        match self {
            Self::Fine => "fine",
            Self::CoarseToFine => "coarse-to-fine",
            Self::Coarse => "coarse",
        }
    }

    /// The band of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|band| band.name() == name)
    }
}

/// A positive number of three decimal digits. A decimal that an operator types comes into force exactly as typed.
///
/// ```text
/// bit 15: 0; bits 14-10: e; bits 9-0: m, 100..=999. The value is m x 10^(e - 14); all bits 0: as configured.
/// ```
///
/// ```
/// use scenecast_protocol::directive::ShortDecimal;
///
/// assert_eq!(ShortDecimal::new(0.0025).unwrap().value(), 0.0025);
/// assert_eq!(ShortDecimal::new(1.23456).unwrap().value(), 1.23, "three digits");
/// assert_eq!(ShortDecimal::new(-1.0), None);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct ShortDecimal {
    digits: u16,
    exponent: u8,
}

impl ShortDecimal {
    const OFFSET: i32 = 14;
    const MAX_EXPONENT: i32 = 31;

    /// The nearest number to `value`; `None` unless it is positive and within 1e-12 to 9.99e19.
    pub fn new(value: f64) -> Option<Self> {
        if !(value.is_finite() && value > 0.0) {
            return None;
        }
        let mut exponent = value.log10().floor() as i32 - 2;
        let mut digits = (value * power(-exponent)).round();
        // Rounding of the logarithm or of the digits may cross a power of ten.
        while digits >= 1000.0 {
            exponent += 1;
            digits = (value * power(-exponent)).round();
        }
        while digits < 100.0 {
            exponent -= 1;
            digits = (value * power(-exponent)).round();
        }
        let exponent = exponent + Self::OFFSET;
        let fits = (0..=Self::MAX_EXPONENT).contains(&exponent) && (100.0..1000.0).contains(&digits);
        fits.then_some(Self { digits: digits as u16, exponent: exponent as u8 })
    }

    /// The number as a float, rounded once.
    pub fn value(self) -> f64 {
        let exponent = i32::from(self.exponent) - Self::OFFSET;
        // Digits and powers up to 10^17 are exact, so a single rounding gives the same float as the decimal numeral.
        if exponent < 0 { f64::from(self.digits) / power(-exponent) } else { f64::from(self.digits) * power(exponent) }
    }

    pub(super) fn encode(change: Change<Self>, out: &mut Vec<u8>) {
        match change {
            Change::Keep => {}
            Change::Configured => out.extend([0, 0]),
            Change::To(Self { digits, exponent }) => {
                out.extend((u16::from(exponent) << 10 | digits).to_be_bytes());
            }
        }
    }

    pub(super) fn decode(r: &mut Reader<'_>) -> Result<Change<Self>, Truncated> {
        let bits = r.u16()?;
        let (digits, exponent) = (bits & 0x3FF, (bits >> 10) as u8);
        match (bits, digits) {
            (0, _) => Ok(Change::Configured),
            (..=0x7FFF, 100..=999) => Ok(Change::To(Self { digits, exponent })),
            _ => Err(Truncated),
        }
    }
}

fn power(exponent: i32) -> f64 {
    10f64.powi(exponent)
}

impl fmt::Display for ShortDecimal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.value().fmt(f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn three_typed_digits_come_into_force_exactly() {
        for text in ["0.01", "1e-12", "0.0005", "5e-5", "0.123", "999", "1000", "30", "50000", "1e8", "9.99e19", "0.3"]
        {
            let value: f64 = text.parse().unwrap();
            assert_eq!(ShortDecimal::new(value).map(ShortDecimal::value), Some(value), "{text}");
        }
        assert_eq!(ShortDecimal::new(0.099_96).map(ShortDecimal::value), Some(0.1));
        for off in [0.0, -1.0, 9e-13, 1e20, f64::NAN, f64::INFINITY, f64::MIN_POSITIVE] {
            assert_eq!(ShortDecimal::new(off), None, "{off}");
        }
    }

    proptest! {
        #[test]
        fn a_number_is_off_by_half_a_percent_at_most(power in -12.0f64..19.9) {
            let value = 10f64.powf(power);
            let number = ShortDecimal::new(value).unwrap();
            prop_assert!((number.value() / value - 1.0).abs() <= 0.005);
            prop_assert_eq!(ShortDecimal::new(number.value()), Some(number));
        }
    }
}
