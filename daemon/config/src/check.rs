//! Conditions that several keys must satisfy together; those of the modem, and the address of its port.

use crate::sections::key::Key;
use crate::{
    Authenticate, AutopilotKind, CalibrationSource, CameraSource, Config, DepthSource, HostPort, LabelMessage,
    LabelSource, Modem, ModemKind, NavigationSource, RosName, S2cMode,
};
use scenecast_core::{
    FlowControl, MicromodemRate, PortAddress, S2C_BURST_FRAME_BYTES, S2C_INSTANT_BYTES, SerialFormat, SerialLine,
    UserError,
};

/// The longest time on air of a frame, seconds.
const MAX_FRAME_S: f64 = 55.0;

/// # Errors
/// One line that names a key, its value and the allowed values.
pub(crate) fn check_together(config: &Config) -> Result<(), UserError> {
    check_shares("link.shares", config.link.shares.0.iter().copied(), config)?;
    check_shares("map.layer_shares", config.map.layer_shares.values().copied(), config)?;
    let link = &config.link;
    if link.key_file.is_none() && link.encrypt {
        let advice = "it needs a key; set link.key_file to a file that scenecast key new has written";
        return Err(UserError::Input(format!(
            "link.encrypt = true is not allowed with an empty link.key_file: {advice}"
        )));
    }
    check_modem(config)?;
    check_ports(config)?;
    check_camera(config)?;
    check_labels(config)?;
    check_frame(config)?;
    check_airtime(config)
}

fn check_shares(name: &str, shares: impl Iterator<Item = u8>, config: &Config) -> Result<(), UserError> {
    let sum: u32 = shares.map(u32::from).sum();
    if sum <= 100 {
        return Ok(());
    }
    let value = Key::find(name).map(|key| key.value(config).to_string()).unwrap_or_default();
    Err(UserError::Input(format!("{name} = {value} is not allowed: the sum is {sum} %; allowed: 100 % or less")))
}

/// An autopilot has a port of its kind, and following has what it needs.
fn check_ports(config: &Config) -> Result<(), UserError> {
    let autopilot = &config.autopilot;
    let is_file = matches!(autopilot.port, Some(PortAddress::File(_)));
    let allowed = match autopilot.kind {
        AutopilotKind::Mavlink | AutopilotKind::Nmea if autopilot.port.is_none() || is_file => {
            "serial:DEVICE:BAUD, udp:ADDRESS:PORT, udp-to:HOST:PORT, tcp:HOST:PORT"
        }
        AutopilotKind::Log if !is_file => "file:PATH",
        _ => return check_follow(config),
    };
    let port = Key::find("autopilot.port").map(|key| key.value(config).to_string()).unwrap_or_default();
    let given = format!("autopilot.port = {port} is not allowed with autopilot.kind = \"{}\"", autopilot.kind);
    Err(UserError::Input(format!("{given}; allowed: {allowed}")))
}

/// A calibration is given once, and belongs to a camera that has one.
fn check_optics(config: &Config) -> Result<(), UserError> {
    let c = &config.camera;
    let refuse = |name: &str, allowed: &str| {
        let value = Key::find(name).map(|key| key.value(config).to_string()).unwrap_or_default();
        let source = camera(config);
        Err(UserError::Input(format!(
            "{name} = {value} is not allowed with camera.source = {source}; allowed: {allowed}"
        )))
    };
    let (is_topic, has_matrix) = (matches!(c.source, CameraSource::Ros2(_)), c.matrix != [0.0; 4]);
    let is_rehearsal = c.source == CameraSource::Rehearsal;
    match c.calibration {
        CalibrationSource::Beside => {}
        _ if has_matrix => {
            let text = "camera.matrix is not allowed beside camera.calibration; set one of them";
            return Err(UserError::Input(text.to_owned()));
        }
        CalibrationSource::Ros2(_) if !is_topic => {
            return refuse("camera.calibration", "\"file:FILE\", \"none\" or \"\"; a topic needs a camera of ROS 2");
        }
        _ if is_rehearsal => return refuse("camera.calibration", "\"\""),
        _ => {}
    }
    if has_matrix && is_rehearsal {
        return refuse("camera.matrix", "[0, 0, 0, 0]");
    }
    if c.depth != DepthSource::None {
        if !c.source.is_live() {
            return refuse("camera.depth", "\"\"; distances belong to a live camera, or are in the folder of tum:DIR");
        }
        let is_calibrated = match c.calibration {
            CalibrationSource::Beside => is_topic || has_matrix,
            CalibrationSource::None => false,
            CalibrationSource::File(_) | CalibrationSource::Ros2(_) => true,
        };
        if !is_calibrated {
            return refuse("camera.depth", "\"\", unless camera.calibration or camera.matrix is set");
        }
    }
    match c.bits {
        0 if !is_topic => refuse("camera.bits", "8 to 16; only a camera of ROS 2 can find them out"),
        1..=7 => Err(UserError::Input(format!("camera.bits = {} is not allowed; allowed: 0, or 8 to 16", c.bits))),
        _ => Ok(()),
    }
}

