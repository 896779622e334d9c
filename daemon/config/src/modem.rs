//! Checks of the modem's keys, and the address of its port.

use crate::Config;
use scenecast_core::{MicromodemRate, PortAddress, S2C_BURST_FRAME_BYTES, S2C_INSTANT_BYTES, UserError};

/// Bytes of a full frame: the modem's unit where it has one, else what the configuration says.
pub fn full_frame_bytes(config: &Config) -> usize {
    match (config.modem.kind.as_str(), config.modem.s2c_mode.as_str()) {
        ("s2c", "im") => S2C_INSTANT_BYTES,
        ("s2c", _) => S2C_BURST_FRAME_BYTES,
        ("micromodem", _) => MicromodemRate::of(config.modem.rate).frame_bytes,
        _ => config.link.frame_bytes as usize,
    }
}

/// What the keys of a modem must be together.
///
/// # Errors
/// A line that names the key and what is allowed.
pub(crate) fn check(config: &Config) -> Result<(), UserError> {
    let m = &config.modem;
    if !matches!(m.kind.as_str(), "s2c" | "micromodem") {
        return Ok(());
    }
    let own = [config.vehicle.address];
    let vehicles = if config.link.vehicles.is_empty() { &own[..] } else { &config.link.vehicles[..] };
    if vehicles.contains(&m.surface_address) {
        let given = format!("modem.surface_address = {}", m.surface_address);
        return Err(UserError::Input(format!(
            "{given} is not allowed: it is a vehicle's address, and its modem has it too"
        )));
    }
    let highest = if m.kind == "s2c" { m.highest_address } else { 127 };
    let all = vehicles.iter().copied().chain([m.surface_address]);
    if let Some(beyond) = all.filter(|&a| a > highest).max() {
        let limit = if m.kind == "s2c" { "modem.highest_address" } else { "a Micromodem's highest address" };
        return Err(UserError::Input(format!("address {beyond} is not allowed: {limit} is {highest}")));
    }
    const HIGHEST: [u8; 7] = [2, 6, 14, 30, 62, 126, 254];
    if m.kind == "s2c" && !HIGHEST.contains(&m.highest_address) {
        let given = format!("modem.highest_address = {}", m.highest_address);
        return Err(UserError::Input(format!("{given} is not allowed: it takes one of 2, 6, 14, 30, 62, 126, 254")));
    }
    Ok(())
}

/// Where the modem is.
pub fn modem_port(config: &Config) -> Result<PortAddress, UserError> {
    let m = &config.modem;
    let kind = m.kind.as_str();
    let missing = |what: &str| Err(UserError::Input(format!("modem kind {kind} needs {what}")));
    match (kind, m.device.as_str(), m.listen.as_str(), m.connect.as_str()) {
        ("udp", _, "", "") => missing("modem.connect, modem.listen, or both"),
        ("udp", _, listen, connect) => Ok(PortAddress::Datagrams(listen.to_owned(), connect.to_owned())),
        ("tcp", _, "", "") => missing("modem.listen or modem.connect"),
        ("tcp", _, listen, "") | (_, "", listen, "") if !listen.is_empty() => {
            Ok(PortAddress::Listen(listen.to_owned()))
        }
        ("tcp", _, "", address) | (_, "", "", address) if !address.is_empty() => {
            Ok(PortAddress::Connect(address.to_owned()))
        }
        ("tcp", ..) => Err(UserError::Input("modem kind tcp takes modem.listen or modem.connect, not both".to_owned())),
        (_, "", "", "") => missing("modem.device (a serial device) or modem.connect (ADDRESS:PORT)"),
        (_, "", ..) => {
            Err(UserError::Input(format!("modem kind {kind} takes modem.listen or modem.connect, not both")))
        }
        (_, device, ..) => Ok(PortAddress::Serial(device.to_owned(), m.baud)),
    }
}
