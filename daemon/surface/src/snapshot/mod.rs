//! The state of the surface at one moment, as all pages show it.

mod exemplar;
mod facts;
mod link;
mod vehicle;

pub(crate) use facts::command_state;
pub use facts::{MissionFacts, Truth, measured_origin, principal_info};
pub(crate) use vehicle::marker;

use crate::Surface;
use crate::link_meter::LinkMeter;
use crate::state::{LayerInfo, MissionInfo, MissionState, VehicleState, seconds};
use bytes::Bytes;
use scenecast_messages::contents::Stamps;
use scenecast_protocol::map::{BUILT_IN_LAYERS, LayerDescriptor};
use scenecast_protocol::time::Instant;
use std::sync::Arc;

/// The state at one moment.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Snapshot {
    pub state: MissionState,
    /// The same state as JSON; empty before the first.
    pub json: Bytes,
    /// The true classes of a simulated sea floor.
    pub truth: Option<Arc<Truth>>,
    /// The times of day of the mission so far.
    pub stamps: Stamps,
}

impl Snapshot {
    /// A state with its JSON.
    pub fn new(state: MissionState, truth: Option<Arc<Truth>>, stamps: Stamps) -> Self {
        // All keys of maps in these types are strings or numbers, so this cannot fail.
        let json = serde_json::to_vec(&state).unwrap_or_default().into();
        Self { state, json, truth, stamps }
    }

    /// A vehicle by its address.
    pub fn vehicle(&self, id: u8) -> Option<&VehicleState> {
        self.state.vehicles.iter().find(|v| v.id == id)
    }
}

/// The time of day at a mission time.
fn utc_s(facts: &MissionFacts, now: Instant) -> Option<f64> {
    // Without a moment at which both were known, mission times count from 1970.
    const KNOWN_S: f64 = 1e9;
    Some(facts.stamps.at(now.as_secs_f64()).nanos() as f64 / 1e9).filter(|utc_s| *utc_s > KNOWN_S)
}

/// The state of the surface.
pub fn snapshot(surface: &Surface, facts: &MissionFacts, meter: &LinkMeter, now: Instant) -> Snapshot {
    let state = MissionState {
        now_s: seconds(now),
        utc_s: utc_s(facts, now),
        mission: MissionInfo {
            name: facts.name.clone(),
            id: facts.run.clone(),
            speed: facts.speed,
            ended: facts.ended_s.is_some(),
            ended_s: facts.ended_s,
            origin: facts::measured_origin(surface).or(facts.origin),
        },
        vehicles: vehicle::vehicles(surface, facts, now),
        position: facts::surface_position(surface, now),
        link: link::summary(surface, facts, meter, now),
        command: command_state(surface.command(), now),
        layers: surface.layers().iter().map(|(_, layer)| layer_info(layer)).collect(),
        storage: facts.storage.clone(),
        log: surface.log().last(),
        truth: facts.truth.as_ref().map(|truth| truth.info.clone()),
        replay: None,
    };
    Snapshot::new(state, facts.truth.clone(), facts.stamps.clone())
}

fn layer_info(layer: &LayerDescriptor) -> LayerInfo {
    let built_in = BUILT_IN_LAYERS.iter().find(|b| b.descriptor.name == layer.name);
    LayerInfo {
        name: layer.name.clone().into_owned(),
        unit: layer.unit.clone().into_owned(),
        summary: built_in.map_or("", |b| b.summary).to_owned(),
    }
}
