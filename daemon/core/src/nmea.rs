//! NMEA 0183 sentences of receivers and compasses.
//!
//! ```text
//! $ talker(2) formatter(3) , field , field ... * checksum(2 hex digits: XOR of all between $ and *)
//! ```
//! Source: the field lists of the u-blox M8 protocol specification (UBX-13003221) and of gpsd's "NMEA Revealed".

use crate::geodesy::LatLon;

/// The content of a sentence, in the units of this program.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Sentence {
    /// GGA, and RMC where there is no GGA: a position.
    Position {
        place: LatLon,
        /// Time of day of the measurement, seconds of UTC.
        utc_s: Option<f64>,
        hdop: Option<f64>,
        /// Whether the solution has corrections: differential, real-time kinematic.
        is_corrected: bool,
    },
    /// The receiver reports that it has no position.
    NoPosition,
    /// RMC, VTG: the way over ground.
    Motion {
        speed_m_s: f64,
        /// Clockwise from true north, radians; `None` while standing.
        course_rad: Option<f64>,
    },
    /// HDT, THS: where the bow points, clockwise from true north, radians.
    Heading(f64),
    /// ZDA: seconds of UTC of the day.
    Time(f64),
}

/// Why a line is no sentence.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, thiserror::Error)]
pub enum NmeaError {
    /// Not text, no `$`, no `*`.
    #[error("no sentence")]
    NoSentence,
    #[error("wrong checksum")]
    Checksum,
    /// A field cannot be read, or is out of its range.
    #[error("unreadable field")]
    Field,
}

/// Longest line that is taken: the standard allows 82 with its ends, receivers of many digits go beyond.
pub const MAX_LINE: usize = 120;

const KNOT_M_S: f64 = 1852.0 / 3600.0;

pub fn checksum(body: &[u8]) -> u8 {
    body.iter().fold(0, |sum, b| sum ^ b)
}

/// `body` as a line: `$body*hh` and the line's end.
pub fn line(body: &str) -> String {
    format!("${body}*{:02X}\r\n", checksum(body.as_bytes()))
}

/// The fields of a line whose checksum is right: talker with formatter first.
pub fn fields(line: &[u8]) -> Result<Vec<&str>, NmeaError> {
    let text = std::str::from_utf8(line).map_err(|_| NmeaError::NoSentence)?;
    let (body, sum) = text.trim().strip_prefix('$').and_then(|t| t.split_once('*')).ok_or(NmeaError::NoSentence)?;
    let sum = (sum.len() == 2).then(|| u8::from_str_radix(sum, 16).ok()).flatten().ok_or(NmeaError::Checksum)?;
    if sum != checksum(body.as_bytes()) {
        return Err(NmeaError::Checksum);
    }
    Ok(body.split(',').collect())
}

/// Parses a line; `None` for a sentence that is not used here.
pub fn parse(line: &[u8]) -> Result<Vec<Sentence>, NmeaError> {
    let all = fields(line)?;
    let f = |i: usize| all.get(i).copied().unwrap_or("");
    let formatter = f(0).get(2..).unwrap_or("");
    Ok(match formatter {
        "GGA" => vec![gga(&f)?],
        "RMC" => rmc(&f)?,
        "VTG" => motion(number(f(5))?.map(|knots| knots * KNOT_M_S), number(f(1))?)?.into_iter().collect(),
        "HDT" => degrees(f(1))?.map(Sentence::Heading).into_iter().collect(),
        // The second field of THS says how good it is; V is no heading.
        "THS" if f(2) != "V" => degrees(f(1))?.map(Sentence::Heading).into_iter().collect(),
        "ZDA" => time(f(1))?.map(Sentence::Time).into_iter().collect(),
        _ => Vec::new(),
    })
}

fn gga<'a>(f: &impl Fn(usize) -> &'a str) -> Result<Sentence, NmeaError> {
    // Quality 0 is none, 6 estimated, 7 typed in, 8 simulated: nothing that a vehicle should be sent to.
    let quality = f(6);
    let is_corrected = matches!(quality, "2" | "4" | "5");
    if !is_corrected && !matches!(quality, "1" | "3") {
        return Ok(Sentence::NoPosition);
    }
    let place = place(f(2), f(3), f(4), f(5))?.ok_or(NmeaError::Field)?;
    let hdop = number(f(8))?.filter(|h| *h > 0.0);
    Ok(Sentence::Position { place, utc_s: time(f(1))?, hdop, is_corrected })
}

fn rmc<'a>(f: &impl Fn(usize) -> &'a str) -> Result<Vec<Sentence>, NmeaError> {
    // Mode E is estimated, M typed in, S simulated, N none.
    if f(2) != "A" || matches!(f(12), "E" | "M" | "S" | "N") {
        return Ok(vec![Sentence::NoPosition]);
    }
    let place = place(f(3), f(4), f(5), f(6))?.ok_or(NmeaError::Field)?;
    let at =
        Sentence::Position { place, utc_s: time(f(1))?, hdop: None, is_corrected: matches!(f(12), "D" | "R" | "F") };
    let motion = motion(number(f(7))?.map(|knots| knots * KNOT_M_S), number(f(8))?)?;
    Ok(std::iter::once(at).chain(motion).collect())
}

