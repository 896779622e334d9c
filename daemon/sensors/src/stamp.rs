//! The time at which a sensor measured.

use std::fmt;
use std::time::Duration;

/// Nanoseconds since the Unix epoch, by the clock of the sensor's computer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Stamp(i64);

const NANOS: i64 = 1_000_000_000;

/// Times in seconds since the Unix epoch by which the unit of a whole number is told: the years 2000 to 2099.
const EPOCHS_S: std::ops::Range<i64> = 946_684_800..4_102_444_800;
/// A clock that began at 0, as of a simulator, shows less, seconds.
const FROM_ZERO_S: i64 = 10_000_000;

/// The form of a time in a text.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum StampForm {
    Seconds,
    Milliseconds,
    Microseconds,
    Nanoseconds,
    /// Date and time of UTC.
    Date,
}

impl StampForm {
    /// The form in words for people, such as "seconds since 1970".
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Seconds => "seconds since 1970",
            Self::Milliseconds => "milliseconds since 1970",
            Self::Microseconds => "microseconds since 1970",
            Self::Nanoseconds => "nanoseconds since 1970",
            Self::Date => "date and time of UTC",
        }
    }
}

/// The rest of a text that is read from its front.
struct Rest<'a>(&'a str);

impl Rest<'_> {
    /// A number of so many digits.
    fn number(&mut self, digits: usize) -> Option<i64> {
        let (number, rest) = self.0.split_at_checked(digits)?;
        self.0 = rest;
        number.bytes().all(|b| b.is_ascii_digit()).then(|| number.parse().ok())?
    }

    /// Passes over one of these signs; returns whether it was there.
    fn passes(&mut self, signs: &[char]) -> bool {
        let rest = self.0.strip_prefix(signs);
        self.0 = rest.unwrap_or(self.0);
        rest.is_some()
    }
}

/// Nanoseconds since the Unix epoch of a date `yyyymmddThhmmss`, also with `_`, `-`, a space or nothing between day and hour, with `-`
/// between its parts, with a fraction behind `.`, or of 3, 6 or 9 digits behind `_`, `-` or nothing, and with `Z` at its end; `None` if
/// it is no date of the years 2000 to 2099.
fn nanos_of_date(text: &str) -> Option<i64> {
    let mut rest = Rest(text.strip_suffix('Z').unwrap_or(text));
    let year = rest.number(4)?;
    rest.passes(&['-']);
    let month = rest.number(2)?;
    rest.passes(&['-']);
    let of_month = rest.number(2)?;
    rest.passes(&['T', 't', '_', '-', ' ']);
    let hour = rest.number(2)?;
    rest.passes(&['-', ':']);
    let minute = rest.number(2)?;
    rest.passes(&['-', ':']);
    let second = rest.number(2)?;
    let is_decimal = rest.passes(&['.']);
    let is_apart = is_decimal || rest.passes(&['_', '-']);
    let fraction = rest.0;
    let is_fraction = fraction.bytes().all(|b| b.is_ascii_digit());
    // Behind other signs than a point, a short number counts images.
    let is_whole = match fraction.len() {
        0 => !is_apart,
        3 | 6 | 9 => true,
        _ => is_decimal,
    };
    if !is_fraction || !is_whole {
        return None;
    }
    let is_date = (2000..2100).contains(&year) && (1..=12).contains(&month) && (1..=31).contains(&of_month);
    if !is_date || hour > 23 || minute > 59 || second > 60 {
        return None;
    }
    // Days since the epoch, with years that begin in March (H. Hinnant, "chrono-compatible low-level date algorithms").
    let (y, m) = if month > 2 { (year, month - 3) } else { (year - 1, month + 9) };
    let days = 365 * y + y / 4 - y / 100 + y / 400 + (153 * m + 2) / 5 + of_month - 1 - 719_468;
    let seconds = days * 86_400 + hour * 3600 + minute * 60 + second;
    seconds.checked_mul(NANOS)?.checked_add(nanos_of_fraction(fraction)?)
}

