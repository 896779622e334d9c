//! NMEA 0183 sentences of receivers and compasses, and a position as an ultra-short baseline (USBL) head reports it.
//!
//! ```text
//! $ talker(2) formatter(3) , field , field ... * checksum(2 hex digits: XOR of all between $ and *)
//! ```
//! A tag block of NMEA 4 (`\\s:GP0001,c:1790000000*25\\`) or a byte order mark may stand before it; sentences of the AIS begin with `!`.
//! Source: the field lists of the u-blox M8 protocol specification (UBX-13003221) and of gpsd's "NMEA Revealed".

use crate::geodesy::LatLon;

/// The content of a sentence, in the units of this program.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Sentence {
    /// GGA, GNS, RMC, GLL: a position.
    Position {
        kind: PositionKind,
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

/// The sentences with a position, from the one that says least about its quality to the one that says most.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum PositionKind {
    Gll,
    Rmc,
    Gns,
    Gga,
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

/// Longest line that is taken: the standard allows 82 with its ends, receivers of many digits go beyond, and a line may have a tag
/// block, or several sentences where a line's end was lost.
pub const MAX_LINE: usize = 512;

const KNOT_M_S: f64 = 1852.0 / 3600.0;

pub fn checksum(body: &[u8]) -> u8 {
    body.iter().fold(0, |sum, b| sum ^ b)
}

/// `body` as a line: `$body*hh` and the line's end.
pub fn line(body: &str) -> String {
    format!("${body}*{:02X}\r\n", checksum(body.as_bytes()))
}

/// The sentences of a line, each without its tag block and without a byte order mark before it. What has no beginning of a sentence,
/// such as the rest of a line that was cut, is returned as it is.
pub fn sentences(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";
    let mut rest = line.strip_prefix(BYTE_ORDER_MARK).unwrap_or(line).trim_ascii_start();
    std::iter::from_fn(move || {
        while let Some(tagged) = rest.strip_prefix(b"\\")
            && let Some(end) = tagged.iter().position(|byte| *byte == b'\\')
        {
            rest = tagged.get(end + 1..)?;
        }
        let next =
            rest.iter().skip(1).position(|byte| matches!(byte, b'$' | b'!' | b'\\')).map_or(rest.len(), |at| at + 1);
        let (sentence, more) = rest.split_at_checked(next)?;
        rest = more;
        (!sentence.is_empty()).then_some(sentence)
    })
}

/// The fields of a sentence whose checksum is right: talker with formatter first.
pub fn fields(sentence: &[u8]) -> Result<Vec<&str>, NmeaError> {
    let text = std::str::from_utf8(sentence).map_err(|_| NmeaError::NoSentence)?;
    // Some receivers write a zero byte behind the sum.
    let text = text.trim_matches(|c: char| c.is_whitespace() || c == '\0');
    let (body, sum) = text.strip_prefix('$').and_then(|t| t.split_once('*')).ok_or(NmeaError::NoSentence)?;
    let sum = (sum.len() == 2).then(|| u8::from_str_radix(sum, 16).ok()).flatten().ok_or(NmeaError::Checksum)?;
    if sum != checksum(body.as_bytes()) {
        return Err(NmeaError::Checksum);
    }
    Ok(body.split(',').collect())
}

/// The two letters of who speaks, such as `GP`; a maker's own sentences have none.
pub fn talker(sentence: &[u8]) -> Option<&str> {
    let talker = sentence.strip_prefix(b"$")?.get(..2).filter(|letters| !letters.starts_with(b"P"))?;
    std::str::from_utf8(talker).ok()
}

/// Parses a sentence; empty for one that is not used here.
pub fn parse(sentence: &[u8]) -> Result<Vec<Sentence>, NmeaError> {
    let all = fields(sentence)?;
    let f = |i: usize| all.get(i).copied().unwrap_or("");
    // `P` and a maker begin a sentence of his own, such as `PGRMC`.
    let formatter = f(0).get(2..).filter(|_| !f(0).starts_with('P')).unwrap_or("");
    Ok(match formatter {
        "GGA" => vec![gga(&f)?],
        "GNS" => vec![gns(&f)?],
        "RMC" => rmc(&f)?,
        "GLL" => vec![gll(&f)?],
        "VTG" if f(9) != "N" => motion(f(5), f(1))?.into_iter().collect(),
        "HDT" => degrees(f(1))?.map(Sentence::Heading).into_iter().collect(),
        // The second field of THS says how it is known: E is estimated, M typed in, S simulated, V not valid.
        "THS" if !matches!(f(2), "E" | "M" | "S" | "V") => degrees(f(1))?.map(Sentence::Heading).into_iter().collect(),
        "ZDA" => time(f(1))?.map(Sentence::Time).into_iter().collect(),
        _ => Vec::new(),
    })
}

fn gga<'a>(f: &impl Fn(usize) -> &'a str) -> Result<Sentence, NmeaError> {
    // Quality 0 is none, 6 estimated, 7 typed in, 8 simulated: nothing that a vehicle should be sent to. 9 is that of NovAtel's receivers
    // with corrections of a satellite.
    let quality = f(6);
    let is_corrected = matches!(quality, "2" | "4" | "5" | "9");
    if !is_corrected && !matches!(quality, "1" | "3") {
        return Ok(Sentence::NoPosition);
    }
    let hdop = number(f(8))?.filter(|h| *h > 0.0);
    position(PositionKind::Gga, [f(2), f(3), f(4), f(5)], f(1), hdop, is_corrected)
}

