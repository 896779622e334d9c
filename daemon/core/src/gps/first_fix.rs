//! A receiver none of whose positions was ever used: the reason, in words for people.

use super::{GpsFault, GpsLanguage};
use scenecast_protocol::time::Instant;
use std::collections::BTreeMap;
use std::time::Duration;

/// Time after the first bytes after which people are told.
const AWAITED: Duration = Duration::from_secs(15);

/// Waits for the first position.
#[derive(Debug, Default)]
pub(super) struct FirstFix {
    /// When the first bytes came, and how many lines since.
    began: Option<Instant>,
    lines: u64,
    /// A position came, or people were told.
    is_over: bool,
}

impl FirstFix {
    /// Takes how many lines came in, and whether a position was among them.
    pub(super) fn handle(&mut self, lines: u64, has_fix: bool, now: Instant) {
        self.began.get_or_insert(now);
        self.lines += lines;
        self.is_over |= has_fix;
    }

    /// Whether people should know that there is no position, once.
    pub(super) fn is_missing(&mut self, now: Instant) -> bool {
        let is_missing = !self.is_over && self.began.is_some_and(|began| now.since(began) >= AWAITED);
        self.is_over |= is_missing;
        is_missing
    }

    /// The main reason, and what to check.
    pub(super) fn explain(&self, language: GpsLanguage, faults: &BTreeMap<GpsFault, u64>) -> String {
        let seconds = AWAITED.as_secs();
        let lines = self.lines + faults.get(&GpsFault::Overlong).unwrap_or(&0);
        if lines == 0 {
            return format!("no line came in {seconds} s, only bytes without an end of line: check the baud rate");
        }
        let (check, count) = match (faults.iter().max_by_key(|(_, count)| **count), language) {
            (Some((fault, count)), _) => (advice(*fault, language), *count),
            (None, GpsLanguage::Nmea) => ("none of them has a position: switch on sentences such as GGA or RMC", 0),
            (None, GpsLanguage::Gpsd) => {
                ("none of them has a position: check with cgps whether gpsd has a receiver", 0)
            }
        };
        format!("no position came in {seconds} s: of {lines} lines {count} were not used; {check}")
    }
}

fn advice(fault: GpsFault, language: GpsLanguage) -> &'static str {
    match (fault, language) {
        (GpsFault::Checksum, _) => "their checksums are wrong: check the baud rate and the cable",
        (GpsFault::Unreadable, GpsLanguage::Nmea) => {
            "they are no sentences of NMEA 0183 with a checksum: check the baud rate, whether the receiver adds checksums, and whether the port has NMEA or the JSON of gpsd"
        }
        (GpsFault::Unreadable, GpsLanguage::Gpsd) => {
            "they are no reports of gpsd: check whether the port has NMEA instead"
        }
        (GpsFault::Overlong, _) => "they are too long: check the baud rate",
        (GpsFault::NoPosition, _) => {
            "the receiver says that it has no position yet: check its antenna and its view of the sky"
        }
        (GpsFault::NullIsland, _) => "the receiver says latitude 0 and longitude 0: it has no position yet",
        (GpsFault::Repeated | GpsFault::Frozen, _) => "the receiver repeats one time or place: restart it",
        (GpsFault::Jump, _) => "the positions contradict each other: check the receiver",
    }
}

#[cfg(test)]
mod tests {
    use super::super::Gps;
    use super::*;

    /// The notes of a receiver that sends a line each second, with their times.
    fn notes(language: GpsLanguage, line: &str) -> Vec<(u32, String)> {
        let mut gps = Gps::new(language);
        let second = |s: u32| {
            gps.handle_bytes(line.as_bytes(), Instant::from_secs_f64(f64::from(s)));
            gps.poll_note().map(|note| (s, note))
        };
        (0..120).filter_map(second).collect()
    }

    #[test]
    fn a_receiver_without_a_usable_line_is_named_once() {
        for (language, line, check) in [
            (GpsLanguage::Gpsd, "$GPGGA,120000,2930.0,N,03455.2,E,1,08,1.0,0,M,0,M,,*00\r\n", "NMEA instead"),
            (GpsLanguage::Nmea, "$GPGGA,120000,2930.0,N,03455.2,E,1,08,1.0,0,M,0,M,,\r\n", "checksum"),
            (GpsLanguage::Nmea, "{\"class\":\"TPV\",\"mode\":3}\n", "gpsd"),
            (GpsLanguage::Nmea, "\u{1}\u{2}", "end of line"),
            (GpsLanguage::Gpsd, "{\"class\":\"TPV\",\"mode\":1}\n", "antenna"),
            (GpsLanguage::Gpsd, "{\"class\":\"DEVICES\",\"devices\":[]}\n", "whether gpsd has a receiver"),
        ] {
            let told = notes(language, line);
            assert!(told.len() == 1 && told[0].0 == 15 && told[0].1.contains(check), "{line} {told:?}");
        }
    }

    #[test]
    fn a_receiver_with_a_position_is_not_named() {
        assert!(notes(GpsLanguage::Gpsd, "{\"class\":\"TPV\",\"mode\":3,\"lat\":1.5,\"lon\":2.5}\n").is_empty());
    }
}
