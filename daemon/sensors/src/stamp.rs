//! The time at which a sensor measured.

use std::fmt;
use std::time::Duration;

/// Nanoseconds since the Unix epoch, by the clock of the sensor's computer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Stamp(i64);

const NANOS: i64 = 1_000_000_000;

impl Stamp {
    pub const fn from_nanos(nanos: i64) -> Self {
        Self(nanos)
    }

    pub const fn nanos(self) -> i64 {
        self.0
    }

    /// The stamp of a ROS 2 header; `None` unless the nanoseconds are less than a second.
    pub fn from_ros(sec: i32, nanosec: u32) -> Option<Self> {
        (i64::from(nanosec) < NANOS).then(|| Self(i64::from(sec) * NANOS + i64::from(nanosec)))
    }

    /// Reads decimal seconds, as in `1305031102.175304`, or nanoseconds, as in `1403636579763555584`: whole numbers of
    /// more than 11 digits are nanoseconds. Digits behind the ninth decimal are dropped.
    pub fn parse(text: &str) -> Option<Self> {
        let is_digits = |digits: &str| digits.bytes().all(|b| b.is_ascii_digit());
        let (whole, decimals) = text.split_once('.').unwrap_or((text, ""));
        if whole.is_empty() || whole.len() > 19 || !is_digits(whole) || !is_digits(decimals) {
            return None;
        }
        let whole_number: i64 = whole.parse().ok()?;
        if decimals.is_empty() && whole.len() > 11 {
            return Some(Self(whole_number));
        }
        let nanos: i64 = format!("{:0<9}", decimals.get(..9).unwrap_or(decimals)).parse().ok()?;
        whole_number.checked_mul(NANOS)?.checked_add(nanos).map(Self)
    }

    /// Seconds from `earlier` to this stamp; negative if it is later.
    pub fn seconds_since(self, earlier: Self) -> f64 {
        let nanos = i128::from(self.0) - i128::from(earlier.0);
        nanos as f64 / NANOS as f64
    }

    /// The stamp moved by seconds, earlier if they are negative.
    #[must_use]
    pub fn shifted(self, seconds: f64) -> Self {
        let by = Duration::from_secs_f64(seconds.abs());
        if seconds < 0.0 { self.before(by) } else { self.after(by) }
    }

    #[must_use]
    pub fn before(self, by: Duration) -> Self {
        Self(self.0.saturating_sub(i64::try_from(by.as_nanos()).unwrap_or(i64::MAX)))
    }

    #[must_use]
    pub fn after(self, by: Duration) -> Self {
        Self(self.0.saturating_add(i64::try_from(by.as_nanos()).unwrap_or(i64::MAX)))
    }
}

impl fmt::Display for Stamp {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{:09}", self.0.div_euclid(NANOS), self.0.rem_euclid(NANOS))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seconds_and_nanoseconds_are_read() {
        for (text, nanos) in [
            ("1305031102.175304", 1_305_031_102_175_304_000),
            ("1403636579763555584", 1_403_636_579_763_555_584),
            ("0.1", 100_000_000),
            ("12", 12_000_000_000),
            ("1.0123456789", 1_012_345_678),
        ] {
            assert_eq!(Stamp::parse(text), Some(Stamp::from_nanos(nanos)), "{text}");
        }
        for wrong in ["", ".5", "-1", "1e3", "frame-000001", "1.x", "99999999999999999999", "99999999999.5"] {
            assert_eq!(Stamp::parse(wrong), None, "{wrong}");
        }
        assert_eq!(Stamp::from_ros(2, NANOS as u32), None);
        assert_eq!(Stamp::from_ros(-1, 5).unwrap().to_string(), "-1.000000005");
    }
}
