//! Decimal numbers exactly as they are written.

/// `digits` times ten to the power of `exponent`: a step of 0.1 stays 0.1 at both ends.
///
/// ```text
///  0                   1                   2                   3
///  0 1 2 3 4 5 6 7 8 9 0 1 2 3 4 5 6 7 8 9 0 1 2 3 4 5 6 7 8 9 0 1
/// +-----------------------------------------------+---------------+
/// | digits, two's complement                      | exponent, too |
/// +-----------------------------------------------+---------------+
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Decimal {
    digits: i32,
    exponent: i8,
}

impl Decimal {
    /// The number 0, with exponent 0.
    pub const ZERO: Self = Self { digits: 0, exponent: 0 };
    /// The length on the wire: 24 bits of digits, 8 of exponent.
    pub const BYTES: usize = 4;
    /// The exponent lies within this of 0.
    const MAX_EXPONENT: i8 = 9;
    /// 24 bits with the sign.
    const MAX_DIGITS: i32 = (1 << 23) - 1;

    /// The number whose `digits` (at most 8 388 607 either way) are followed by `exponent` zeros, or have so many decimals
    /// if it is negative (at most nine either way). Out of these ranges the nearest is taken.
    pub const fn new(digits: i32, exponent: i8) -> Self {
        let digits = if digits > Self::MAX_DIGITS { Self::MAX_DIGITS } else { digits };
        let digits = if digits < -Self::MAX_DIGITS - 1 { -Self::MAX_DIGITS - 1 } else { digits };
        let exponent = if exponent > Self::MAX_EXPONENT { Self::MAX_EXPONENT } else { exponent };
        let exponent = if exponent < -Self::MAX_EXPONENT { -Self::MAX_EXPONENT } else { exponent };
        Self { digits, exponent }
    }

    /// The nearest number to `value` with up to six significant digits, as people write them.
    pub fn nearest(value: f64) -> Self {
        const DIGITS: i32 = 6;
        if value == 0.0 || !value.is_finite() {
            return Self::ZERO;
        }
        let exponent = (value.abs().log10().floor() as i32 + 1 - DIGITS).max(-i32::from(Self::MAX_EXPONENT));
        let (mut digits, mut exponent) = ((value / 10f64.powi(exponent)).round() as i32, exponent);
        while digits != 0 && digits % 10 == 0 {
            (digits, exponent) = (digits / 10, exponent + 1);
        }
        // A number without decimals needs no exponent.
        while (1..=3).contains(&exponent) && digits.abs() <= Self::MAX_DIGITS / 10 {
            (digits, exponent) = (digits * 10, exponent - 1);
        }
        Self::new(digits, exponent as i8)
    }

    /// As a binary number, the nearest one where the exponent is at most 0.
    pub fn value(self) -> f64 {
        let power = 10f64.powi(i32::from(self.exponent.abs()));
        if self.exponent < 0 { f64::from(self.digits) / power } else { f64::from(self.digits) * power }
    }

    pub(super) fn encode(self) -> [u8; Self::BYTES] {
        let [_, a, b, c] = self.digits.to_be_bytes();
        [a, b, c, self.exponent as u8]
    }

    pub(super) fn decode([a, b, c, exponent]: [u8; Self::BYTES]) -> Option<Self> {
        let (digits, exponent) = (i32::from_be_bytes([a, b, c, 0]) >> 8, exponent as i8);
        (exponent.unsigned_abs() <= Self::MAX_EXPONENT as u8).then_some(Self { digits, exponent })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn golden_bytes_and_values_of_decimals() {
        assert_eq!((Decimal::new(5, -1).encode(), Decimal::new(5, -1).value()), ([0, 0, 5, 0xFF], 0.5));
        assert_eq!((Decimal::new(-3, 2).encode(), Decimal::new(-3, 2).value()), ([0xFF, 0xFF, 0xFD, 2], -300.0));
        assert_eq!(Decimal::new(i32::MIN, 100), Decimal::new(-8_388_608, 9));
        assert_eq!(Decimal::decode([0, 0, 1, 10]), None);
    }

    #[test]
    fn a_typed_number_becomes_the_decimal_that_was_written() {
        for (value, digits, exponent) in [(0.5, 5, -1), (-80.0, -80, 0), (0.0, 0, 0), (1e9, 1, 9), (0.001_25, 125, -5)]
        {
            assert_eq!(Decimal::nearest(value), Decimal::new(digits, exponent), "{value}");
        }
        assert_eq!(Decimal::nearest(1.0 / 3.0), Decimal::new(333_333, -6));
        assert_eq!([f64::NAN, f64::INFINITY].map(Decimal::nearest), [Decimal::ZERO; 2]);
        assert!((Decimal::nearest(-1e-9).value() + 1e-9).abs() < 1e-15);
    }

    proptest! {
        #[test]
        fn a_decimal_reads_back(bytes: [u8; 4]) {
            if let Some(decimal) = Decimal::decode(bytes) {
                prop_assert_eq!(decimal.encode(), bytes);
                prop_assert!(decimal.value().is_finite());
                prop_assert_eq!(Decimal::new(decimal.digits, decimal.exponent), decimal);
            }
        }
    }
}
