//! Facts of the mission: its time, who has command, where the surface and the world frame are.

use crate::state::{
    CommandChangeName, CommandChangeState, CommandHolderState, CommandRequestState, CommandState, MapPlacement, Origin,
    PrincipalInfo, PrincipalRole, StorageInfo, SurfacePosition, TruthInfo, seconds,
};
use crate::{COMMAND_SILENCE, Command, CommandChange, CommandChangeKind, Principal, Role, Surface};
use bytes::Bytes;
use scenecast_config::{self as config, Config};
use scenecast_core::LatLon;
use scenecast_messages::contents::Stamps;
use scenecast_protocol::mac::ModemProfile;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::Placement;
use std::sync::Arc;

/// Facts of the mission that the surface does not have.
#[derive(Debug, Clone, PartialEq)]
pub struct MissionFacts {
    /// The name that people use.
    pub name: String,
    /// A random name of this mission at this surface, which a restart does not change. A browser keeps its data under it.
    pub run: String,
    /// Seconds of mission time for each second of the clock.
    pub speed: f64,
    /// Mission time at which the survey ended, seconds.
    pub ended_s: Option<f64>,
    /// Width of a cell, metres.
    pub cell_m: f64,
    /// Metres around a vehicle that its camera sees at any heading, as configured at the surface.
    pub reach_m: f64,
    /// The configured speed of a vehicle, metres a second.
    pub survey_m_s: f64,
    /// Longest pause between two turns of an idle link, seconds.
    pub idle_s: f64,
    /// Interval between two contacts to expect before one was measured, seconds.
    pub first_interval_s: f64,
    /// Bits on air of a full frame.
    pub frame_bits: u64,
    /// Energy of a bit on air, joules; `None` if energy is not counted.
    pub joules_per_bit: Option<f64>,
    /// The configured place of x = y = 0 on the Earth.
    pub origin: Option<Origin>,
    /// The folder in which the surface keeps its state, if it has one.
    pub storage: Option<StorageInfo>,
    /// The true classes of a simulated sea floor, once they are known.
    pub truth: Option<Arc<Truth>>,
    /// The times of day of the mission so far.
    pub stamps: Stamps,
}

impl MissionFacts {
    /// A mission that begins or continues; `run` is a random number for each mission.
    pub fn new(config: &Config, modem: &ModemProfile, run: u64, speed: f64) -> Self {
        Self {
            name: config.mission.name.clone(),
            run: format!("{:08x}", run as u32),
            speed,
            ended_s: None,
            cell_m: config::cell_m(config),
            reach_m: config::frame_m(config).into_iter().fold(f64::INFINITY, f64::min) / 2.0,
            survey_m_s: config.survey.speed_m_s,
            idle_s: config.link.max_idle_s,
            first_interval_s: config.link.max_idle_s + config.link.max_turn_s,
            frame_bits: modem.bits_on_air(modem.frame_bytes),
            joules_per_bit: config::joules_per_bit(config, modem),
            origin: configured_origin(config),
            storage: None,
            truth: None,
            stamps: Stamps::with_speed(speed),
        }
    }
}

fn configured_origin(config: &Config) -> Option<Origin> {
    // At a pole there is no east.
    let LatLon { lat_deg, lon_deg } = config.mission.origin_deg.filter(|o| o.lat_deg.abs() < 90.0)?;
    Some(Origin { lat_deg, lon_deg })
}

pub(crate) fn command_state(command: &Command, now: Instant) -> CommandState {
    CommandState {
        holder: command.holder().map(|h| CommandHolderState {
            name: h.principal.name().to_owned(),
            role: role(h.principal.role()),
            client: h.client.as_ref().map(|client| client.as_str().to_owned()),
            since_s: seconds(h.since),
            last_active_s: seconds(h.last_active),
            takeable_s: seconds(h.last_active + COMMAND_SILENCE),
        }),
        requests: command
            .requests(now)
            .map(|r| CommandRequestState { name: r.principal.name().to_owned(), at_s: seconds(r.at) })
            .collect(),
        principals: command.principals().iter().map(principal_info).collect(),
        history: command.changes().map(change).collect(),
    }
}

/// A principal as the API shows it.
pub fn principal_info(principal: &Principal) -> PrincipalInfo {
    PrincipalInfo { name: principal.name().to_owned(), role: role(principal.role()) }
}

fn role(role: Role) -> PrincipalRole {
    match role {
        Role::Viewer => PrincipalRole::Viewer,
        Role::Operator => PrincipalRole::Operator,
        Role::Administrator => PrincipalRole::Administrator,
    }
}

fn change(change: &CommandChange) -> CommandChangeState {
    let kind = match change.kind {
        CommandChangeKind::Taken => CommandChangeName::Taken,
        CommandChangeKind::HandedOver => CommandChangeName::HandedOver,
        CommandChangeKind::Released => CommandChangeName::Released,
        CommandChangeKind::Requested => CommandChangeName::Requested,
        CommandChangeKind::Withdrawn => CommandChangeName::Withdrawn,
        CommandChangeKind::Moved => CommandChangeName::Moved,
    };
    let CommandChange { at, by, from, to, .. } = change.clone();
    CommandChangeState { at_s: seconds(at), kind, by, from, to }
}

/// The place of x = y = 0 on the Earth by the GPS of the surface. 0, 0 stands for a rehearsal without a
/// place, as in the configuration.
pub fn measured_origin(surface: &Surface) -> Option<Origin> {
    let origin = surface.relay()?.plane().map(|p| p.origin()).filter(|o| (o.lat_deg, o.lon_deg) != (0.0, 0.0))?;
    Some(Origin { lat_deg: origin.lat_deg, lon_deg: origin.lon_deg })
}

pub(super) fn placement(placement: Placement) -> MapPlacement {
    let Placement { version, origin } = placement;
    MapPlacement { version, east_m: origin.east_m, north_m: origin.north_m }
}

/// The position of the surface; `None` without a GPS.
pub(super) fn surface_position(surface: &Surface, now: Instant) -> Option<SurfacePosition> {
    let relay = surface.relay()?;
    let (gps, own) = (relay.gps(), relay.own(now));
    let fix = gps.fix();
    Some(SurfacePosition {
        is_valid: own.is_some(),
        x_m: own.map(|e| e.x_m),
        y_m: own.map(|e| e.y_m),
        sigma_m: own.map(|e| e.sigma_m()),
        lat_deg: fix.map(|f| f.place.lat_deg),
        lon_deg: fix.map(|f| f.place.lon_deg),
        at_s: fix.map(|f| f.at.as_secs_f64()),
        heading_deg: relay.heading_rad(now).map(|h| h.to_degrees().rem_euclid(360.0)),
        rejected: gps.faults().map(|(f, n)| (f.name().to_owned(), n)).collect(),
        outliers: relay.gps_outliers(),
        fixes_sent: relay.fixes(),
        usbl_rejected: relay.faults().map(|(f, n)| (f.name().to_owned(), n)).collect(),
    })
}

/// The true classes of a part of a simulated sea floor.
#[derive(Debug, Clone, PartialEq)]
pub struct Truth {
    /// The outline of the picture, and its classes.
    pub info: TruthInfo,
    /// An indexed PNG, one pixel a cell, north up.
    pub picture: Bytes,
}