/// Names of topics begin with a slash.
fn check_topics(config: &Config) -> Result<(), UserError> {
    let c = &config.camera;
    let topic = |is_topic: bool, name: &str| {
        let key = Key::find(name).filter(|_| is_topic);
        let value = key.map(|key| key.value(config).to_string()).unwrap_or_default();
        let text = value.trim_matches('"').split_once(':').map(|(_, topic)| topic.to_owned()).unwrap_or_default();
        match !is_topic || RosName::parse(&text).is_some() {
            true => Ok(()),
            false => Err(UserError::Input(format!(
                "{name} = {value} is not allowed: a topic is such as /camera/image_raw, parts of letters, digits and underscores \
                 after slashes"
            ))),
        }
    };
    topic(matches!(c.source, CameraSource::Ros2(_)), "camera.source")?;
    topic(matches!(c.calibration, CalibrationSource::Ros2(_)), "camera.calibration")?;
    topic(c.depth != DepthSource::None, "camera.depth")?;
    topic(matches!(config.navigation.source, NavigationSource::Ros2(_)), "navigation.source")
}

/// The images of a live camera need poses and the pace of real time.
fn check_camera(config: &Config) -> Result<(), UserError> {
    if let (NavigationSource::Tf(given), None) = (&config.navigation.source, config.navigation.source.frames()) {
        return Err(UserError::Input(format!(
            "navigation.source = \"tf:{given}\" is not allowed: it takes two frames, as in \"tf:map#base_link\""
        )));
    }
    check_topics(config)?;
    check_optics(config)?;
    if !config.camera.source.is_live() {
        return check_navigation(config);
    }
    let source = camera(config);
    let has_autopilot = config.autopilot.kind != AutopilotKind::None;
    if config.navigation.source == NavigationSource::Autopilot && !has_autopilot {
        return Err(UserError::Input(format!(
            "camera.source = {source} is not allowed without poses; set autopilot.kind or navigation.source"
        )));
    }
    if config.runtime.time_scale != 1.0 {
        let scale = config.runtime.time_scale;
        return Err(UserError::Input(format!(
            "runtime.time_scale = {scale} is not allowed with camera.source = {source}; allowed: 1"
        )));
    }
    Ok(())
}

/// Without a live camera the poses of a navigation source only move the vehicle.
fn check_navigation(config: &Config) -> Result<(), UserError> {
    let source = Key::find("navigation.source").map(|key| key.value(config).to_string()).unwrap_or_default();
    let is_own = match &config.navigation.source {
        NavigationSource::Ros2(_) => matches!(config.camera.source, CameraSource::Rehearsal | CameraSource::Bag(_)),
        _ => config.camera.source == CameraSource::Rehearsal,
    };
    let (name, given, allowed) = match &config.navigation.source {
        NavigationSource::Autopilot => return Ok(()),
        NavigationSource::Tum(_) => ("camera.source", camera(config), "a live camera"),
        source if source.is_live() && !is_own => {
            ("camera.source", camera(config), "a live camera or \"\", as recordings have poses of their own")
        }
        source if source.is_live() && config.runtime.time_scale != 1.0 => {
            ("runtime.time_scale", config.runtime.time_scale.to_string(), "1")
        }
        NavigationSource::Dvl(_) | NavigationSource::Ros2(_) | NavigationSource::Tf(_) => return Ok(()),
    };
    let text = format!("{name} = {given} is not allowed with navigation.source = {source}; allowed: {allowed}");
    Err(UserError::Input(text))
}

