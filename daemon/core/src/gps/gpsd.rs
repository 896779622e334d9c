//! gpsd's JSON protocol.
//!
//! gpsd begins with a `VERSION` object; [`WATCH`] requests reports; each report is an object on a line of its own. The
//! reader uses `TPV` (time, position, velocity) and the heading of `ATT`. Source: gpsd_json(5).

use crate::geodesy::LatLon;
use crate::nmea::{PositionKind, Sentence};
use serde_json::{Map, Value};

/// The request that makes gpsd send reports.
pub const WATCH: &[u8] = b"?WATCH={\"enable\":true,\"json\":true};\n";

/// Longest line that is taken: a sky view of many satellites has some kilobytes.
pub const MAX_LINE: usize = 16_384;

/// The content of a report, and the standard deviation of its position in metres if it has one.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Said {
    /// As sentences of NMEA 0183 would.
    pub sentences: Vec<Sentence>,
    pub sigma_m: Option<f64>,
    /// The receiver that gpsd has it from.
    pub device: Option<String>,
}

/// The errors of gpsd are taken for bounds at 95 %: 1.96 standard deviations. Releases before 3.20 say so, later ones that the certainty
/// is unknown.
const CONFIDENCE: f64 = 1.96;

/// The members of a report; units of gpsd: degrees, metres, metres a second.
struct Report(Map<String, Value>);

impl Report {
    /// The objects of a line; `None` for the rest of a line that is none.
    fn all_of(line: &[u8]) -> Vec<Option<Self>> {
        let objects = serde_json::Deserializer::from_slice(line).into_iter();
        objects.map(|object| object.ok().map(Self)).collect()
    }

    fn text(&self, name: &str) -> Option<&str> {
        self.0.get(name)?.as_str()
    }

    fn number(&self, name: &str) -> Option<f64> {
        self.0.get(name)?.as_f64()
    }

    /// An angle clockwise from north, radians; `None` if it is none.
    fn angle_rad(&self, name: &str) -> Option<f64> {
        self.number(name).filter(|degrees| (0.0..=360.0).contains(degrees)).map(f64::to_radians)
    }

    fn is_absent(&self, name: &str) -> bool {
        self.0.get(name).is_none_or(Value::is_null)
    }
}

/// A line in which numbers that are none, as releases before 3.20 write them, are `null`.
fn without_nan(line: &[u8]) -> Vec<u8> {
    const NAMES: [&[u8]; 4] = [b"-nan", b"nan", b"-inf", b"inf"];
    let (mut out, mut rest, mut is_in_text) = (Vec::with_capacity(line.len()), line, false);
    while let Some((&byte, after)) = rest.split_first() {
        let begins = |name: &&&[u8]| rest.get(..name.len()).is_some_and(|head| head.eq_ignore_ascii_case(name));
        if let Some(name) = NAMES.iter().find(begins).filter(|_| !is_in_text) {
            out.extend_from_slice(b"null");
            rest = rest.get(name.len()..).unwrap_or_default();
            continue;
        }
        is_in_text ^= byte == b'"' && out.last() != Some(&b'\\');
        out.push(byte);
        rest = after;
    }
    out
}

/// Parses a line, which may have several reports where an end of line was lost; `None` for what is no report or has an impossible
/// position.
pub fn all_of(line: &[u8]) -> Vec<Option<Said>> {
    let mut reports = Report::all_of(line);
    if reports.iter().any(Option::is_none) {
        reports = Report::all_of(&without_nan(line));
    }
    reports.into_iter().map(|report| said_by(&report?)).collect()
}

fn said_by(report: &Report) -> Option<Said> {
    match report.text("class")? {
        "TPV" => position(report).map(|said| Said { device: report.text("device").map(str::to_owned), ..said }),
        "ATT" => Some(Said { sentences: heading(report), ..Said::default() }),
        _ => Some(Said::default()),
    }
}

fn heading(report: &Report) -> Vec<Sentence> {
    report.angle_rad("heading").map(Sentence::Heading).into_iter().collect()
}

/// The position of a report. A course, a speed, a heading or an error that cannot be is left out.
fn position(r: &Report) -> Option<Said> {
    let status = r.number("status").unwrap_or(0.0) as u8;
    // Status 5 is dead reckoning, 8 simulated; 6 is dead reckoning with satellites.
    let is_none = r.number("mode").unwrap_or(0.0) < 2.0 || matches!(status, 5 | 8);
    if is_none || r.is_absent("lat") || r.is_absent("lon") {
        return Some(Said { sentences: vec![Sentence::NoPosition], ..Said::default() });
    }
    let place = LatLon::new(r.number("lat")?, r.number("lon")?)?;
    let utc_s = r.text("time").and_then(time_of_day);
    let is_corrected = matches!(status, 2..=4);
    let mut sentences = vec![Sentence::Position { kind: PositionKind::Gga, place, utc_s, hdop: None, is_corrected }];
    let speed = r.number("speed").filter(|speed| (0.0..200.0).contains(speed));
    sentences.extend(speed.map(|speed_m_s| Sentence::Motion { speed_m_s, course_rad: r.angle_rad("track") }));
    sentences.extend(heading(r));
    let error = r.number("eph").or_else(|| Some(r.number("epx")?.hypot(r.number("epy")?)));
    let sigma_m = error.filter(|e| e.is_finite() && *e > 0.0).map(|e| e / CONFIDENCE);
    Some(Said { sentences, sigma_m, device: None })
}

