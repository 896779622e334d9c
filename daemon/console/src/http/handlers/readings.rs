//! Readings: the state and its changes as server-sent events, exemplars, fitting settings, the log of the mission.

use crate::bodies::{LogLine, LogList, MapEvent};
use crate::export::harmless;
use crate::http::access::{MAX_STREAMS, Seat};
use crate::http::connections::EVENT_STREAM;
use crate::http::response::{JsonOrder, error, not_found, respond};
use crate::http::shared::{Shared, VehicleId};
use axum::body::{Body, Bytes};
use axum::extract::{Query, State};
use axum::http::{HeaderName, HeaderValue, StatusCode, Uri, header};
use axum::response::{IntoResponse, Response};
use axum::{Extension, Json};
use scenecast_core::utc_text;
use scenecast_messages::contents::Stamps;
use scenecast_surface::state::{ReplayOrder, seconds};
use scenecast_surface::{Giver, LogEntry, LogKind, Reply, Snapshot, SurfaceRequest};
use serde::Deserialize;
use std::collections::{BTreeMap, VecDeque};
use std::convert::Infallible;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::sync::watch;

const JSON: &str = "application/json";
const MAX_FIT_BPS: f64 = 1e7;
/// For the first state after the start of the surface.
const START_TIMEOUT: Duration = Duration::from_secs(10);

/// The latest state; just after the start of the surface a client waits for the first one.
pub(in crate::http) async fn state(State(mut shared): State<Shared>) -> Response {
    let first = shared.snapshots.wait_for(|snapshot| !snapshot.json.is_empty());
    match tokio::time::timeout(START_TIMEOUT, first).await {
        Ok(Ok(snapshot)) => ([(header::CONTENT_TYPE, JSON)], snapshot.json.clone()).into_response(),
        _ => error(StatusCode::SERVICE_UNAVAILABLE, "the mission has not begun"),
    }
}

/// An image of a label: the latest as in `3.webp`, or the one with a number as in `3-17.webp`.
pub(in crate::http) async fn exemplar(State(shared): State<Shared>, VehicleId(id): VehicleId, uri: Uri) -> Response {
    let file = uri.path().rsplit('/').next().unwrap_or_default();
    let name = file.strip_suffix(".webp").map(|name| name.split_once('-').unwrap_or((name, "")));
    let number = |text: &str| if text.is_empty() { Some(None) } else { text.parse().ok().map(Some) };
    match name.and_then(|(label, image)| Some((label.parse().ok()?, number(image)?))) {
        Some((label, image)) => shared.respond(SurfaceRequest::Exemplar(id, label, image)).await,
        None => not_found(),
    }
}

/// The images of the sea floor after the version `since`.
pub(in crate::http) async fn floor(
    State(shared): State<Shared>,
    VehicleId(id): VehicleId,
    Query(query): Query<BTreeMap<String, String>>,
) -> Response {
    match query.get("since").map_or(Ok(0), |since| since.parse()) {
        Ok(since) => shared.respond(SurfaceRequest::Floor(id, since)).await,
        Err(_) => error(StatusCode::UNPROCESSABLE_ENTITY, "since takes a version: a whole number from 0 on"),
    }
}

/// An image of the sea floor by its middle in decimetres, as in `310_-10.webp`.
pub(in crate::http) async fn floor_image(State(shared): State<Shared>, VehicleId(id): VehicleId, uri: Uri) -> Response {
    let file = uri.path().rsplit('/').next().unwrap_or_default();
    let place = file.strip_suffix(".webp").and_then(|place| place.split_once('_'));
    match place.and_then(|(east, north)| Some((east.parse().ok()?, north.parse().ok()?))) {
        Some(place) => shared.respond(SurfaceRequest::FloorImage(id, place)).await,
        None => not_found(),
    }
}

/// Settings that fit the budget `bits_per_s`.
pub(in crate::http) async fn fit(
    State(shared): State<Shared>,
    VehicleId(id): VehicleId,
    Query(query): Query<BTreeMap<String, String>>,
) -> Response {
    let bits_per_s = match query.get("bits_per_s") {
        None => None,
        Some(text) => match text.parse().ok().filter(|b| (1.0..=MAX_FIT_BPS).contains(b)) {
            Some(bits_per_s) => Some(bits_per_s),
            None => {
                let line = format!("bits_per_s {text:?}: the range is 1 to {MAX_FIT_BPS}");
                return error(StatusCode::UNPROCESSABLE_ENTITY, &line);
            }
        },
    };
    shared.respond(SurfaceRequest::Fit(id, bits_per_s)).await
}

