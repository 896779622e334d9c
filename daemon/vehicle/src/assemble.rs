//! Builds a vehicle from a configuration.

use crate::cells::descriptors;
use crate::{Durable, FailsafePolicy, Footprint, LastPlace, MapSelection, Navigator, Steering, Vehicle};
use scenecast_config::{
    Config, Debounce, LabelSource, LayerName, MapCells, NavigationSource, cell_m, frame_m, map_origin, vehicle_address,
};
use scenecast_core::{Area, UserError};
use scenecast_protocol::link::{Authenticity, VehicleConfig, VehicleLink};
use scenecast_protocol::mac::ModemProfile;
use scenecast_protocol::map::{LayerDescriptor, LayerMask, LayerSource};
use scenecast_protocol::map_codec::Codec;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::{CellEdge, MissionId};
use std::time::Duration;

/// Builds a vehicle that surveys `area`. `seed` is random for each run.
pub fn assemble(
    config: &Config,
    authenticity: Option<Authenticity>,
    modem: ModemProfile,
    area: Area,
    mut durable: Durable,
    seed: u64,
    now: Instant,
) -> Result<Vehicle, UserError> {
    let authenticity = authenticity.map(|of_file| durable.keys.begin(of_file));
    let mut link = link_config(config, authenticity, modem)?;
    durable.budget.configure(&mut link);
    let codec = config.map.codec;
    let mut link = VehicleLink::new(link, codec, seed, durable.inbox.clone(), now);
    for layer in layers(config, codec) {
        link.add_layer(layer);
    }
    let steering = steering(config, area, cell_m(config));
    let (x, y) = steering.start();
    let depth = (config.survey.depth_m - config.survey.altitude_m).max(0.0);
    let drift = config.navigation.drift_percent / 100.0;
    let at_start = Navigator::new(x, y, depth, drift);
    // A vehicle that has mapped something is no longer at its start. Other sources than an autopilot give places.
    let is_anywhere = durable.labels > 0 && config.navigation.source == NavigationSource::Autopilot;
    let navigator = match durable.place.or_else(|| is_anywhere.then(|| LastPlace::of(&at_start))) {
        Some(last) => Navigator::resume(last, depth, drift),
        None => at_start.with_start_sigma(config.navigation.start_sigma_m),
    };
    link.set_background(durable.budget.background().unwrap_or(config.link.background));
    let mut vehicle = Vehicle::new(link, navigator, steering, policy(config), durable, now);
    vehicle.set_codec(codec);
    vehicle.configure_map(MapSelection {
        is_coarse: config.map.cells == MapCells::Coarse,
        coarse_after_s: config.map.coarse_after_s,
        debounce: debounce(config),
        layers: selected_layers(config),
    });
    Ok(vehicle)
}

/// The choice of waypoints within `area`, as configured, on a map with cells of `cell_m` metres.
pub fn steering(config: &Config, area: Area, cell_m: f64) -> Steering {
    let survey = &config.survey;
    Steering::new(area, footprint(config), cell_m, survey.planner, survey.clearance_m)
        .with_end(survey.at_end)
        .with_legs(survey.legs)
}

/// The configured end of the link.
pub fn link_config(
    config: &Config,
    authenticity: Option<Authenticity>,
    modem: ModemProfile,
) -> Result<VehicleConfig, UserError> {
    Ok(VehicleConfig {
        address: vehicle_address(config)?,
        mission: MissionId(config.mission.id),
        cell_edge: CellEdge::from_metres(cell_m(config)),
        origin: map_origin(config),
        modem,
        budget_bps: config.link.budget_bps,
        budget_window: Duration::from_secs_f64(config.link.budget_window_s),
        shares: config.link.shares,
        status_period: Duration::from_secs_f64(config.link.status_period_s),
        authenticity,
    })
}

/// The extent of a camera frame on the sea floor, as configured.
pub fn footprint(config: &Config) -> Footprint {
    let [across, along] = frame_m(config);
    Footprint { across, along, leg_overlap: config.survey.leg_overlap_percent / 100.0 }
}

/// Labels of another program do not flicker as those of a sampler do: unless the configuration says otherwise, none is held
/// back.
fn debounce(config: &Config) -> Debounce {
    match config.map.debounce_s {
        Debounce::Automatic if config.labels.source != LabelSource::SceneModel => Debounce::Seconds(0.0),
        configured => configured,
    }
}

fn policy(config: &Config) -> FailsafePolicy {
    let survey = &config.survey;
    FailsafePolicy {
        on_silence: survey.on_silence,
        on_breach: survey.on_breach,
        on_abort: survey.on_abort,
        silence_s: if survey.max_silence_s > 0.0 { survey.max_silence_s } else { f64::INFINITY },
        speed_m_s: survey.speed_m_s,
        altitude_m: survey.altitude_m,
    }
}

/// The layers that are sent unless the operator selects others.
fn selected_layers(config: &Config) -> LayerMask {
    config.map.layers.iter().map(|layer| layer.id()).collect()
}

/// Every layer that the operator can select, with its part of the map's share.
fn layers(config: &Config, codec: Codec) -> impl Iterator<Item = LayerSource> {
    let map = &config.map;
    let debounce = debounce(config).of_layers();
    descriptors(config).zip(LayerName::all()).map(move |((id, built_in), name)| {
        let share = map.layer_shares.get(&name).copied().unwrap_or(0);
        LayerSource::new(id, LayerDescriptor { share, ..built_in }, codec, debounce)
    })
}
