//! Checks of the modem's keys, and the address of its port.

use crate::{Config, HostPort, ModemKind, S2cMode};
use scenecast_core::{MicromodemRate, PortAddress, S2C_BURST_FRAME_BYTES, S2C_INSTANT_BYTES, UserError};

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
pub(crate) fn check(config: &Config) -> Result<(), UserError> {
    let m = &config.modem;
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
            Ok(PortAddress::Serial(device.display().to_string(), m.baud))
        }
        (_, _, None, None) => missing("modem.device (a serial device) or modem.connect (HOST:PORT)"),
        (_, _, Some(listen), None) => Ok(PortAddress::Listen(listen.to_string())),
        (_, _, None, Some(connect)) => Ok(PortAddress::Connect(connect.to_string())),
        (_, _, Some(_), Some(_)) => {
            Err(UserError::Input(format!("modem.kind = \"{kind}\" takes modem.listen or modem.connect, not both")))
        }
    }
}
