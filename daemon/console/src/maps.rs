//! Maps for browsers, taken from the surface once a version however many ask.

use super::answer::{Ask, Reply};
use super::compress::{either, gzip, tagged};
use super::export::{self, Cells};
use super::server::{Shared, VehicleId, refusal};
use super::state::Origin;
use axum::body::Bytes;
use axum::extract::State;
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Response};
use std::collections::BTreeMap;
use std::sync::Arc;
use tokio::sync::{Mutex, Semaphore};

/// The newest map of each vehicle that somebody asked for.
#[derive(Debug)]
pub(super) struct Maps {
    held: Mutex<BTreeMap<u8, Arc<Held>>>,
    /// Files are made by so many at a time; what is left of the machine is the link's.
    makers: Semaphore,
}

impl Default for Maps {
    fn default() -> Self {
        Self { held: Mutex::default(), makers: Semaphore::new(1) }
    }
}

#[derive(Debug)]
struct Held {
    cells: Cells,
    /// When the vehicle had last spoken of its map.
    updated_s: Option<f64>,
    json: Bytes,
    packed: Bytes,
}

/// The map of a vehicle as it is now.
async fn newest(shared: &Shared, id: u8) -> Result<Arc<Held>, Response> {
    let mut maps = shared.maps.held.lock().await;
    let seen = {
        let snapshot = shared.snapshots.borrow();
        snapshot.vehicle(id).map(|v| (v.map.version, v.map.updated_s))
    };
    if let (Some(held), Some((version, updated_s))) = (maps.get(&id), seen)
        && held.cells.version >= version
        && held.updated_s >= updated_s
    {
        return Ok(held.clone());
    }
    let cells = match shared.reply(Ask::Map(id)).await? {
        Reply::Map(cells) => cells,
        other => return Err(super::server::respond(other)),
    };
    let updated_s = seen.and_then(|(_, at)| at);
    let held = tokio::task::spawn_blocking(move || {
        let json = serde_json::to_vec(&cells.told()).unwrap_or_default();
        let packed = gzip(&json).unwrap_or_default().into();
        Arc::new(Held { cells, updated_s, json: json.into(), packed })
    });
    let held = held.await.map_err(|_| StatusCode::INTERNAL_SERVER_ERROR.into_response())?;
    maps.insert(id, held.clone());
    Ok(held)
}

fn tag(shared: &Shared, id: u8, held: &Held) -> String {
    let run = shared.snapshots.borrow().state.mission.id.clone();
    let updated = held.updated_s.map_or(0.0, |at| at * 100.0);
    format!("{run}-{id}-{}-{updated:.0}", held.cells.version)
}

/// The map with the age of its cells.
pub(super) async fn map(State(shared): State<Shared>, VehicleId(id): VehicleId, headers: HeaderMap) -> Response {
    match newest(&shared, id).await {
        Ok(held) => tagged(&headers, &tag(&shared, id, &held), || {
            either(&headers, "application/json", &held.json, &held.packed)
        }),
        Err(answer) => answer,
    }
}

/// Makes a file of a map.
type Make = fn(&Cells, Option<Origin>) -> Option<Vec<u8>>;

/// A format of the map.
#[derive(Debug, Clone, Copy)]
pub(super) struct Format {
    pub(super) content_type: &'static str,
    make: Make,
}

pub(super) const PNG: Format = Format { content_type: "image/png", make: |cells, _| export::indexed_png(cells) };
pub(super) const WORLD: Format =
    Format { content_type: "text/plain", make: |cells, _| Some(export::world_file(cells).into()) };
pub(super) const PROJECTION: Format =
    Format { content_type: "application/xml", make: |_, origin| Some(export::projection(origin).into()) };
pub(super) const GEOJSON: Format =
    Format { content_type: "application/geo+json", make: |cells, origin| Some(export::geojson(cells, origin).into()) };
pub(super) const PLY: Format =
    Format { content_type: "application/ply", make: |cells, _| Some(export::ply(cells).into()) };
pub(super) const CSV: Format = Format { content_type: "text/csv", make: |cells, _| Some(export::csv(cells).into()) };

/// The map as a file.
pub(super) async fn file(shared: Shared, id: u8, headers: HeaderMap, format: Format) -> Response {
    let held = match newest(&shared, id).await {
        Ok(held) => held,
        Err(answer) => return answer,
    };
    let (origin, placement) = {
        let snapshot = shared.snapshots.borrow();
        let vehicle = snapshot.state.vehicles.iter().find(|v| v.id == id);
        (snapshot.state.mission.origin, vehicle.and_then(|v| v.map.placement.clone()))
    };
    let moves = placement.as_ref().map_or(0, |p| p.version);
    let tag = format!("{}-{moves}", tag(&shared, id, &held));
    let as_held = tagged(&headers, &tag, || StatusCode::OK.into_response());
    if as_held.status() == StatusCode::NOT_MODIFIED {
        return as_held;
    }
    let Ok(_maker) = shared.maps.makers.acquire().await else {
        return StatusCode::INTERNAL_SERVER_ERROR.into_response();
    };
    match tokio::task::spawn_blocking(move || {
        let moved_m = placement.map_or((0.0, 0.0), |p| (p.east_m, p.north_m));
        (format.make)(&Cells { moved_m, ..held.cells.clone() }, origin)
    })
    .await
    {
        Ok(Some(bytes)) => {
            tagged(&headers, &tag, || ([(header::CONTENT_TYPE, format.content_type)], bytes).into_response())
        }
        _ => refusal(StatusCode::INTERNAL_SERVER_ERROR, "the file could not be made"),
    }
}