/// Bands have no segmented images, and names of classes belong to labels of another program.
fn check_labels(config: &Config) -> Result<(), UserError> {
    let value = |name: &str| Key::find(name).map(|key| key.value(config).to_string()).unwrap_or_default();
    if matches!(config.bands.source, LabelSource::Ros2(_, Some(LabelMessage::Image))) {
        let text = format!("bands.source = {} is not allowed: an image has no place", value("bands.source"));
        return Err(UserError::Input(format!("{text}; allowed: #GridMap and #OccupancyGrid")));
    }
    if config.labels.classes.is_some() && config.labels.source == LabelSource::SceneModel {
        let text = format!("labels.classes = {} is not allowed with an empty labels.source", value("labels.classes"));
        return Err(UserError::Input(format!("{text}: the operator names the scene model's labels")));
    }
    match config.bands.source != LabelSource::SceneModel && config.bands.source == config.labels.source {
        true => Err(UserError::Input(format!(
            "bands.source = {} is that of labels.source, which gives bands too; set one of them",
            value("bands.source")
        ))),
        false => Ok(()),
    }
}

fn camera(config: &Config) -> String {
    Key::find("camera.source").map(|key| key.value(config).to_string()).unwrap_or_default()
}

fn check_follow(config: &Config) -> Result<(), UserError> {
    if config.position.follow && (config.position.gps.is_none() || config.autopilot.kind == AutopilotKind::None) {
        let text = "position.follow = true is not allowed without position.gps and an autopilot.kind";
        return Err(UserError::Input(text.to_owned()));
    }
    Ok(())
}

/// Under a key a frame ends in a tag, beside which the longest indivisible chunk must fit.
fn check_frame(config: &Config) -> Result<(), UserError> {
    let link = &config.link;
    let (least, with, chunk, or) = match (&link.key_file, link.authenticate) {
        (None, _) => return Ok(()),
        (Some(_), Authenticate::All) => {
            (48, "a link.key_file", "the vehicle's report", ", or link.authenticate = \"down\"")
        }
        (Some(_), Authenticate::Down) => (41, "a link.key_file", "a hello", ""),
    };
    let frame_bytes = crate::full_frame_bytes(config);
    if frame_bytes >= least {
        return Ok(());
    }
    let given = match config.modem.kind {
        ModemKind::Micromodem => format!("modem.rate = {} with frames of {frame_bytes} bytes", config.modem.rate),
        _ => format!("link.frame_bytes = {frame_bytes}"),
    };
    let why = format!("{chunk} does not fit a smaller frame beside the tag");
    Err(UserError::Input(format!(
        "{given} is not allowed with {with}; allowed: {least} to 1024 bytes{or}, because {why}"
    )))
}

fn check_airtime(config: &Config) -> Result<(), UserError> {
    let bits = f64::from(config.link.frame_bytes * 8 + config.modem.overhead_bits);
    for (key, rate) in [("channel.bit_rate", config.channel.bit_rate), ("modem.bit_rate", config.modem.bit_rate)] {
        if bits / rate > MAX_FRAME_S {
            let least = (bits / MAX_FRAME_S).ceil();
            let frame = config.link.frame_bytes;
            let given =
                format!("{key} = {rate}: a frame of link.frame_bytes = {frame} takes longer than {MAX_FRAME_S} s");
            return Err(UserError::Input(format!("{given}; allowed: {least} bit/s or more, or a smaller frame")));
        }
    }
    Ok(())
}

/// Highest addresses that an S2C network can have.
const S2C_HIGHEST: [u8; 7] = [2, 6, 14, 30, 62, 126, 254];
/// Highest address of a Micromodem.
const MICROMODEM_HIGHEST: u8 = 127;

/// Bytes of a full frame: the modem's unit, if it has one, or else `link.frame_bytes`.
pub fn full_frame_bytes(config: &Config) -> usize {
    match (config.modem.kind, config.modem.s2c_mode) {
        (ModemKind::S2c, S2cMode::Instant) => S2C_INSTANT_BYTES,
        (ModemKind::S2c, S2cMode::Burst) => S2C_BURST_FRAME_BYTES,
        (ModemKind::Micromodem, _) => MicromodemRate::of(config.modem.rate).frame_bytes,
        (ModemKind::Transparent | ModemKind::Tcp | ModemKind::Udp, _) => config.link.frame_bytes as usize,
    }
}

