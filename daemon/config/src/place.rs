//! Where instruments are: `serial:DEVICE:BAUD`, `tcp:HOST:PORT` and the like.

use super::Config;
use scenecast_core::LatLon;
use scenecast_core::PortAddress;
use scenecast_core::UserError;
use std::path::PathBuf;

/// Reads `kind:what`; `kinds` are the allowed ones. The error names the key.
fn parse(key: &str, text: &str, kinds: &[&str]) -> Result<PortAddress, UserError> {
    let shown: Vec<String> = kinds.iter().map(|k| form(k)).collect();
    let wrong = || UserError::Input(format!("{key} = \"{text}\" is not allowed: it takes {}", shown.join(", ")));
    let (kind, what) = text.split_once(':').filter(|(k, w)| kinds.contains(k) && !w.is_empty()).ok_or_else(wrong)?;
    let address = || {
        let port = what.rsplit_once(':').filter(|(host, _)| !host.is_empty()).and_then(|(_, p)| p.parse::<u16>().ok());
        port.filter(|p| *p > 0).map(|_| what.to_owned()).ok_or_else(wrong)
    };
    Ok(match kind {
        "serial" => match what.rsplit_once(':') {
            Some((device, baud)) => {
                let baud = baud.parse().ok().filter(|b| (300..=4_000_000).contains(b)).ok_or_else(wrong)?;
                PortAddress::Serial(device.to_owned(), baud)
            }
            None => return Err(wrong()),
        },
        "tcp" | "gpsd" => PortAddress::Connect(address()?),
        "udp" => PortAddress::Datagrams(address()?, String::new()),
        "udp-to" => PortAddress::Datagrams(String::new(), address()?),
        _ => PortAddress::File(PathBuf::from(what)),
    })
}

fn form(kind: &str) -> String {
    match kind {
        "serial" => "serial:DEVICE:BAUD".to_owned(),
        "file" => "file:PATH".to_owned(),
        "udp" => "udp:ADDRESS:PORT".to_owned(),
        kind => format!("{kind}:HOST:PORT"),
    }
}

/// Where the autopilot is; `None` for a kind that is nowhere.
pub fn autopilot_place(config: &Config) -> Result<Option<PortAddress>, UserError> {
    let parse = |kinds| parse("autopilot.port", &config.autopilot.port, kinds).map(Some);
    match config.autopilot.kind.as_str() {
        "mavlink" | "nmea" => parse(&["serial", "udp", "udp-to", "tcp"]),
        "log" => parse(&["file"]),
        _ => Ok(None),
    }
}

/// Where the GPS and the compass of the surface are, if there are any.
pub fn position_places(config: &Config) -> Result<[Option<PortAddress>; 2], UserError> {
    let place = |key, text: &String, kinds: &[&str]| (!text.is_empty()).then(|| parse(key, text, kinds)).transpose();
    Ok([
        place("position.gps", &config.position.gps, &["serial", "tcp", "gpsd"])?,
        place("position.compass", &config.position.compass, &["serial", "tcp"])?,
    ])
}

/// Whether the GPS is behind a gpsd.
pub fn is_gpsd(config: &Config) -> bool {
    config.position.gps.starts_with("gpsd:")
}

/// The origin of the world that is configured, if any.
pub fn origin(config: &Config) -> Result<Option<LatLon>, UserError> {
    let [lat_deg, lon_deg] = config.mission.origin_deg;
    if [lat_deg, lon_deg] == [0.0; 2] {
        return Ok(None);
    }
    let given = format!("mission.origin_deg = {:?}", config.mission.origin_deg);
    let rule = "latitude from -90 to 90, longitude from -180 to 180 degrees, or both 0";
    let place = LatLon::new(lat_deg, lon_deg);
    place.map(Some).ok_or_else(|| UserError::Input(format!("{given} is not allowed: it takes {rule}")))
}

/// Whether every instrument is somewhere, and what needs another has it.
pub(super) fn check(config: &Config) -> Result<(), UserError> {
    origin(config)?;
    autopilot_place(config)?;
    let [gps, _] = position_places(config)?;
    if config.position.follow && (gps.is_none() || config.autopilot.kind == "none") {
        let what = "position.follow = true is not allowed without position.gps and an autopilot.kind";
        return Err(UserError::Input(what.to_owned()));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_read_and_what_is_none_is_refused_with_what_is_allowed() {
        let kinds = ["serial", "tcp", "gpsd"];
        let parse = |text| parse("position.gps", text, &kinds);
        assert_eq!(parse("serial:/dev/ttyUSB0:4800").unwrap(), PortAddress::Serial("/dev/ttyUSB0".to_owned(), 4800));
        assert_eq!(parse("gpsd:localhost:2947").unwrap(), PortAddress::Connect("localhost:2947".to_owned()));
        for wrong in ["", "gpsd", "tcp:", "tcp:host", "tcp:host:99999", "serial:/dev/x", "serial:/dev/x:1", "udp:a:1"] {
            let said = parse(wrong).unwrap_err().to_string();
            assert!(said.contains("position.gps") && said.contains("serial:DEVICE:BAUD, tcp:HOST:PORT"), "{said}");
        }
    }
}
