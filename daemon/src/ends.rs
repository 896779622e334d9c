//! From configuration to the two ends of the link.

use crate::asv::Surface;
use crate::auv::{Durable, Footprint, Habits, Navigator, Steering, Vehicle, cell_m};
use crate::config::{Config, load_key};
use crate::modem;
use scenecast_core::Area;
use scenecast_core::UserError;
use scenecast_core::tuning_table::TuningTable;
use scenecast_protocol::directive::{PlaneSet, PlannerKind, Reaction};
use scenecast_protocol::link::{Authenticity, SurfaceConfig, SurfaceLink, VehicleConfig, VehicleLink};
use scenecast_protocol::mac::{Access, MasterConfig, ModemProfile};
use scenecast_protocol::map::{PlaneKind, PlaneScale, PlaneSource};
use scenecast_protocol::map_codec::Codec;
use scenecast_protocol::schedule::{Shares, SpendOrder};
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::{Address, MissionId};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

/// The vehicle that a configuration speaks of.
pub fn vehicle_address(config: &Config) -> Result<Address, UserError> {
    let number = config.vehicle.address;
    Address::vehicle(number).ok_or_else(|| UserError::Input(format!("vehicle.address = {number}: allowed is 1 to 14")))
}

/// The modem of an end's process.
pub fn modem_of_process(config: &Config, end: Address) -> Result<ModemProfile, UserError> {
    let mut profile = modem_profile(config, config.modem.bit_rate);
    if config.modem.kind == "transparent" {
        profile.overhead_bits += modem::PIPE_FRAMING_BITS;
    }
    Ok(modem::driver(config, end, profile)?.profile())
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
pub fn configured_area(config: &Config) -> Option<Area> {
    let [west, south, east, north] = config.survey.area_m;
    (east > west && north > south).then_some(Area { west, south, east, north })
}

/// What the camera sees.
pub fn footprint(config: &Config) -> Footprint {
    let mpp = config.camera.metres_per_pixel;
    Footprint { across: f64::from(config.camera.width_px) * mpp, along: f64::from(config.camera.height_px) * mpp }
}

/// How frames are made authentic, as both ends must have it; `None` without a key.
fn authenticity(config: &Config) -> Result<Option<Authenticity>, UserError> {
    let (all, encrypt) = (config.link.authenticate == "all", config.link.encrypt);
    Ok(load_key(config)?.map(|key| Authenticity { key: Arc::new(key), all, encrypt }))
}

/// What the vehicle does of its own accord.
fn habits(config: &Config) -> Habits {
    let survey = &config.survey;
    let reaction = |name: &str| Reaction::from_name(name).unwrap_or(Reaction::Return);
    Habits {
        on_silence: reaction(&survey.on_silence),
        on_breach: reaction(&survey.on_breach),
        on_abort: reaction(&survey.on_abort),
        silence_s: if survey.max_silence_s > 0.0 { survey.max_silence_s } else { f64::INFINITY },
        speed_m_s: survey.speed_m_s,
        altitude_m: survey.altitude_m,
    }
}

/// A vehicle that surveys `area`; `seed` is random for each run.
pub fn vehicle(
    config: &Config,
    modem: ModemProfile,
    area: Area,
    durable: Durable,
    seed: u64,
    now: Instant,
) -> Result<Vehicle, UserError> {
    let link = VehicleConfig {
        address: vehicle_address(config)?,
        mission: MissionId(config.mission.id),
        modem,
        budget_bps: durable.budget_bps.unwrap_or(config.link.budget_bps),
        budget_window: Duration::from_secs_f64(config.link.budget_window_s),
        shares: Shares(durable.shares.unwrap_or(config.link.shares)),
        status_period: Duration::from_secs_f64(config.link.status_period_s),
        authenticity: authenticity(config)?,
    };
    let codec = config.map.codec.parse().unwrap_or_default();
    let mut link = VehicleLink::new(link, codec, seed, durable.inbox.clone(), now);
    link.set_planes(planes(config, codec));
    link.source_mut().set_settle_time(Duration::from_secs_f64(config.map.settle_s));
    let planner = PlannerKind::from_name(&config.survey.planner).unwrap_or(PlannerKind::Horizon);
    let steering = Steering::new(area, footprint(config), cell_m(config), planner, config.survey.clearance_m);
    let (x, y) = steering.start();
    let depth = (config.survey.depth_m - config.survey.altitude_m).max(0.0);
    let drift = config.navigation.drift_percent / 100.0;
    let navigator = match durable.place {
        Some(last) => Navigator::resume(last, depth, drift),
        None => Navigator::new(x, y, depth, drift).with_start_sigma(config.navigation.start_sigma_m),
    };
    link.set_spend(durable.spend.and_then(SpendOrder::from_code).unwrap_or_else(|| spend(config)));
    let mut vehicle = Vehicle::new(link, navigator, steering, habits(config), durable, now);
    vehicle.configure_telling(config.map.cells == "coarse", config.map.coarse_after_s, told_planes(config));
    if config.map.stream == "whole-png" {
        vehicle.send_whole_png();
    }
    Ok(vehicle)
}

/// The planes of the map that are told.
fn told_planes(config: &Config) -> PlaneSet {
    PlaneSet::of(|kind| config.map.planes.iter().any(|name| name == kind.name()))
}

/// What left-over bits are spent on; the file was checked when it was read.
pub fn spend(config: &Config) -> SpendOrder {
    SpendOrder::from_names(&config.link.spend).unwrap_or_default()
}

/// Every plane that the operator could ask for, and its part of the map's share in percent.
fn planes(config: &Config, codec: Codec) -> impl Iterator<Item = (PlaneSource, u8)> {
    let map = &config.map;
    let settle = Duration::from_secs_f64(map.settle_s);
    let scale = |kind| match kind {
        PlaneKind::Confidence => PlaneScale::Confidence,
        PlaneKind::Depth => PlaneScale::depth_around(config.survey.depth_m, map.depth_step_m),
        PlaneKind::Curiosity => PlaneScale::Curiosity,
    };
    let planes = PlaneKind::ALL.into_iter().zip(map.plane_shares);
    let possible = planes.filter(|_| map.stream == "delta");
    possible.map(move |(kind, share)| (PlaneSource::new(scale(kind), codec, settle), share))
}

/// The vehicles that the surface speaks with from the beginning, by address and name.
fn vehicles(config: &Config) -> Result<BTreeMap<Address, String>, UserError> {
    let own = vehicle_address(config)?;
    if config.link.vehicles.is_empty() {
        return Ok(BTreeMap::from([(own, config.vehicle.name.clone())]));
    }
    let addresses = config.link.vehicles.iter().filter_map(|&number| Address::vehicle(number));
    let named = |a: Address| (a, if a == own { config.vehicle.name.clone() } else { Surface::name_of(a) });
    Ok(addresses.map(named).collect())
}

/// A surface that speaks with the configured vehicles; `seed` is random for each run.
pub fn surface(config: &Config, modem: ModemProfile, seed: u64, now: Instant) -> Result<Surface, UserError> {
    let vehicles = vehicles(config)?;
    let link = SurfaceConfig {
        mission: MissionId(config.mission.id),
        modem,
        budget_bps: config.link.budget_bps,
        budget_window: Duration::from_secs_f64(config.link.budget_window_s),
        shares: Shares(config.link.shares),
        master: MasterConfig {
            max_propagation: Duration::from_secs_f64(config.link.max_range_m / 1480.0),
            max_turn: Duration::from_secs_f64(config.link.max_turn_s),
            max_idle: Duration::from_secs_f64(config.link.max_idle_s),
        },
        vehicles: vehicles.keys().copied().collect(),
        call_every: (config.link.call_every_s > 0.0).then(|| Duration::from_secs_f64(config.link.call_every_s)),
        authenticity: authenticity(config)?,
    };
    let link = SurfaceLink::new(link, seed, now);
    let table = TuningTable::load(&config.scene.tuning_table)?;
    let mut surface = Surface::new(link, vehicles).with_tuning_table(table);
    surface.set_spend(spend(config));
    Ok(surface)
}