/// GNS has a letter of its mode for each system of satellites.
fn gns<'a>(f: &impl Fn(usize) -> &'a str) -> Result<Sentence, NmeaError> {
    let is_corrected = f(6).contains(['D', 'R', 'F', 'P']);
    if !is_corrected && !f(6).contains('A') {
        return Ok(Sentence::NoPosition);
    }
    let hdop = number(f(8))?.filter(|h| *h > 0.0);
    position(PositionKind::Gns, [f(2), f(3), f(4), f(5)], f(1), hdop, is_corrected)
}

/// Whether a position of RMC or GLL is measured, by its status and its mode: E is estimated, M typed in, S simulated, N none.
fn is_measured(status: &str, mode: &str) -> bool {
    status == "A" && !matches!(mode, "E" | "M" | "S" | "N")
}

fn is_mode_corrected(mode: &str) -> bool {
    matches!(mode, "D" | "R" | "F" | "P")
}

fn rmc<'a>(f: &impl Fn(usize) -> &'a str) -> Result<Vec<Sentence>, NmeaError> {
    if !is_measured(f(2), f(12)) {
        return Ok(vec![Sentence::NoPosition]);
    }
    let at = position(PositionKind::Rmc, [f(3), f(4), f(5), f(6)], f(1), None, is_mode_corrected(f(12)))?;
    // The position counts even if the way over ground makes no sense.
    let motion = motion(f(7), f(8)).unwrap_or_default();
    Ok(std::iter::once(at).chain(motion).collect())
}

fn gll<'a>(f: &impl Fn(usize) -> &'a str) -> Result<Sentence, NmeaError> {
    if !is_measured(f(6), f(7)) {
        return Ok(Sentence::NoPosition);
    }
    position(PositionKind::Gll, [f(1), f(2), f(3), f(4)], f(5), None, is_mode_corrected(f(7)))
}

fn position(
    kind: PositionKind,
    [lat, ns, lon, ew]: [&str; 4],
    utc: &str,
    hdop: Option<f64>,
    is_corrected: bool,
) -> Result<Sentence, NmeaError> {
    let place = place(lat, ns, lon, ew)?.ok_or(NmeaError::Field)?;
    Ok(Sentence::Position { kind, place, utc_s: time(utc)?, hdop, is_corrected })
}

