//! Maps. Each version is requested from the surface once, however many clients read it, and everything is made of it beside the
//! link.

use super::readings::utc_at;
use crate::export::{MapFormat, map_body};
use crate::http::response::{accepts_gzip, error, gzip, respond, tagged};
use crate::http::shared::{CachedMap, MapCell, Shared, VehicleId};
use crate::tiles::TiledMap;
use axum::Json;
use axum::body::Bytes;
use axum::extract::{Query, State};
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Response};
use scenecast_protocol::map::{LabelTree, MAX_LABEL, Rect};
use scenecast_surface::state::{MapLabelTree, ReplaySide, VehicleMarker, seconds};
use scenecast_surface::{MapCaption, MapCells, Reply, SurfaceRequest};
use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::Arc;
use tokio::sync::Mutex;

pub(in crate::http) const TILES: &str = "application/x-scenecast-tiles";
/// Packed responses that are kept of one map.
const MAX_PACKED: usize = 16;

/// The latest map of a vehicle.
pub(super) async fn latest(shared: &Shared, id: u8) -> Result<Arc<CachedMap>, Response> {
    let mut maps = shared.maps.maps.lock().await;
    let published = {
        let snapshot = shared.snapshots.borrow();
        snapshot.vehicle(id).map(|v| (v.map.version, v.map.updated_s))
    };
    if let (Some(cached), Some((version, updated_s))) = (maps.get(&id), published)
        && cached.map.cells().version >= version
        && cached.updated_s >= updated_s
    {
        return Ok(cached.clone());
    }
    let cells = match shared.request(SurfaceRequest::Map(id)).await? {
        Reply::Map(cells) => cells,
        other => return Err(respond(other)),
    };
    let updated_s = published.and_then(|(_, at)| at);
    let (held, run) = (maps.get(&id).cloned(), shared.maps.run);
    let compared = tokio::task::spawn_blocking(move || {
        let map = held.map_or_else(|| TiledMap::first(cells.clone(), run), |held| held.map.next(cells.clone()));
        Arc::new(CachedMap { map, updated_s, packed: Mutex::default() })
    });
    let cached = compared.await.map_err(|_| StatusCode::INTERNAL_SERVER_ERROR.into_response())?;
    maps.insert(id, cached.clone());
    Ok(cached)
}

/// The cells of the map or of a region in JSON, with the age of each.
pub(in crate::http) async fn map(
    State(shared): State<Shared>,
    VehicleId(id): VehicleId,
    Query(query): Query<BTreeMap<String, String>>,
    headers: HeaderMap,
) -> Response {
    let region = match region(&query) {
        Ok(region) => region,
        Err(reason) => return error(StatusCode::UNPROCESSABLE_ENTITY, reason),
    };
    let cached = match latest(&shared, id).await {
        Ok(cached) => cached,
        Err(response) => return response,
    };
    let tag = format!("{id}-{}-{region:?}", cached.map.tag()).replace(['"', ' '], "");
    if is_held(&headers, &tag) {
        return tagged(&headers, &tag, || StatusCode::OK.into_response());
    }
    let made = tokio::task::spawn_blocking(move || map_body(cached.map.cells(), region)).await;
    match made {
        Ok(Ok(body)) => tagged(&headers, &tag, || Json(body).into_response()),
        Ok(Err(reason)) => error(StatusCode::UNPROCESSABLE_ENTITY, reason),
        Err(_) => StatusCode::INTERNAL_SERVER_ERROR.into_response(),
    }
}

/// The labels that a cell had before.
pub(in crate::http) async fn cell_history(
    State(shared): State<Shared>,
    VehicleId(id): VehicleId,
    MapCell(cell): MapCell,
) -> Response {
    shared.respond(SurfaceRequest::FormerLabels(id, cell)).await
}

fn is_held(headers: &HeaderMap, tag: &str) -> bool {
    tagged(headers, tag, || StatusCode::OK.into_response()).status() == StatusCode::NOT_MODIFIED
}

