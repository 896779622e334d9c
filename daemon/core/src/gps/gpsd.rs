//! gpsd's JSON protocol.
//!
//! gpsd begins with a `VERSION` object; [`WATCH`] requests reports; each report is an object on a line of its own. The
//! reader uses `TPV` (time, position, velocity) and the heading of `ATT`. Source: gpsd_json(5).

use crate::geodesy::LatLon;
use crate::nmea::{PositionKind, Sentence};
use serde::Deserialize;

/// The request that makes gpsd send reports.
pub const WATCH: &[u8] = b"?WATCH={\"enable\":true,\"json\":true};\n";

/// Longest line that is taken: a sky view of many satellites has some kilobytes.
pub const MAX_LINE: usize = 16_384;

/// Members of a report that are of use; units of gpsd: degrees, metres, metres a second.
#[derive(Deserialize)]
struct Report {
    class: String,
    device: Option<String>,
    mode: Option<u8>,
    status: Option<u8>,
    time: Option<String>,
    lat: Option<f64>,
    lon: Option<f64>,
    epx: Option<f64>,
    epy: Option<f64>,
    eph: Option<f64>,
    speed: Option<f64>,
    track: Option<f64>,
    heading: Option<f64>,
}

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

/// Parses a line; `None` if it is no report or has impossible values.
pub fn parse(line: &[u8]) -> Option<Said> {
    let report: Report = serde_json::from_slice(line).ok()?;
    match report.class.as_str() {
        "TPV" => position(&report).map(|said| Said { device: report.device, ..said }),
        "ATT" => Some(Said { sentences: heading(report.heading)?, ..Said::default() }),
        _ => Some(Said::default()),
    }
}

fn heading(degrees: Option<f64>) -> Option<Vec<Sentence>> {
    let Some(degrees) = degrees else { return Some(Vec::new()) };
    (0.0..=360.0).contains(&degrees).then(|| vec![Sentence::Heading(degrees.to_radians())])
}

fn position(r: &Report) -> Option<Said> {
    // Status 5 is dead reckoning, 8 simulated; 6 is dead reckoning with satellites.
    if r.mode.unwrap_or(0) < 2 || matches!(r.status, Some(5 | 8)) {
        return Some(Said { sentences: vec![Sentence::NoPosition], ..Said::default() });
    }
    let place = LatLon::new(r.lat?, r.lon?)?;
    let utc_s = r.time.as_deref().and_then(time_of_day);
    let is_corrected = matches!(r.status, Some(2..=4));
    let mut sentences = vec![Sentence::Position { kind: PositionKind::Gga, place, utc_s, hdop: None, is_corrected }];
    if let Some(speed_m_s) = r.speed {
        let course_rad = r.track.filter(|t| (0.0..=360.0).contains(t)).map(f64::to_radians);
        (0.0..200.0).contains(&speed_m_s).then(|| sentences.push(Sentence::Motion { speed_m_s, course_rad }))?;
    }
    sentences.extend(heading(r.heading)?);
    let error = r.eph.or_else(|| Some(r.epx?.hypot(r.epy?)));
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

    #[test]
    fn impossible_values_are_refused() {
        assert_eq!(parse(b"{\"class\":\"TPV\",\"mode\":3,\"lat\":95,\"lon\":0}"), None);
        assert_eq!(parse(b"{\"class\":\"TPV\",\"mode\":3,\"lat\":1}"), None);
        assert_eq!(parse(b"{\"class\":\"TPV\",\"mode\":3,\"lat\":NaN,\"lon\":0}"), None);
        assert_eq!(parse(b"{\"class\":\"TPV\",\"mode\":3,\"lat\":1,\"lon\":1,\"speed\":1e9}"), None);
        assert_eq!(parse(b"$GPGGA"), None);
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
