//! From configuration to the two ends of the link.

use crate::asv::Surface;
use crate::auv::{Area, Durable, Footprint, Navigator, Steering, Vehicle, cell_m};

use crate::config::Config;
use crate::problem::Problem;
use scenecast_protocol::link::{SurfaceConfig, SurfaceLink, VehicleConfig, VehicleLink};
use scenecast_protocol::mac::{MasterConfig, ModemProfile};
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::{Address, MissionId, SessionId};
use std::time::Duration;

/// The vehicle that a configuration speaks of.
pub fn vehicle_address(config: &Config) -> Result<Address, Problem> {
    let number = config.vehicle.address;
    Address::vehicle(number).ok_or_else(|| Problem::Input(format!("vehicle.address = {number}: allowed is 1 to 14")))
}

/// Bits of framing that a transparent modem puts on air with each frame: delimiters and stuffing.
const FRAMING_BITS: u64 = 8 * 7;

/// The modem of a process.
pub fn modem_of_process(config: &Config) -> ModemProfile {
    let mut profile = modem_profile(config, config.modem.bit_rate);
    if config.modem.kind == "transparent" {
        profile.overhead_bits += FRAMING_BITS;
    }
    profile
}

/// The modem, at `bit_rate_bps` on air.
pub fn modem_profile(config: &Config, bit_rate_bps: f64) -> ModemProfile {
    ModemProfile {
        frame_bytes: config.link.frame_bytes as usize,
        bit_rate_bps,
        overhead_bits: u64::from(config.modem.overhead_bits),
        turn_around: Duration::from_secs_f64(config.link.turn_around_s),
    }
}

/// The limits of the survey that are configured, if any.
pub fn configured_area(config: &Config) -> Option<Area> {
    let [west, south, east, north] = config.survey.area_m;
    (east > west && north > south).then_some(Area { west, south, east, north })
}

/// What the camera sees.
pub fn footprint(config: &Config) -> Footprint {
    let mpp = config.camera.metres_per_pixel;
    Footprint { across: f64::from(config.camera.width_px) * mpp, along: f64::from(config.camera.height_px) * mpp }
}

/// A vehicle that surveys `area`; `session` is random for each run.
pub fn vehicle(
    config: &Config,
    modem: ModemProfile,
    area: Area,
    durable: Durable,
    session: SessionId,
    now: Instant,
) -> Result<Vehicle, Problem> {
    let whole = config.map.stream == "whole-png";
    let link = VehicleConfig {
        address: vehicle_address(config)?,
        mission: MissionId(config.mission.id),
        modem,
        budget_bps: durable.budget_bps.unwrap_or(config.link.budget_bps),
        budget_window: Duration::from_secs_f64(config.link.budget_window_s),
        codec: config.map.codec.parse().unwrap_or_default(),
        exemplar_share: config.link.exemplar_share,
        replicate_map: !whole,
        status_period: Duration::from_secs_f64(config.link.status_period_s),
    };
    let link = VehicleLink::new(link, session, durable.inbox.clone(), now);
    let steering = Steering::new(area, footprint(config), cell_m(config));
    let (x, y) = steering.start();
    let depth = (config.survey.depth_m - config.survey.altitude_m).max(0.0);
    let navigator = Navigator::new(x, y, depth, config.navigation.drift_percent / 100.0);
    let mut vehicle = Vehicle::new(link, navigator, steering, durable, now);
    if whole {
        vehicle.send_whole_png();
    }
    Ok(vehicle)
}

/// A surface that speaks with the configured vehicle; `seed` is random for each run.
pub fn surface(config: &Config, modem: ModemProfile, seed: u64, now: Instant) -> Result<Surface, Problem> {
    let vehicle = vehicle_address(config)?;
    let link = SurfaceConfig {
        mission: MissionId(config.mission.id),
        modem,
        budget_bps: config.link.budget_bps,
        budget_window: Duration::from_secs_f64(config.link.budget_window_s),
        master: MasterConfig {
            max_propagation: Duration::from_secs_f64(config.link.max_range_m / 1480.0),
            max_turn: Duration::from_secs_f64(config.link.max_turn_s),
            max_idle: Duration::from_secs_f64(config.link.max_idle_s),
        },
        vehicles: vec![vehicle],
    };
    let link = SurfaceLink::new(link, seed, now);
    Ok(Surface::new(link, [(vehicle, config.vehicle.name.clone())]))
}