/// Why a query of a map is not one; as text one line for the client.
#[derive(Debug, thiserror::Error)]
enum QueryFault {
    #[error("{name}: a region needs x0, y0, width and height in cells; the range is {low} to {high}")]
    Region { name: &'static str, low: i64, high: i64 },
    #[error("labels: it takes a number of labels, 1 to {MAX_LABEL}")]
    Labels,
}

/// The region of a request, in cells; `None` for the whole map.
fn region(query: &BTreeMap<String, String>) -> Result<Option<Rect>, QueryFault> {
    const NAMES: [&str; 4] = ["x0", "y0", "width", "height"];
    if !query.keys().any(|name| NAMES.contains(&name.as_str())) {
        return Ok(None);
    }
    let number = |name: &'static str, low: i64, high: i64| {
        let value = query.get(name).and_then(|text| text.parse::<i64>().ok());
        value.filter(|v| (low..=high).contains(v)).ok_or(QueryFault::Region { name, low, high })
    };
    let corner = |name: &'static str| number(name, i32::MIN.into(), i32::MAX.into()).map(|v| v as i32);
    let size = |name: &'static str| number(name, 1, u32::MAX.into()).map(|v| v as u32);
    Ok(Some(Rect { x: corner("x0")?, y: corner("y0")?, width: size("width")?, height: size("height")? }))
}

/// The tiles that have changed since the tag `since`, or all.
pub(in crate::http) async fn tiles(
    State(shared): State<Shared>,
    VehicleId(id): VehicleId,
    Query(query): Query<BTreeMap<String, String>>,
    headers: HeaderMap,
) -> Response {
    let cached = match latest(&shared, id).await {
        Ok(cached) => cached,
        Err(response) => return response,
    };
    let is_packed = accepts_gzip(&headers);
    let made = packed_tiles(cached, query.get("since").cloned(), is_packed).await;
    let Some(bytes) = made else { return StatusCode::INTERNAL_SERVER_ERROR.into_response() };
    let mut response = ([(header::CONTENT_TYPE, TILES), (header::CACHE_CONTROL, "no-store")], bytes).into_response();
    let headers = response.headers_mut();
    headers.insert(header::VARY, header::HeaderValue::from_static("accept-encoding"));
    if is_packed {
        headers.insert(header::CONTENT_ENCODING, header::HeaderValue::from_static("gzip"));
    }
    response
}

async fn packed_tiles(cached: Arc<CachedMap>, since: Option<String>, is_packed: bool) -> Option<Bytes> {
    if !is_packed {
        let made = tokio::task::spawn_blocking(move || cached.map.tiles_since(since.as_deref()));
        return made.await.ok().map(Bytes::from);
    }
    // Pages that wait for the same tiles wait for one of them to be packed.
    let own = cached.clone();
    let mut kept = own.packed.lock().await;
    if let Some(bytes) = kept.get(&since) {
        return Some(bytes.clone());
    }
    let wanted = since.clone();
    let made = tokio::task::spawn_blocking(move || gzip(&cached.map.tiles_since(wanted.as_deref())));
    let bytes: Bytes = made.await.ok()??.into();
    if kept.len() < MAX_PACKED {
        kept.insert(since, bytes.clone());
    }
    Some(bytes)
}

/// The parameters of a file: `labels`, the number of labels at which the tree is cut.
pub(in crate::http) type MapQuery = BTreeMap<String, String>;

/// Where the tree is cut; `None` for all labels.
fn cut(query: &MapQuery) -> Result<Option<usize>, QueryFault> {
    let Some(text) = query.get("labels") else { return Ok(None) };
    let count = text.parse().ok().filter(|count| (1..=usize::from(MAX_LABEL)).contains(count));
    count.map(Some).ok_or(QueryFault::Labels)
}

fn cut_at(count: Option<usize>, cells: MapCells) -> MapCells {
    match count {
        Some(count) => cells.cut(count),
        None => cells,
    }
}

