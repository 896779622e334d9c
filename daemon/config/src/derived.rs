//! Values that follow from several keys.

use crate::{Authenticate, Config, ModemKind, load_key};
use scenecast_core::UserError;
use scenecast_core::tuning_table::TuningTable;
use scenecast_protocol::link::Authenticity;
use scenecast_protocol::mac::{Access, ModemProfile};
use scenecast_protocol::seal::{HeldKey, KeyFile};
use scenecast_protocol::wire::{Address, MapOrigin};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

pub fn vehicle_address(config: &Config) -> Result<Address, UserError> {
    let number = config.vehicle.address;
    Address::vehicle(number)
        .ok_or_else(|| UserError::Input(format!("vehicle.address = {number} is not allowed; allowed: 1 to 14")))
}

/// How far a camera frame reaches on the sea floor, metres across and along.
pub fn frame_m(config: &Config) -> [f64; 2] {
    [config.camera.width_px, config.camera.height_px].map(|px| f64::from(px) * config.camera.metres_per_pixel)
}

/// A modem that is described by its bit rate on air alone.
pub fn modem_profile(config: &Config, bit_rate_bps: f64) -> ModemProfile {
    ModemProfile {
        frame_bytes: config.link.frame_bytes as usize,
        bit_rate_bps,
        overhead_bits: u64::from(config.modem.overhead_bits),
        turn_around: Duration::from_secs_f64(config.link.turn_around_s),
        access: if is_full_duplex(config) { Access::FullDuplex } else { Access::Shared },
    }
}

/// Whether the ends transmit without turns.
fn is_full_duplex(config: &Config) -> bool {
    config.modem.full_duplex && matches!(config.modem.kind, ModemKind::Tcp | ModemKind::Udp)
}

/// The energy of a bit on air in joules: the power of the transmitter for the time of a bit. `None` if energy is not
/// counted.
pub fn joules_per_bit(config: &Config, profile: &ModemProfile) -> Option<f64> {
    let watts = config.modem.tx_watts;
    (watts > 0.0).then(|| watts / profile.bit_rate_bps.max(1.0))
}

/// The depth at which the survey is flown, metres.
pub fn survey_depth_m(config: &Config) -> f64 {
    (config.survey.depth_m - config.survey.altitude_m).max(0.0)
}

/// The edge of a map cell, metres.
pub fn cell_m(config: &Config) -> f64 {
    if config.scene.cell_m > 0.0 { config.scene.cell_m } else { 25.0 * config.camera.metres_per_pixel }
}

/// The origin of the mission, as hellos tell it; `None` without one.
pub fn map_origin(config: &Config) -> Option<MapOrigin> {
    config.mission.origin_deg.map(|origin| MapOrigin::from_degrees(origin.lat_deg, origin.lon_deg))
}

/// The key of an end and the use of it, the same at both ends; `None` without a key.
///
/// # Errors
///
/// The file cannot be read, or has the key of another end.
pub fn authenticity(config: &Config, end: Address) -> Result<Option<Authenticity>, UserError> {
    let (all, encrypt) = (config.link.authenticate == Authenticate::All, config.link.encrypt);
    let held = load_key(config, end)?;
    Ok(held.map(|KeyFile { key, next }| {
        let next = next.map(|key| Arc::new(HeldKey::Mission(key)));
        Authenticity { next, ..Authenticity::new(key, all, encrypt) }
    }))
}

/// The vehicles that the surface works with from the start, by address and name.
pub fn vehicle_names(config: &Config) -> Result<BTreeMap<Address, String>, UserError> {
    let own = vehicle_address(config)?;
    if config.link.vehicles.is_empty() {
        return Ok(BTreeMap::from([(own, config.vehicle.name.clone())]));
    }
    let addresses = config.link.vehicles.iter().filter_map(|&number| Address::vehicle(number));
    let named = |a: Address| (a, if a == own { config.vehicle.name.clone() } else { default_name(a) });
    Ok(addresses.map(named).collect())
}

/// The name of a vehicle without a configured name.
pub fn default_name(address: Address) -> String {
    format!("vehicle {}", address.number())
}

/// The table of `scene.tuning_table`, or the built-in one.
///
/// # Errors
/// A file that cannot be read, with its line.
pub fn tuning_table(config: &Config) -> Result<TuningTable, UserError> {
    let Some(path) = &config.scene.tuning_table else { return Ok(TuningTable::shipped()) };
    let text = crate::read_regular_text(path)?;
    TuningTable::parse(&path.display().to_string(), &text)
}