fn motion(speed_m_s: Option<f64>, course_deg: Option<f64>) -> Result<Option<Sentence>, NmeaError> {
    let Some(speed_m_s) = speed_m_s else { return Ok(None) };
    let is_sound = (0.0..200.0).contains(&speed_m_s) && course_deg.is_none_or(|c| (0.0..=360.0).contains(&c));
    let motion = Sentence::Motion { speed_m_s, course_rad: course_deg.map(f64::to_radians) };
    is_sound.then_some(Some(motion)).ok_or(NmeaError::Field)
}

/// A finite number; `None` if the field is empty.
fn number(field: &str) -> Result<Option<f64>, NmeaError> {
    if field.is_empty() {
        return Ok(None);
    }
    // Digits, sign and point only: `nan`, `inf` and `1e9` are numbers to Rust.
    let is_plain = field.bytes().all(|b| b.is_ascii_digit() || b == b'.' || b == b'-' || b == b'+');
    let value = field.parse::<f64>().ok().filter(|v| is_plain && v.is_finite());
    value.map(Some).ok_or(NmeaError::Field)
}

/// An angle in degrees as radians.
fn degrees(field: &str) -> Result<Option<f64>, NmeaError> {
    match number(field)? {
        Some(d) if !(0.0..=360.0).contains(&d) => Err(NmeaError::Field),
        other => Ok(other.map(f64::to_radians)),
    }
}

/// `hhmmss.sss` as seconds of the day.
fn time(field: &str) -> Result<Option<f64>, NmeaError> {
    let Some(value) = number(field)? else { return Ok(None) };
    let (h, m, s) = ((value / 10_000.0).floor(), (value / 100.0).floor() % 100.0, value % 100.0);
    let is_time = (0.0..24.0).contains(&h) && m < 60.0 && s < 61.0;
    is_time.then_some(Some(h * 3600.0 + m * 60.0 + s)).ok_or(NmeaError::Field)
}

/// `ddmm.mmm` N or S, `dddmm.mmm` E or W.
fn place(lat: &str, ns: &str, lon: &str, ew: &str) -> Result<Option<LatLon>, NmeaError> {
    let (Some(lat), Some(lon)) = (angle(lat)?, angle(lon)?) else { return Ok(None) };
    let sign = |letter: &str, plus: &str, minus: &str| match letter {
        l if l == plus => Ok(1.0),
        l if l == minus => Ok(-1.0),
        _ => Err(NmeaError::Field),
    };
    LatLon::new(lat * sign(ns, "N", "S")?, lon * sign(ew, "E", "W")?).map(Some).ok_or(NmeaError::Field)
}

fn angle(field: &str) -> Result<Option<f64>, NmeaError> {
    let Some(value) = number(field)? else { return Ok(None) };
    let (degrees, minutes) = ((value / 100.0).floor(), value % 100.0);
    (value >= 0.0 && minutes < 60.0).then_some(Some(degrees + minutes / 60.0)).ok_or(NmeaError::Field)
}

