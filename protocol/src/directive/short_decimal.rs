//! Numbers of three decimal digits in two bytes.

use super::Change;
use crate::bytes::{Reader, Truncated};
use std::fmt;

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
