//! The state, exemplars, settings that fit a budget, and the OpenAPI document.

use crate::http::response::{error, not_found};
use crate::http::shared::{Shared, VehicleId};
use crate::request::SurfaceRequest;
use axum::extract::{Query, State};
use axum::http::{StatusCode, Uri, header};
use axum::response::{IntoResponse, Response};
use std::collections::BTreeMap;
use std::time::Duration;

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

pub(in crate::http) async fn document(State(shared): State<Shared>) -> Response {
    ([(header::CONTENT_TYPE, JSON)], shared.document).into_response()
}