/// Latitude and longitude as four fields of a sentence: `ddmm.mmmmm,N,dddmm.mmmmm,E`.
pub fn place_fields(place: LatLon) -> String {
    let split = |degrees: f64| {
        // Rounded first, or 59.999999 minutes would be written as 60.
        let units = (degrees.abs() * 6_000_000.0).round() as u64;
        (units / 6_000_000, (units % 6_000_000) as f64 / 100_000.0)
    };
    let ((lat, lat_min), (lon, lon_min)) = (split(place.lat_deg), split(place.lon_deg));
    let ns = if place.lat_deg < 0.0 { 'S' } else { 'N' };
    let ew = if place.lon_deg < 0.0 { 'W' } else { 'E' };
    format!("{lat:02}{lat_min:08.5},{ns},{lon:03}{lon_min:08.5},{ew}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn sentences_of_receivers_are_read() {
        // From the u-blox M8 protocol specification.
        let gga = b"$GPGGA,092725.00,4717.11399,N,00833.91590,E,1,08,1.01,499.6,M,48.0,M,,*5B";
        let [Sentence::Position { place, utc_s, hdop, is_corrected }] = parse(gga).unwrap()[..] else { panic!() };
        assert!((place.lat_deg - 47.285_233).abs() < 1e-6 && (place.lon_deg - 8.565_265).abs() < 1e-6);
        assert_eq!((utc_s, hdop, is_corrected), (Some(34_045.0), Some(1.01), false));
        let rmc = b"$GPRMC,083559.00,A,4717.11437,N,00833.91522,E,0.004,77.52,091202,,,A*57";
        let said = parse(rmc).unwrap();
        assert!(
            matches!(said[..], [Sentence::Position { .. }, Sentence::Motion { speed_m_s, .. }] if speed_m_s < 0.01)
        );
        let vtg = b"$GPVTG,77.52,T,,M,0.004,N,0.008,K,A*06";
        assert!(
            matches!(parse(vtg).unwrap()[..], [Sentence::Motion { course_rad: Some(c), .. }] if (c - 1.353).abs() < 1e-3)
        );
        assert_eq!(parse(b"$GPZDA,082710.00,16,09,2002,00,00*64"), Ok(vec![Sentence::Time(30_430.0)]));
        let hdt = line("HEHDT,180.0,T");
        assert_eq!(parse(hdt.as_bytes()), Ok(vec![Sentence::Heading(std::f64::consts::PI)]));
        assert_eq!(parse(line("GPGSV,1,1,00").as_bytes()), Ok(vec![]));
    }

    #[test]
    fn what_is_wrong_is_refused_by_what_is_wrong() {
        let wrong = b"$GPGGA,092725.00,4717.11399,N,00833.91590,E,1,08,1.01,499.6,M,48.0,M,,*5C";
        assert_eq!(parse(wrong), Err(NmeaError::Checksum));
        assert_eq!(parse(b"GPGGA,1*00"), Err(NmeaError::NoSentence));
        assert_eq!(parse(b"\xFF\xFE"), Err(NmeaError::NoSentence));
        let gga = |f: &str| parse(line(&format!("GPGGA,{f}")).as_bytes());
        assert_eq!(gga("120000,9100.0,N,00833.9,E,1,08,1,,,,,,"), Err(NmeaError::Field), "no such latitude");
        assert_eq!(gga("120000,nan,N,00833.9,E,1,08,1,,,,,,"), Err(NmeaError::Field));
        assert_eq!(gga("120000,4760.0,N,00833.9,E,1,08,1,,,,,,"), Err(NmeaError::Field), "60 minutes");
        assert_eq!(gga("120000,4717.1,N,00833.9,,1,08,1,,,,,,"), Err(NmeaError::Field), "no hemisphere");
        assert_eq!(gga("120000,,,,,0,00,99.99,,,,,,"), Ok(vec![Sentence::NoPosition]));
        assert_eq!(gga("120000,4717.1,N,00833.9,E,8,08,1,,,,,,"), Ok(vec![Sentence::NoPosition]), "simulated");
        assert_eq!(parse(line("HEHDT,361.0,T").as_bytes()), Err(NmeaError::Field));
        assert_eq!(parse(line("HEHDT,,T").as_bytes()), Ok(vec![]));
    }

    proptest! {
        #[test]
        fn any_bytes_are_read_or_refused(bytes in proptest::collection::vec(any::<u8>(), 0..130)) {
            let _ = parse(&bytes);
        }

        #[test]
        fn mutated_lines_with_a_right_checksum_say_only_what_can_be(
            kind in 0usize..6, at in 0usize..80, with in "[ -~]{0,4}",
        ) {
            let bodies = [
                "GPGGA,092725.00,4717.11399,N,00833.91590,E,1,08,1.01,499.6,M,48.0,M,,",
                "GPRMC,083559.00,A,4717.11437,N,00833.91522,E,0.004,77.52,091202,,,A",
                "GPVTG,77.52,T,,M,0.004,N,0.008,K,A", "HEHDT,123.4,T", "GPTHS,12.3,A", "GPZDA,082710.00,16,09,2002,00,00",
            ];
            let body = bodies[kind];
            let at = at.min(body.len());
            let mutated = format!("{}{with}{}", &body[..at], body.get(at + 1..).unwrap_or(""));
            for sentence in parse(line(&mutated).as_bytes()).unwrap_or_default() {
                match sentence {
                    Sentence::Position { place, utc_s, hdop, .. } => {
                        prop_assert!(LatLon::new(place.lat_deg, place.lon_deg).is_some());
                        prop_assert!(utc_s.is_none_or(|t| (0.0..86_401.0).contains(&t)));
                        prop_assert!(hdop.is_none_or(|h| h.is_finite() && h > 0.0));
                    }
                    Sentence::Motion { speed_m_s, .. } => prop_assert!((0.0..200.0).contains(&speed_m_s)),
                    Sentence::Heading(h) => prop_assert!((0.0..6.3).contains(&h)),
                    Sentence::Time(t) => prop_assert!((0.0..86_401.0).contains(&t)),
                    Sentence::NoPosition => {}
                }
            }
        }

        #[test]
        fn a_place_comes_back_from_its_fields(lat in -90.0..=90.0f64, lon in -180.0..=180.0f64) {
            let place = LatLon::new(lat, lon).unwrap();
            let gga = line(&format!("GPGGA,000000,{},1,08,1,0,M,0,M,,", place_fields(place)));
            let said = parse(gga.as_bytes()).unwrap();
            let [Sentence::Position { place: back, .. }] = said[..] else { panic!("{gga}") };
            prop_assert!((back.lat_deg - lat).abs() < 2e-7 && (back.lon_deg - lon).abs() < 2e-7);
        }
    }
}