/// The addresses of modems must differ and must exist in the modems' network.
///
/// # Errors
/// A line that names the key and the allowed values.
fn check_modem(config: &Config) -> Result<(), UserError> {
    let m = &config.modem;
    check_line(m)?;
    let (highest, limit) = match m.kind {
        ModemKind::S2c => (m.highest_address, "modem.highest_address"),
        ModemKind::Micromodem => (MICROMODEM_HIGHEST, "a Micromodem's highest address"),
        ModemKind::Transparent | ModemKind::Tcp | ModemKind::Udp => return Ok(()),
    };
    let own = [config.vehicle.address];
    let vehicles = if config.link.vehicles.is_empty() { &own[..] } else { &config.link.vehicles[..] };
    if vehicles.contains(&m.surface_address) {
        let given = format!("modem.surface_address = {}", m.surface_address);
        return Err(UserError::Input(format!(
            "{given} is not allowed: it is a vehicle's address, which that vehicle's modem has too"
        )));
    }
    let all = vehicles.iter().copied().chain([m.surface_address]);
    if let Some(beyond) = all.filter(|&a| a > highest).max() {
        return Err(UserError::Input(format!("address {beyond} is not allowed: {limit} is {highest}")));
    }
    if m.kind == ModemKind::S2c && !S2C_HIGHEST.contains(&m.highest_address) {
        let given = format!("modem.highest_address = {}", m.highest_address);
        return Err(UserError::Input(format!("{given} is not allowed; allowed: one of 2, 6, 14, 30, 62, 126, 254")));
    }
    Ok(())
}

/// The bytes of frames have all values; only a Micromodem gets them as text.
fn check_line(m: &Modem) -> Result<(), UserError> {
    let seven_bits = matches!(m.serial_format, SerialFormat::SevenEvenOne | SerialFormat::SevenOddOne);
    let given = match (seven_bits, m.flow_control) {
        _ if m.kind == ModemKind::Micromodem => return Ok(()),
        (true, _) => format!("modem.serial_format = \"{}\"", m.serial_format.name()),
        (_, FlowControl::Software) => "modem.flow_control = \"software\"".to_owned(),
        _ => return Ok(()),
    };
    let kind = m.kind;
    Err(UserError::Input(format!(
        "{given} is not allowed with modem.kind = \"{kind}\", whose data has bytes of all values; allowed with micromodem"
    )))
}

/// The port of the modem.
///
/// # Errors
/// Keys that are missing or exclude each other.
pub fn modem_port(config: &Config) -> Result<PortAddress, UserError> {
    let m = &config.modem;
    let kind = m.kind;
    let text = |address: &Option<HostPort>| address.as_ref().map(HostPort::to_string).unwrap_or_default();
    let missing = |keys: &str| Err(UserError::Input(format!("modem.kind = \"{kind}\" needs {keys}")));
    match (kind, &m.device, &m.listen, &m.connect) {
        (ModemKind::Udp, _, None, None) => missing("modem.connect, modem.listen, or both"),
        (ModemKind::Udp, _, listen, connect) => Ok(PortAddress::Datagrams(text(listen), text(connect))),
        (ModemKind::Tcp, _, None, None) => missing("modem.listen or modem.connect"),
        (ModemKind::Tcp, _, Some(listen), None) => Ok(PortAddress::Listen(listen.to_string())),
        (ModemKind::Tcp, _, None, Some(connect)) => Ok(PortAddress::Connect(connect.to_string())),
        (_, Some(device), ..) if kind != ModemKind::Tcp => {
            let line =
                SerialLine { baud: m.baud, format: m.serial_format, flow: m.flow_control, rts: m.rts, dtr: m.dtr };
            Ok(PortAddress::Serial(device.display().to_string(), line))
        }
        (_, _, None, None) => missing("modem.device (a serial device) or modem.connect (HOST:PORT)"),
        (_, _, Some(listen), None) => Ok(PortAddress::Listen(listen.to_string())),
        (_, _, None, Some(connect)) => Ok(PortAddress::Connect(connect.to_string())),
        (_, _, Some(_), Some(_)) => {
            Err(UserError::Input(format!("modem.kind = \"{kind}\" takes modem.listen or modem.connect, not both")))
        }
    }
}

#[cfg(test)]
mod tests {

    #[test]
    fn a_serial_line_passes_all_bytes_of_frames() {
        let load = |sets: &[&str]| crate::load(None, &sets.iter().map(|s| (*s).to_owned()).collect::<Vec<_>>());
        for set in ["modem.serial_format=7E1", "modem.flow_control=software"] {
            let refused = load(&["modem.kind=s2c", set]).unwrap_err().to_string();
            assert!(refused.contains(&set.replace('=', " = \"")) && refused.contains("micromodem"), "{refused}");
            assert!(load(&["modem.kind=micromodem", set]).is_ok());
        }
        assert!(load(&["modem.kind=transparent", "modem.serial_format=8E1", "modem.flow_control=hardware"]).is_ok());
    }