/// The map as a file.
pub(in crate::http) async fn file(
    shared: Shared,
    id: u8,
    query: MapQuery,
    headers: HeaderMap,
    format: MapFormat,
) -> Response {
    let count = match cut(&query) {
        Ok(count) => count,
        Err(reason) => return error(StatusCode::UNPROCESSABLE_ENTITY, reason),
    };
    let cached = match latest(&shared, id).await {
        Ok(cached) => cached,
        Err(response) => return response,
    };
    let at = cached.map.cells().at;
    let (origin, moved_m, book, tree, markers, caption) = {
        let snapshot = shared.snapshots.borrow();
        let vehicle = snapshot.vehicle(id);
        let book = vehicle.map(|v| v.label_book.clone()).unwrap_or_default();
        let tree = vehicle.and_then(|v| v.label_tree.as_ref()).and_then(MapLabelTree::tree);
        let dated = |m: &VehicleMarker| (m.clone(), Some(utc_at(&snapshot.stamps, m.at_s)));
        let markers: Vec<_> = vehicle.iter().flat_map(|v| v.markers.iter().map(dated)).collect();
        let name = vehicle.map_or(String::new(), |v| v.name.clone());
        let side = snapshot.state.replay.as_ref().map_or(ReplaySide::Operator, |replay| replay.side);
        let (mission, epoch) = (snapshot.state.mission.name.clone(), vehicle.map_or(0, |v| v.map.epoch));
        let utc = utc_at(&snapshot.stamps, seconds(at));
        let caption = MapCaption { mission, address: id, name, epoch, utc, side };
        let moved_m = vehicle.map_or((0.0, 0.0), |v| v.map.shift_m());
        (snapshot.state.mission.origin, moved_m, book, tree, markers, Some(caption))
    };
    let mut named = DefaultHasher::new();
    book.hash(&mut named);
    [moved_m.0, moved_m.1].map(f64::to_bits).hash(&mut named);
    origin.map(|o| [o.lat_deg, o.lon_deg].map(f64::to_bits)).hash(&mut named);
    caption.as_ref().map(|c: &MapCaption| (&c.name, c.side.name())).hash(&mut named);
    (count, tree.as_ref().map(LabelTree::to_bytes)).hash(&mut named);
    markers.iter().for_each(|(m, _)| (m.number, &m.text, m.at_s.to_bits()).hash(&mut named));
    let tag = format!("{id}-{}-{:x}", cached.map.tag(), named.finish());
    if is_held(&headers, &tag) {
        return tagged(&headers, &tag, || StatusCode::OK.into_response());
    }
    let Ok(_maker) = shared.maps.makers.acquire().await else {
        return StatusCode::INTERNAL_SERVER_ERROR.into_response();
    };
    let made = tokio::task::spawn_blocking(move || {
        let cells = MapCells { moved_m, book, tree, markers, caption, ..cached.map.cells().clone() };
        format.export(&cut_at(count, cells), origin)
    });
    match made.await {
        Ok(Ok(bytes)) => {
            tagged(&headers, &tag, || ([(header::CONTENT_TYPE, format.content_type())], bytes).into_response())
        }
        Ok(Err(reason)) => error(StatusCode::UNPROCESSABLE_ENTITY, reason),
        Err(_) => error(StatusCode::INTERNAL_SERVER_ERROR, "the file could not be made"),
    }
}

/// The list of archived maps.
pub(in crate::http) async fn archives(State(shared): State<Shared>) -> Response {
    shared.respond(SurfaceRequest::Archives).await
}

/// An archived map as a file.
pub(in crate::http) async fn archived(shared: Shared, name: String, query: MapQuery, format: MapFormat) -> Response {
    let count = match cut(&query) {
        Ok(count) => count,
        Err(reason) => return error(StatusCode::UNPROCESSABLE_ENTITY, reason),
    };
    let cells = match shared.request(SurfaceRequest::ArchivedMap(name)).await {
        Ok(Reply::Map(cells)) => cells,
        Ok(other) => return respond(other),
        Err(busy) => return busy,
    };
    let origin = shared.snapshots.borrow().state.mission.origin;
    let Ok(_maker) = shared.maps.makers.acquire().await else {
        return StatusCode::INTERNAL_SERVER_ERROR.into_response();
    };
    match tokio::task::spawn_blocking(move || format.export(&cut_at(count, cells), origin)).await {
        Ok(Ok(bytes)) => ([(header::CONTENT_TYPE, format.content_type())], bytes).into_response(),
        Ok(Err(reason)) => error(StatusCode::UNPROCESSABLE_ENTITY, reason),
        Err(_) => error(StatusCode::INTERNAL_SERVER_ERROR, "the file could not be made"),
    }
}