/// Nanoseconds of the digits behind the point of a second; those behind the ninth are dropped.
fn nanos_of_fraction(digits: &str) -> Option<i64> {
    format!("{:0<9}", digits.get(..9).unwrap_or(digits)).parse().ok()
}

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

    /// Reads decimal seconds, as in `1305031102.175304`, a whole number in the unit that its size tells, or date and time of UTC, as in
    /// `20261126T185000.250`. Digits behind the ninth decimal are dropped.
    pub fn parse(text: &str) -> Option<Self> {
        Self::parse_with_form(text).map(|(stamp, _)| stamp)
    }

    /// The same, with the form that the text has.
    pub fn parse_with_form(text: &str) -> Option<(Self, StampForm)> {
        if let Some(nanos) = nanos_of_date(text) {
            return Some((Self(nanos), StampForm::Date));
        }
        let is_digits = |digits: &str| digits.bytes().all(|b| b.is_ascii_digit());
        let (whole, decimals) = text.split_once('.').unwrap_or((text, ""));
        if whole.is_empty() || whole.len() > 19 || !is_digits(whole) || !is_digits(decimals) {
            return None;
        }
        let number: i64 = whole.parse().ok()?;
        if !decimals.is_empty() || whole.len() <= 11 {
            let nanos = number.checked_mul(NANOS)?.checked_add(nanos_of_fraction(decimals)?)?;
            return Some((Self(nanos), StampForm::Seconds));
        }
        let is_of = |in_a_second: i64| EPOCHS_S.contains(&(number / in_a_second));
        match () {
            () if is_of(1_000) => Some((Self(number * 1_000_000), StampForm::Milliseconds)),
            () if is_of(1_000_000) => Some((Self(number * 1_000), StampForm::Microseconds)),
            () if is_of(NANOS) || number / NANOS < FROM_ZERO_S => Some((Self(number), StampForm::Nanoseconds)),
            () => None,
        }
    }

    /// The time in the name of an image, as [`Self::parse_with_form`] reads it, unless the name only counts images or is the time of a
    /// day: a whole number with a leading zero, or one that is no time of the years 2000 to 2099. The seconds of a clock that began at 0,
    /// as of a simulator, have decimals.
    pub fn of_name(stem: &str) -> Option<(Self, StampForm)> {
        let found = Self::parse_with_form(stem)?;
        let is_whole = stem.bytes().all(|b| b.is_ascii_digit());
        let is_time = EPOCHS_S.contains(&(found.0.0 / NANOS));
        (!is_whole || is_time && !stem.starts_with('0')).then_some(found)
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
    }

    #[test]
    fn the_size_of_a_number_gives_its_unit_and_dates_are_read() {
        use StampForm::*;
        // `date -u -d 2026-11-26T18:50:00 +%s`.
        const SECONDS: i64 = 1_795_719_000;
        for (text, nanos, form) in [
            ("1795719000", SECONDS * NANOS, Seconds),
            ("1795719000567", SECONDS * NANOS + 567_000_000, Milliseconds),
            ("1795719000567001", SECONDS * NANOS + 567_001_000, Microseconds),
            ("1795719000567001002", SECONDS * NANOS + 567_001_002, Nanoseconds),
            ("20261126T185000", SECONDS * NANOS, Date),
            ("20261126185000", SECONDS * NANOS, Date),
            ("20261126_185000.250", SECONDS * NANOS + 250_000_000, Date),
            ("20261126-185000Z", SECONDS * NANOS, Date),
            ("20261126T185000.250Z", SECONDS * NANOS + 250_000_000, Date),
            ("20261126185000250", SECONDS * NANOS + 250_000_000, Date),
            ("20261126T185000250", SECONDS * NANOS + 250_000_000, Date),
            ("20261126_185000_250", SECONDS * NANOS + 250_000_000, Date),
            ("2026-11-26T18-50-00.5", SECONDS * NANOS + 500_000_000, Date),
            ("20240229T000000", 1_709_164_800 * NANOS, Date),
            // A clock that began at 0, as of a simulator.
            ("123000000000", 123 * NANOS, Nanoseconds),
        ] {
            assert_eq!(Stamp::parse_with_form(text), Some((Stamp::from_nanos(nanos), form)), "{text}");
        }
        for wrong in [
            "20261326T185000",
            "20261126T256000",
            "20261126T18500",
            "2026-11-26",
            "IMG_20261126_185000",
            "20261126_185000_1",
            "99991126185000250",
        ] {
            assert_eq!(Stamp::parse(wrong), None, "{wrong}");
        }
        assert_eq!(Stamp::from_ros(-1, 5).unwrap().to_string(), "-1.000000005");
    }

    #[test]
    fn numbers_that_count_images_are_no_times() {
        for counter in [
            "0001",
            "1",
            "000001",
            "00000001",
            "115442",
            "115442123",
            "0123456789",
            "9999999999",
            "000000000123",
            "261129145528",
            "202611291455",
            "201126000100",
        ] {
            assert_eq!(Stamp::of_name(counter), None, "{counter}");
        }
        for time in ["1795719000", "1795719000567", "10.5", "0.25", "20261126T185000", "20261126185000"] {
            assert_eq!(Stamp::of_name(time), Stamp::parse_with_form(time), "{time}");
            assert!(Stamp::of_name(time).is_some(), "{time}");
        }
    }
}