    #[test]
    fn an_autopilot_needs_a_port_of_its_kind() {
        let load = |sets: &[&str]| crate::load(None, &sets.iter().map(|s| (*s).to_owned()).collect::<Vec<_>>());
        let refused = |sets: &[&str]| load(sets).unwrap_err().to_string();
        assert!(refused(&["autopilot.kind=nmea"]).contains("autopilot.port = \"\""));
        assert!(refused(&["autopilot.kind=log", "autopilot.port=udp:0.0.0.0:1"]).ends_with("allowed: file:PATH"));
        assert!(load(&["autopilot.kind=log", "autopilot.port=file:x"]).is_ok());
        assert!(load(&["autopilot.kind=rehearsal"]).is_ok());
        assert!(refused(&["position.follow=true"]).contains("position.gps"));
    }

    #[test]
    fn distances_and_calibrations_need_a_camera_that_has_them() {
        let load = |sets: &[&str]| crate::load(None, &sets.iter().map(|set| (*set).to_owned()).collect::<Vec<_>>());
        let refused = |sets: &[&str]| load(sets).unwrap_err().to_string();
        let live = ["camera.source=watch:x", "navigation.source=tum:p"];
        assert!(load(&[&live[..], &["camera.depth=ros2:/depth", "camera.matrix=[9, 9, 9, 9]"]].concat()).is_ok());
        assert!(refused(&[&live[..], &["camera.depth=ros2:/depth"]].concat()).contains("unless camera.calibration or"));
        let ros = ["camera.source=ros2:/image", "navigation.source=tum:p", "camera.depth=ros2:/depth"];
        assert!(load(&ros).is_ok());
        assert!(refused(&[&ros[..], &["camera.calibration=none"]].concat()).contains("unless camera.calibration or"));
        assert!(
            refused(&["camera.depth=cloud:/points"]).contains("camera.depth = \"cloud:/points\" is not allowed with")
        );
        assert!(refused(&["camera.matrix=[9, 9, 9, 9]"]).contains("allowed: [0, 0, 0, 0]"));
        assert!(refused(&[&live[..], &["camera.calibration=ros2:/info"]].concat()).contains("a topic needs a camera"));
        let both = ["camera.source=frames:x", "camera.calibration=file:c", "camera.matrix=[9, 9, 9, 9]"];
        assert!(refused(&both).contains("set one of them"));
        assert!(refused(&["camera.source=bag:x", "camera.bits=0"]).contains("camera.bits = 0 is not allowed"));
        assert!(load(&["camera.source=tum:x", "camera.bits=12"]).is_ok());
    }

    #[test]
    fn levels_of_fewer_than_eight_bits_are_refused() {
        let load = |bits: u8| {
            crate::load(
                None,
                &[
                    format!("camera.bits={bits}"),
                    "camera.source=ros2:/i".to_owned(),
                    "navigation.source=tum:p".to_owned(),
                ],
            )
        };
        for bits in 1..=7 {
            let text = load(bits).unwrap_err().to_string();
            assert_eq!(text, format!("camera.bits = {bits} is not allowed; allowed: 0, or 8 to 16"));
        }
        assert!([0, 8, 10, 16].into_iter().all(|bits| load(bits).is_ok()));
    }

    #[test]
    fn a_navigation_source_moves_a_live_camera_or_none() {
        let load = |sets: &[&str]| crate::load(None, &sets.iter().map(|s| (*s).to_owned()).collect::<Vec<_>>());
        let refused = |sets: &[&str]| load(sets).unwrap_err().to_string();
        let dvl = "navigation.source=dvl:192.168.2.95";
        assert!(load(&[dvl]).is_ok() && load(&[dvl, "camera.source=watch:x"]).is_ok());
        assert!(load(&["navigation.source=ros2:/odometry", "camera.source=bag:x"]).is_ok());
        assert!(refused(&[dvl, "camera.source=frames:x"]).contains("camera.source = \"frames:x\" is not allowed"));
        assert!(refused(&[dvl, "runtime.time_scale=5"]).ends_with("allowed: 1"));
        assert!(refused(&["navigation.source=ros2:odometry"]).contains("such as /camera/image_raw"));
        assert!(load(&["navigation.source=tf:map#base_link", "camera.source=watch:x"]).is_ok());
        assert!(refused(&["navigation.source=tf:map", "camera.source=watch:x"]).contains("two frames"));
        assert!(refused(&["navigation.source=tum:x"]).ends_with("allowed: a live camera"));
    }
}
