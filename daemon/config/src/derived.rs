//! Values that follow from several keys.

use crate::{Config, load_key};
use scenecast_core::tuning_table::TuningTable;
use scenecast_core::{Area, UserError};
use scenecast_protocol::link::Authenticity;
use scenecast_protocol::mac::{Access, ModemProfile};
use scenecast_protocol::map::LayerSet;
use scenecast_protocol::schedule::BackgroundOrder;
use scenecast_protocol::wire::Address;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

/// The vehicle that a configuration speaks of.
pub fn vehicle_address(config: &Config) -> Result<Address, UserError> {
    let number = config.vehicle.address;
    Address::vehicle(number).ok_or_else(|| UserError::Input(format!("vehicle.address = {number}: allowed is 1 to 14")))
}

/// A modem that only has a bit rate on air.
pub fn modem_profile(config: &Config, bit_rate_bps: f64) -> ModemProfile {
    ModemProfile {
        frame_bytes: config.link.frame_bytes as usize,
        bit_rate_bps,
        overhead_bits: u64::from(config.modem.overhead_bits),
        turn_around: Duration::from_secs_f64(config.link.turn_around_s),
        access: Access::Shared,
    }
}

/// The limits of the survey that are configured, if any.
pub fn survey_area(config: &Config) -> Option<Area> {
    let [west, south, east, north] = config.survey.area_m;
    (east > west && north > south).then_some(Area { west, south, east, north })
}

/// The depth at which the survey is flown, metres.
pub fn survey_depth_m(config: &Config) -> f64 {
    (config.survey.depth_m - config.survey.altitude_m).max(0.0)
}

/// The edge of a map cell, metres.
pub fn cell_m(config: &Config) -> f64 {
    if config.scene.cell_m > 0.0 { config.scene.cell_m } else { 25.0 * config.camera.metres_per_pixel }
}

/// How frames are made authentic, as both ends must have it; `None` without a key.
pub fn authenticity(config: &Config) -> Result<Option<Authenticity>, UserError> {
    let (all, encrypt) = (config.link.authenticate == "all", config.link.encrypt);
    Ok(load_key(config)?.map(|key| Authenticity { key: Arc::new(key), all, encrypt }))
}

/// What left-over bits are spent on; the file was checked when it was read.
pub fn background(config: &Config) -> BackgroundOrder {
    BackgroundOrder::from_names(&config.link.spend, &LayerSet::default()).unwrap_or_default()
}

/// The vehicles that the surface speaks with from the beginning, by address and name.
pub fn vehicle_names(config: &Config) -> Result<BTreeMap<Address, String>, UserError> {
    let own = vehicle_address(config)?;
    if config.link.vehicles.is_empty() {
        return Ok(BTreeMap::from([(own, config.vehicle.name.clone())]));
    }
    let addresses = config.link.vehicles.iter().filter_map(|&number| Address::vehicle(number));
    let named = |a: Address| (a, if a == own { config.vehicle.name.clone() } else { default_name(a) });
    Ok(addresses.map(named).collect())
}

/// The name of a vehicle that the configuration does not name.
pub fn default_name(address: Address) -> String {
    format!("vehicle {}", address.number())
}

/// The table of `scene.tuning_table`, or the one that ships.
///
/// # Errors
/// A file that cannot be read, with its line.
pub fn tuning_table(config: &Config) -> Result<TuningTable, UserError> {
    let file = &config.scene.tuning_table;
    if file.is_empty() {
        return Ok(TuningTable::shipped());
    }
    let path = Path::new(file);
    let text = std::fs::read_to_string(path).map_err(|e| UserError::file(path, e))?;
    TuningTable::parse(file, &text)
}
