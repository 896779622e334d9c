//! Builds a surface from a configuration.

use crate::Surface;
use scenecast_config::{Config, cell_m, map_origin, vehicle_names};
use scenecast_core::UserError;
use scenecast_core::tuning_table::TuningTable;
use scenecast_protocol::link::{Authenticity, SurfaceConfig, SurfaceLink};
use scenecast_protocol::mac::{MasterConfig, ModemProfile};
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::{CellEdge, MissionId, SurfaceName};
use std::time::Duration;

/// Builds a surface for the configured vehicles. `seed` is random for each run.
pub fn assemble(
    config: &Config,
    authenticity: Option<Authenticity>,
    table: TuningTable,
    modem: ModemProfile,
    seed: u64,
    now: Instant,
) -> Result<Surface, UserError> {
    let link = SurfaceLink::new(link_config(config, authenticity, modem)?, seed, now);
    let mut surface = Surface::new(link, vehicle_names(config)?).with_tuning_table(table);
    surface.set_background(config.link.background);
    surface.set_restore(config.surface.restore);
    Ok(surface)
}

/// The configured end of the link.
pub fn link_config(
    config: &Config,
    authenticity: Option<Authenticity>,
    modem: ModemProfile,
) -> Result<SurfaceConfig, UserError> {
    let abort_lifetime_s = config.surface.abort_lifetime_s;
    Ok(SurfaceConfig {
        name: SurfaceName::from_text(&config.surface.name),
        abort_lifetime: (abort_lifetime_s > 0.0).then(|| Duration::from_secs_f64(abort_lifetime_s)),
        mission: MissionId(config.mission.id),
        cell_edge: CellEdge::from_metres(cell_m(config)),
        origin: map_origin(config),
        modem,
        budget_bps: config.link.budget_bps,
        budget_window: Duration::from_secs_f64(config.link.budget_window_s),
        shares: config.link.shares,
        master: MasterConfig {
            max_propagation: Duration::from_secs_f64(config.link.max_range_m / 1480.0),
            max_turn: Duration::from_secs_f64(config.link.max_turn_s),
            max_idle: Duration::from_secs_f64(config.link.max_idle_s),
        },
        vehicles: vehicle_names(config)?.into_keys().collect(),
        discovery_period: (config.link.discovery_period_s > 0.0)
            .then(|| Duration::from_secs_f64(config.link.discovery_period_s)),
        authenticity,
    })
}