/// Seconds of the day of `2005-06-08T10:34:48.283Z`.
fn time_of_day(iso: &str) -> Option<f64> {
    let mut parts = iso.split_once('T')?.1.trim_end_matches('Z').split(':').map(|p| p.parse::<f64>().ok());
    let (h, m, s) = (parts.next()??, parts.next()??, parts.next()??);
    let is_time = (0.0..24.0).contains(&h) && (0.0..60.0).contains(&m) && (0.0..61.0).contains(&s);
    is_time.then_some(h * 3600.0 + m * 60.0 + s)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The first report of a line.
    fn parse(line: &[u8]) -> Option<Said> {
        all_of(line).into_iter().next().flatten()
    }

    #[test]
    fn reports_that_share_a_line_are_all_read() {
        let nan = r#"{"class":"SKY","hdop":nan}"#;
        let read = |line: &str| all_of(line.as_bytes()).iter().map(Option::is_some).collect::<Vec<_>>();
        assert_eq!(read(&[TPV, nan, TPV].concat()), [true; 3]);
        assert_eq!(all_of([TPV, TPV].concat().as_bytes())[1], parse(TPV.as_bytes()));
        assert_eq!(read(&[TPV, &TPV[..40]].concat()), [true, false]);
    }

    const TPV: &str = r#"{"class":"TPV","device":"/dev/pts/1","time":"2005-06-08T10:34:48.283Z","ept":0.005,"lat":46.498293369,"lon":7.567411672,"alt":1343.127,"eph":36.000,"epv":32.321,"track":10.3788,"speed":0.091,"climb":-0.085,"mode":3}"#;

    #[test]
    fn a_report_of_the_manual_is_read() {
        let said = parse(TPV.as_bytes()).unwrap();
        let [Sentence::Position { place, utc_s, .. }, Sentence::Motion { speed_m_s, .. }] = said.sentences[..] else {
            panic!("{said:?}")
        };
        assert!((place.lat_deg - 46.498_293_369).abs() < 1e-9);
        assert_eq!((utc_s, speed_m_s), (Some(38_088.283), 0.091));
        assert!((said.sigma_m.unwrap() - 36.0 / 1.96).abs() < 1e-9);
        assert_eq!(parse(br#"{"class":"VERSION","release":"3.25","proto_major":3}"#), Some(Said::default()));
        let none = parse(br#"{"class":"TPV","mode":1}"#).unwrap();
        assert_eq!(none.sentences, [Sentence::NoPosition]);
        let with_status = |status: u8| {
            let text = format!(r#"{{"class":"TPV","mode":3,"status":{status},"lat":1.5,"lon":2.5}}"#);
            matches!(parse(text.as_bytes()).unwrap().sentences[..], [Sentence::Position { .. }])
        };
        let used: Vec<u8> = (0..10).filter(|&status| with_status(status)).collect();
        assert_eq!(used, [0, 1, 2, 3, 4, 6, 7, 9], "5 is dead reckoning alone, 8 is simulated");
        assert_eq!(
            parse(br#"{"class":"ATT","heading":90.0}"#).unwrap().sentences,
            [Sentence::Heading(90f64.to_radians())]
        );
    }

    /// The report of a position with these members beside it.
    fn tpv(members: &str) -> Option<Vec<Sentence>> {
        let text = format!(r#"{{"class":"TPV","device":"/dev/nan","mode":3{members}}}"#);
        parse(text.as_bytes()).map(|said| said.sentences)
    }

    #[test]
    fn impossible_positions_are_refused_and_missing_ones_are_none() {
        assert_eq!(tpv(r#","lat":95,"lon":0"#), None);
        assert_eq!(tpv(r#","lat":"60.5","lon":5.1"#), None);
        assert_eq!(parse(b"$GPGGA"), None);
        for none in ["", r#","lat":1"#, r#","lat":null,"lon":2"#, r#","lat":nan,"lon":NaN"#] {
            assert_eq!(tpv(none), Some(vec![Sentence::NoPosition]), "{none}");
        }
    }

    #[test]
    fn a_side_value_that_cannot_be_does_not_cost_the_position() {
        for bad in [
            r#""speed":-0.5"#,
            r#""speed":1e9"#,
            r#""speed":nan"#,
            r#""heading":361"#,
            r#""heading":-nan"#,
            r#""track":nan"#,
            r#""eph":inf"#,
            r#""status":"DGPS""#,
        ] {
            let said = tpv(&format!(r#","lat":1.5,"lon":2.5,{bad}"#)).unwrap();
            assert!(matches!(said[..], [Sentence::Position { .. }]), "{bad} {said:?}");
        }
        let said = tpv(r#","lat":1.5,"lon":2.5,"speed":1.0,"track":nan"#).unwrap();
        assert!(matches!(said[1], Sentence::Motion { course_rad: None, .. }), "{said:?}");
    }

    #[test]
    fn reports_of_other_classes_are_passed_over() {
        for other in
            [r#"{"class":"AIS","status":"Under way","heading":"511","lat":"n/a"}"#, r#"{"class":"SKY","hdop":nan}"#]
        {
            assert_eq!(parse(other.as_bytes()), Some(Said::default()), "{other}");
        }
    }

    proptest! {
        #[test]
        fn mutated_reports_are_read_or_refused(at in 0usize..200, byte: u8) {
            let mut bytes = TPV.as_bytes().to_vec();
            let at = at % bytes.len();
            bytes[at] = byte;
            for sentence in parse(&bytes).unwrap_or_default().sentences {
                if let Sentence::Position { place, .. } = sentence {
                    prop_assert!(LatLon::new(place.lat_deg, place.lon_deg).is_some());
                }
            }
        }

        #[test]
        fn any_bytes_are_read_or_refused(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
            let _ = parse(&bytes);
        }
    }
}