/// The picture of the true classes of a simulated sea floor.
pub(in crate::http) async fn truth(State(shared): State<Shared>) -> Response {
    let picture = shared.snapshots.borrow().truth.as_ref().map(|truth| truth.picture.clone());
    picture.map_or_else(not_found, |picture| ([(header::CONTENT_TYPE, "image/png")], picture).into_response())
}

/// Shows another moment of a record.
pub(in crate::http) async fn replay(
    State(shared): State<Shared>,
    JsonOrder(order): JsonOrder<ReplayOrder>,
) -> Response {
    shared.respond(SurfaceRequest::Replay(order)).await
}

/// The report of the dive so far.
pub(in crate::http) async fn report(State(shared): State<Shared>) -> Response {
    shared.respond(SurfaceRequest::Report).await
}

/// The events of a record.
pub(in crate::http) async fn replay_events(State(shared): State<Shared>) -> Response {
    shared.respond(SurfaceRequest::ReplayEvents).await
}

pub(in crate::http) async fn document(State(shared): State<Shared>) -> Response {
    ([(header::CONTENT_TYPE, JSON)], shared.document).into_response()
}

/// The stream of one reader.
struct Feed {
    snapshots: watch::Receiver<Arc<Snapshot>>,
    /// The version of each vehicle's map in the last event.
    versions: BTreeMap<u8, u64>,
    queue: VecDeque<Bytes>,
    is_first: bool,
    seat: Seat,
}

/// The latest state after each change, and the maps that have changed. A slow reader misses states, but never the last one.
pub(in crate::http) async fn events(State(shared): State<Shared>, Extension(by): Extension<Giver>) -> Response {
    let Some(seat) = shared.seats.take(by.name(), Instant::now()) else {
        let line = format!("{MAX_STREAMS} streams of events are open, which is the maximum");
        return error(StatusCode::SERVICE_UNAVAILABLE, &line);
    };
    let (versions, queue) = (BTreeMap::new(), VecDeque::new());
    let feed = Feed { snapshots: shared.snapshots, versions, queue, is_first: true, seat };
    let stream = futures_util::stream::unfold(feed, |mut feed| async move {
        while feed.queue.is_empty() {
            feed.next().await?;
        }
        feed.queue.pop_front().map(|bytes| (Ok::<_, Infallible>(bytes), feed))
    });
    // A proxy must not collect events.
    let unbuffered = (HeaderName::from_static("x-accel-buffering"), HeaderValue::from_static("no"));
    let head = [(header::CONTENT_TYPE, HeaderValue::from_static(EVENT_STREAM)), unbuffered];
    (head, Body::from_stream(stream)).into_response()
}

impl Feed {
    /// Waits for a new state; `None` at the end of the program, and when another stream gets the seat.
    async fn next(&mut self) -> Option<()> {
        if !std::mem::take(&mut self.is_first) {
            tokio::select! {
                change = self.snapshots.changed() => change.ok()?,
                _ = &mut self.seat.end => return None,
            }
        }
        let snapshot = self.snapshots.borrow_and_update().clone();
        if snapshot.json.is_empty() {
            return Some(());
        }
        // All readers share the text.
        let (begin, end) = (Bytes::from_static(b"event: state\ndata: "), Bytes::from_static(b"\n\n"));
        self.queue.extend([begin, snapshot.json.clone(), end]);
        for v in &snapshot.state.vehicles {
            if self.versions.insert(v.id, v.map.version) != Some(v.map.version) {
                let event = MapEvent { vehicle: v.id, version: v.map.version };
                let data = serde_json::to_string(&event).unwrap_or_default();
                self.queue.push_back(format!("event: map\ndata: {data}\n\n").into());
            }
        }
        Some(())
    }
}

/// The entries that a client wants; without a member, all.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(in crate::http) struct LogFilter {
    vehicle: Option<u8>,
    kind: Option<String>,
    /// Only entries with a higher number.
    since: Option<u64>,
}

