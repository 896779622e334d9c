//! Maps. Each version is requested from the surface once, however many clients read it.

use crate::export::{self, MapCells};
use crate::http::compress::{either, gzip, tagged};
use crate::http::response::{error, respond};
use crate::http::shared::{CachedMap, Shared, VehicleId};
use crate::request::{Reply, SurfaceRequest};
use crate::state::Origin;
use axum::extract::State;
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Response};
use std::sync::Arc;

/// The latest map of a vehicle.
async fn latest(shared: &Shared, id: u8) -> Result<Arc<CachedMap>, Response> {
    let mut maps = shared.maps.maps.lock().await;
    let published = {
        let snapshot = shared.snapshots.borrow();
        snapshot.vehicle(id).map(|v| (v.map.version, v.map.updated_s))
    };
    if let (Some(cached), Some((version, updated_s))) = (maps.get(&id), published)
        && cached.cells.version >= version
        && cached.updated_s >= updated_s
    {
        return Ok(cached.clone());
    }
    let cells = match shared.request(SurfaceRequest::Map(id)).await? {
        Reply::Map(cells) => cells,
        other => return Err(respond(other)),
    };
    let updated_s = published.and_then(|(_, at)| at);
    let cached = tokio::task::spawn_blocking(move || {
        let json = serde_json::to_vec(&cells.body()).unwrap_or_default();
        let packed = gzip(&json).unwrap_or_default().into();
        Arc::new(CachedMap { cells, updated_s, json: json.into(), packed })
    });
    let cached = cached.await.map_err(|_| StatusCode::INTERNAL_SERVER_ERROR.into_response())?;
    maps.insert(id, cached.clone());
    Ok(cached)
}

fn tag(shared: &Shared, id: u8, cached: &CachedMap) -> String {
    let run = shared.snapshots.borrow().state.mission.id.clone();
    let updated = cached.updated_s.map_or(0.0, |at| at * 100.0);
    format!("{run}-{id}-{}-{updated:.0}", cached.cells.version)
}

/// The map with the age of its cells.
pub(in crate::http) async fn map(
    State(shared): State<Shared>,
    VehicleId(id): VehicleId,
    headers: HeaderMap,
) -> Response {
    match latest(&shared, id).await {
        Ok(cached) => tagged(&headers, &tag(&shared, id, &cached), || {
            either(&headers, "application/json", &cached.json, &cached.packed)
        }),
        Err(response) => response,
    }
}

/// Makes a file of a map; `None` if the encoder fails.
type Make = fn(&MapCells, Option<Origin>) -> Option<Vec<u8>>;

/// A file format of the map.
#[derive(Debug, Clone, Copy)]
pub(in crate::http) struct FileFormat {
    pub(in crate::http) content_type: &'static str,
    make: Make,
}

pub(in crate::http) const PNG: FileFormat =
    FileFormat { content_type: "image/png", make: |cells, _| export::indexed_png(cells) };
pub(in crate::http) const WORLD: FileFormat =
    FileFormat { content_type: "text/plain", make: |cells, _| Some(export::world_file(cells).into()) };
pub(in crate::http) const PROJECTION: FileFormat =
    FileFormat { content_type: "application/xml", make: |_, origin| Some(export::projection(origin).into()) };
pub(in crate::http) const GEOJSON: FileFormat = FileFormat {
    content_type: "application/geo+json",
    make: |cells, origin| Some(export::geojson(cells, origin).into()),
};
pub(in crate::http) const PLY: FileFormat =
    FileFormat { content_type: "application/ply", make: |cells, _| Some(export::ply(cells).into()) };
pub(in crate::http) const CSV: FileFormat =
    FileFormat { content_type: "text/csv", make: |cells, _| Some(export::csv(cells).into()) };

/// The map as a file.
pub(in crate::http) async fn file(shared: Shared, id: u8, headers: HeaderMap, format: FileFormat) -> Response {
    let cached = match latest(&shared, id).await {
        Ok(cached) => cached,
        Err(response) => return response,
    };
    let (origin, placement) = {
        let snapshot = shared.snapshots.borrow();
        (snapshot.state.mission.origin, snapshot.vehicle(id).and_then(|v| v.map.placement.clone()))
    };
    let moves = placement.as_ref().map_or(0, |p| p.version);
    let tag = format!("{}-{moves}", tag(&shared, id, &cached));
    let unchanged = tagged(&headers, &tag, || StatusCode::OK.into_response());
    if unchanged.status() == StatusCode::NOT_MODIFIED {
        return unchanged;
    }
    let Ok(_maker) = shared.maps.makers.acquire().await else {
        return StatusCode::INTERNAL_SERVER_ERROR.into_response();
    };
    let made = tokio::task::spawn_blocking(move || {
        let moved_m = placement.map_or((0.0, 0.0), |p| (p.east_m, p.north_m));
        (format.make)(&MapCells { moved_m, ..cached.cells.clone() }, origin)
    });
    match made.await {
        Ok(Some(bytes)) => {
            tagged(&headers, &tag, || ([(header::CONTENT_TYPE, format.content_type)], bytes).into_response())
        }
        _ => error(StatusCode::INTERNAL_SERVER_ERROR, "the file could not be made"),
    }
}

/// The list of archived maps.
pub(in crate::http) async fn archives(State(shared): State<Shared>) -> Response {
    shared.respond(SurfaceRequest::Archives).await
}

/// An archived map as a file.
pub(in crate::http) async fn archived(shared: Shared, name: String, format: FileFormat) -> Response {
    let cells = match shared.request(SurfaceRequest::ArchivedMap(name)).await {
        Ok(Reply::Map(cells)) => cells,
        Ok(other) => return respond(other),
        Err(busy) => return busy,
    };
    let origin = shared.snapshots.borrow().state.mission.origin;
    let Ok(_maker) = shared.maps.makers.acquire().await else {
        return StatusCode::INTERNAL_SERVER_ERROR.into_response();
    };
    match tokio::task::spawn_blocking(move || (format.make)(&cells, origin)).await {
        Ok(Some(bytes)) => ([(header::CONTENT_TYPE, format.content_type)], bytes).into_response(),
        _ => error(StatusCode::INTERNAL_SERVER_ERROR, "the file could not be made"),
    }
}