fn motion(knots: &str, course_deg: &str) -> Result<Option<Sentence>, NmeaError> {
    let Some(knots) = number(knots)? else { return Ok(None) };
    let (speed_m_s, course_deg) = (knots * KNOT_M_S, number(course_deg)?);
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

/// Address of a modem in the water, as its make counts them.
pub type ModemAddress = u8;

/// The position of another modem as a USBL head measured it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UsblLine {
    pub remote: ModemAddress,
    pub range_m: Option<f64>,
    /// Clockwise from north, rad, -pi..=pi, and above the horizontal, rad; `None` if only the range is good.
    pub direction_rad: Option<(f64, f64)>,
    /// Expected error of the position, metres; of directions alone, rad.
    pub accuracy: f64,
    /// How long ago it was measured, seconds.
    pub age_s: f64,
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn sentences_of_receivers_are_read() {
        // From the u-blox M8 protocol specification.
        let gga = b"$GPGGA,092725.00,4717.11399,N,00833.91590,E,1,08,1.01,499.6,M,48.0,M,,*5B";
        let [Sentence::Position { place, utc_s, hdop, is_corrected, .. }] = parse(gga).unwrap()[..] else { panic!() };
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
        assert_eq!(parse(hdt.replace("\r\n", "\0\r\n").as_bytes()), parse(hdt.as_bytes()));
        for passed_over in ["PGRMC,A,218.8,100,6378137.000", "HETHS,12.0,S", "GPVTG,77.52,T,,M,0.004,N,0.008,K,N"] {
            assert_eq!(parse(line(passed_over).as_bytes()), Ok(vec![]), "{passed_over}");
        }
        let aft = line("GPRMC,083559.00,A,4717.11437,N,00833.91522,E,0.004,-12.0,091202,,,A");
        assert!(matches!(parse(aft.as_bytes()).unwrap()[..], [Sentence::Position { .. }]), "a course below 0");
    }

    #[test]
    fn a_wrong_sentence_is_refused_with_the_reason() {
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

    #[test]
    fn positions_of_other_sentences_and_talkers_are_read() {
        let place = "4717.11399,N,00833.91590,E";
        let said = [
            format!("GNGNS,092725.00,{place},AAN,12,0.9,499.6,48.0,,,S"),
            format!("GLGNS,092725.00,{place},NRN,12,0.9,499.6,48.0,,,S"),
            format!("GBGLL,{place},092725.00,A,A"),
            format!("GQGLL,{place},092725.00,A,D"),
            format!("GAGGA,092725.00,{place},9,08,1.01,499.6,M,48.0,M,,"),
        ]
        .map(|body| match parse(line(&body).as_bytes()).unwrap()[..] {
            [Sentence::Position { kind, utc_s: Some(34_045.0), is_corrected, .. }] => (kind, is_corrected),
            ref other => panic!("{body}: {other:?}"),
        });
        use PositionKind::*;
        assert_eq!(said, [(Gns, false), (Gns, true), (Gll, false), (Gll, true), (Gga, true)]);
        for none in [format!("GNGNS,,{place},NN,,,,,,,"), format!("GPGLL,{place},,V,N"), format!("GPGLL,{place},,A,E")]
        {
            assert_eq!(parse(line(&none).as_bytes()), Ok(vec![Sentence::NoPosition]), "{none}");
        }
    }

    #[test]
    fn a_line_is_split_into_sentences_without_their_prefixes() {
        let split =
            |text: &str| sentences(text.as_bytes()).map(|s| String::from_utf8(s.to_vec()).unwrap()).collect::<Vec<_>>();
        assert_eq!(split(r"\s:GP0001,c:1790000000*25\$GPGGA,1*00"), ["$GPGGA,1*00"]);
        assert_eq!(split("\u{FEFF}$GPGGA,1*00"), ["$GPGGA,1*00"]);
        assert_eq!(split("$GPGGA,1*00$GPRMC,2*00!AIVDM,3*00"), ["$GPGGA,1*00", "$GPRMC,2*00", "!AIVDM,3*00"]);
        assert_eq!(split("$GPGGA,10$GPRMC,2*00"), ["$GPGGA,10", "$GPRMC,2*00"], "the first one is cut");
        assert_eq!(split("9,M,,*5B$GPRMC,2*00"), ["9,M,,*5B", "$GPRMC,2*00"]);
        assert_eq!(
            (split(""), split("garbage"), split(r"\half")),
            (vec![], vec!["garbage".to_owned()], vec![r"\half".to_owned()])
        );
        let lower = line("GPRMC,083559.00,A,4717.11437,N,00833.91522,E,0.004,77.52,091202,,,A").to_lowercase();
        let lower = format!(
            "$GPRMC,083559.00,A,4717.11437,N,00833.91522,E,0.004,77.52,091202,,,A{}",
            &lower[lower.find('*').unwrap()..]
        );
        assert!(parse(lower.as_bytes()).is_ok(), "{lower}");
    }

    proptest! {
        #[test]
        fn any_line_is_split(
            bytes in proptest::collection::vec(prop_oneof![Just(b'$'), Just(b'!'), Just(b'\\'), any::<u8>()], 0..130),
        ) {
            prop_assert!(sentences(&bytes).map(<[u8]>::len).sum::<usize>() <= bytes.len());
        }

        #[test]
        fn any_bytes_are_read_or_refused(bytes in proptest::collection::vec(any::<u8>(), 0..130)) {
            let _ = parse(&bytes);
        }

        #[test]
        fn mutated_lines_with_a_right_checksum_give_only_valid_values(
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