/// The last entries as JSON.
pub(in crate::http) async fn log(State(shared): State<Shared>, filter: LogQuery) -> Response {
    lines(&shared, filter).await.map_or_else(|refused| refused, |entries| Json(LogList { entries }).into_response())
}

/// The same as a table for a spreadsheet.
pub(in crate::http) async fn table(State(shared): State<Shared>, filter: LogQuery) -> Response {
    let entries = match lines(&shared, filter).await {
        Ok(entries) => entries,
        Err(refused) => return refused,
    };
    match to_csv(&entries) {
        Ok(bytes) => ([(header::CONTENT_TYPE, "text/csv; charset=utf-8")], bytes).into_response(),
        Err(fault) => error(StatusCode::INTERNAL_SERVER_ERROR, fault.to_string()),
    }
}

type LogQuery = Result<Query<LogFilter>, axum::extract::rejection::QueryRejection>;

async fn lines(shared: &Shared, filter: LogQuery) -> Result<Vec<LogLine>, Response> {
    let names = || LogKind::ALL.map(LogKind::name).join(", ");
    let refused = |line: &str| error(StatusCode::UNPROCESSABLE_ENTITY, line);
    let Query(filter) = filter.map_err(|_| refused("the query takes vehicle, kind and since"))?;
    if let Some(kind) = filter.kind.as_ref().filter(|kind| LogKind::ALL.iter().all(|k| k.name() != kind.as_str())) {
        return Err(refused(&format!("kind {kind:?}: it takes one of {}", names())));
    }
    let entries = match shared.request(SurfaceRequest::Log).await? {
        Reply::Log(entries) => entries,
        other => return Err(respond(other)),
    };
    let stamps = shared.snapshots.borrow().stamps.clone();
    let is_wanted = |entry: &&LogEntry| {
        filter.vehicle.is_none_or(|vehicle| entry.vehicle.is_some_and(|v| v.number() == vehicle))
            && filter.kind.as_ref().is_none_or(|kind| entry.kind.name() == kind)
            && filter.since.is_none_or(|since| entry.number > since)
    };
    let line = |entry: &LogEntry| {
        let at_s = seconds(entry.at);
        LogLine {
            number: entry.number,
            at_s,
            utc: utc_at(&stamps, at_s),
            vehicle: entry.vehicle.map(|v| v.number()),
            kind: entry.kind.name().to_owned(),
            by: entry.by.clone(),
            text: entry.text.clone(),
        }
    };
    Ok(entries.iter().filter(is_wanted).map(line).collect())
}

fn to_csv(entries: &[LogLine]) -> Result<Vec<u8>, csv::Error> {
    let mut table = csv::Writer::from_writer(Vec::new());
    table.write_record(["number", "utc", "mission_s", "vehicle", "kind", "by", "text"])?;
    for e in entries {
        let vehicle = e.vehicle.map_or(String::new(), |v| v.to_string());
        let (number, at_s, by) = (e.number.to_string(), format!("{:.1}", e.at_s), e.by.as_deref().unwrap_or_default());
        table.write_record([&number, &e.utc, &at_s, &vehicle, &e.kind, by, &harmless(&e.text)])?;
    }
    table.into_inner().map_err(|e| e.into_error().into())
}

/// A mission time in seconds in UTC, as in RFC 3339.
pub(in crate::http) fn utc_at(stamps: &Stamps, at_s: f64) -> String {
    utc_text(stamps.at(at_s).nanos() as f64 / 1e9)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_quotes_texts_and_starts_no_formula() {
        let text = "=1, \"wreck\"".to_owned();
        let line = LogLine {
            number: 7,
            at_s: 1.25,
            utc: utc_text(0.0),
            vehicle: Some(2),
            kind: "record".into(),
            by: None,
            text,
        };
        let table = String::from_utf8(to_csv(&[line]).unwrap()).unwrap();
        let row = "7,1970-01-01T00:00:00Z,1.2,2,record,,\"'=1, \"\"wreck\"\"\"";
        assert_eq!(table, format!("number,utc,mission_s,vehicle,kind,by,text\n{row}\n"));
    }
}
