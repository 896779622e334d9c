//! From configuration to a driver and a way to it.

use super::driver::Driver;
use super::micromodem::{Micromodem, MicromodemConfig};
use super::paced::Paced;
use super::s2c::{BURST_FRAME_BYTES, INSTANT_BYTES, S2c, S2cConfig, S2cMode};
use super::station::AddressBook;
use crate::config::{self, Config};
use scenecast_core::MicromodemRate;
use scenecast_core::ModemAddress;
use scenecast_core::PortAddress;
use scenecast_core::UserError;
use scenecast_protocol::mac::ModemProfile;
use scenecast_protocol::wire::Address;

/// Bytes of bulk that may be in an S2C modem: about a train on its way and another one that waits.
const POOL_BYTES: usize = 16_384;
/// Frames of the surface that may be in an S2C modem: what waits is written when its time has come.
const SURFACE_POOL_FRAMES: u32 = 1;

/// Bytes of a full frame: the modem's unit where it has one, else what the configuration says.
pub fn full_frame_bytes(config: &Config) -> usize {
    match (config.modem.kind.as_str(), config.modem.s2c_mode.as_str()) {
        ("s2c", "im") => INSTANT_BYTES,
        ("s2c", _) => BURST_FRAME_BYTES,
        ("micromodem", _) => MicromodemRate::of(config.modem.rate).frame_bytes,
        _ => config.link.frame_bytes as usize,
    }
}

/// Whose modem is whose.
pub fn address_book(config: &Config) -> AddressBook {
    AddressBook { surface: config.modem.surface_address }
}

/// What the keys of a modem must be together.
///
/// # Errors
/// A line that names the key and what is allowed.
pub fn check(config: &Config) -> Result<(), UserError> {
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

/// The driver of an end's modem, its port still closed; `profile` is for kinds that do not have one of their own.
///
/// # Errors
/// An end whose modem can have no address.
pub fn driver(config: &Config, end: Address, profile: ModemProfile) -> Result<Box<dyn Driver>, UserError> {
    let super::Destination::Modem(address) = address_book(config).modem_of(end) else {
        return Err(UserError::Failed("everybody has no modem".to_owned()));
    };
    let m = &config.modem;
    Ok(match m.kind.as_str() {
        "s2c" => Box::new(S2c::new(s2c_config(m, address, end))),
        "micromodem" => {
            let baud = is_serial(m).then_some(m.baud);
            Box::new(Micromodem::new(MicromodemConfig { address, rate: MicromodemRate::of(m.rate), baud }))
        }
        "udp" => Box::new(Paced::datagrams(profile, m.bit_rate)),
        "transparent" => {
            // A serial byte takes ten bits. In a rehearsal that is faster than the world so is the cable.
            let cable_bps = if is_serial(m) { f64::from(m.baud) * 0.8 } else { f64::MAX };
            Box::new(Paced::stream(profile, m.bit_rate.min(cable_bps)))
        }
        _ => Box::new(Paced::stream(profile, m.bit_rate)),
    })
}

fn s2c_config(m: &config::Modem, address: ModemAddress, end: Address) -> S2cConfig {
    let is_surface = end == Address::SURFACE;
    let pool = (POOL_BYTES / BURST_FRAME_BYTES) as u32;
    S2cConfig {
        address,
        mode: if m.s2c_mode == "im" { S2cMode::Instant } else { S2cMode::Burst },
        source_level: m.source_level,
        highest_address: m.highest_address,
        cluster: m.cluster,
        packet_ms: m.packet_ms,
        ethernet: !is_serial(m),
        baud: is_serial(m).then_some(m.baud),
        burst_bps: m.bit_rate,
        pool_frames: if is_surface { SURFACE_POOL_FRAMES } else { pool },
    }
}

fn is_serial(m: &config::Modem) -> bool {
    !m.device.is_empty()
}

/// Where the modem is.
pub(super) fn place(config: &Config) -> Result<PortAddress, UserError> {
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
