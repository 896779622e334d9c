//! The HTTP server.

use super::answer::{Ask, Reply};
use super::snapshot::Snapshot;
use super::{assets, guard};
use crate::asv::{FenceOrder, LimitsOrder};
use crate::problem::Problem;
use axum::extract::{DefaultBodyLimit, Path, State};
use axum::http::{StatusCode, Uri, header};
use axum::response::sse::{Event, KeepAlive, Sse};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use axum::{Json, Router};
use futures_util::Stream;
use scenecast_protocol::directive::Constraints;
use scenecast_protocol::schedule::Shares;
use serde::Deserialize;
use serde_json::json;
use std::collections::{BTreeMap, VecDeque};
use std::convert::Infallible;
use std::sync::Arc;
use std::time::Duration;
use tokio::net::TcpListener;
use tokio::sync::{mpsc, oneshot, watch};

/// An ask that waits for its reply.
pub type Request = (Ask, oneshot::Sender<Reply>);

/// The host's end of the console.
#[derive(Debug)]
pub struct Console {
    /// Asks of browsers, to be answered between two steps.
    pub requests: mpsc::Receiver<Request>,
    /// What every page shows.
    pub snapshots: watch::Sender<Arc<Snapshot>>,
}

#[derive(Debug, Clone)]
struct Shared {
    requests: mpsc::Sender<Request>,
    snapshots: watch::Receiver<Arc<Snapshot>>,
}

/// Takes an address to listen on; one that is taken or not of this machine is the user's to change.
pub async fn bind(address: &str, how_to_change: &str) -> Result<TcpListener, Problem> {
    let addresses: Vec<_> = tokio::net::lookup_host(address)
        .await
        .map_err(|e| Problem::Input(format!("{address} is no ADDRESS:PORT to listen on: {e}")))?
        .collect();
    if addresses.iter().any(|a| !a.ip().is_loopback()) {
        return Err(Problem::Input(format!(
            "{address}: the page is served on a loopback address only, such as 127.0.0.1:8460"
        )));
    }
    let problem =
        |e| Problem::Input(format!("cannot listen on {address}: {e}; choose another port with {how_to_change}"));
    TcpListener::bind(address).await.map_err(problem)
}

/// Serves the page on `listener` until the runtime ends.
pub fn start(listener: TcpListener) -> Console {
    let (ask, requests) = mpsc::channel(64);
    let (snapshots, seen) = watch::channel(Arc::new(Snapshot::default()));
    let router = router(Shared { requests: ask, snapshots: seen });
    tokio::spawn(async move {
        if let Err(e) = axum::serve(listener, router).await {
            tracing::error!("the operator's page ended: {e}");
        }
    });
    Console { requests, snapshots }
}

fn router(shared: Shared) -> Router {
    Router::new()
        .route("/api/v1/state", get(state))
        .route("/api/v1/events", get(events))
        .route("/api/v1/vehicles/{id}/map", get(map))
        .route("/api/v1/vehicles/{id}/map.png", get(map_png))
        .route("/api/v1/vehicles/{id}/exemplars/{file}", get(exemplar))
        .route("/api/v1/vehicles/{id}/utility", post(utility))
        .route("/api/v1/vehicles/{id}/exemplars", post(request))
        .route("/api/v1/vehicles/{id}/constraints", post(constraints))
        .route("/api/v1/vehicles/{id}/fence", post(fence))
        .route("/api/v1/vehicles/{id}/limits", post(limits))
        .route("/api/v1/vehicles/{id}/settings", post(settings))
        .route("/api/v1/budget", post(budget))
        .fallback(page)
        .layer(DefaultBodyLimit::max(16 * 1024))
        .layer(axum::middleware::from_fn(guard::guard))
        .with_state(shared)
}

impl Shared {
    async fn ask(&self, ask: Ask) -> Response {
        let (reply, answered) = oneshot::channel();
        let busy =
            || (StatusCode::SERVICE_UNAVAILABLE, Json(json!({ "error": "too many requests at once" }))).into_response();
        if self.requests.try_send((ask, reply)).is_err() {
            return busy();
        }
        match answered.await {
            Ok(Reply::Json(value)) => Json(value).into_response(),
            Ok(Reply::File(content_type, bytes)) => ([(header::CONTENT_TYPE, content_type)], bytes).into_response(),
            Ok(Reply::Accepted(value)) => (StatusCode::ACCEPTED, Json(value)).into_response(),
            Ok(Reply::NotFound) => not_found(),
            Ok(Reply::Refused(why)) => refused(&why),
            Err(_) => busy(),
        }
    }
}

fn not_found() -> Response {
    (StatusCode::NOT_FOUND, Json(json!({ "error": "there is no such thing" }))).into_response()
}

fn refused(why: &str) -> Response {
    (StatusCode::UNPROCESSABLE_ENTITY, Json(json!({ "error": why }))).into_response()
}

async fn state(State(shared): State<Shared>) -> Response {
    let state = shared.snapshots.borrow().state.clone();
    ([(header::CONTENT_TYPE, "application/json")], state).into_response()
}

/// Events as they come: always the newest state, and which maps have changed. A slow reader misses states, never the last.
async fn events(State(shared): State<Shared>) -> Sse<impl Stream<Item = Result<Event, Infallible>>> {
    struct Feed {
        snapshots: watch::Receiver<Arc<Snapshot>>,
        sent: BTreeMap<u8, u64>,
        queue: VecDeque<Event>,
        first: bool,
    }
    let feed = Feed { snapshots: shared.snapshots, sent: BTreeMap::new(), queue: VecDeque::new(), first: true };
    let stream = futures_util::stream::unfold(feed, |mut feed| async move {
        while feed.queue.is_empty() {
            if !std::mem::take(&mut feed.first) {
                feed.snapshots.changed().await.ok()?;
            }
            let snapshot = feed.snapshots.borrow_and_update().clone();
            feed.queue.push_back(Event::default().event("state").data(&snapshot.state));
            for (&vehicle, &version) in &snapshot.maps {
                if feed.sent.insert(vehicle, version) != Some(version) {
                    let data = json!({ "vehicle": vehicle, "version": version }).to_string();
                    feed.queue.push_back(Event::default().event("map").data(data));
                }
            }
        }
        feed.queue.pop_front().map(|event| (Ok(event), feed))
    });
    Sse::new(stream).keep_alive(KeepAlive::new().interval(Duration::from_secs(5)))
}

async fn map(State(shared): State<Shared>, Path(id): Path<u8>) -> Response {
    shared.ask(Ask::Map(id)).await
}

async fn map_png(State(shared): State<Shared>, Path(id): Path<u8>) -> Response {
    shared.ask(Ask::MapPng(id)).await
}

async fn exemplar(State(shared): State<Shared>, Path((id, file)): Path<(u8, String)>) -> Response {
    match file.strip_suffix(".webp").and_then(|label| label.parse().ok()) {
        Some(label) => shared.ask(Ask::Exemplar(id, label)).await,
        None => not_found(),
    }
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct UtilityBody {
    weights: BTreeMap<String, f64>,
    #[serde(default)]
    exploration: f64,
    #[serde(default)]
    curiosity: f64,
}

async fn utility(State(shared): State<Shared>, Path(id): Path<u8>, Json(body): Json<UtilityBody>) -> Response {
    let weights: Result<BTreeMap<u8, f64>, String> = body
        .weights
        .into_iter()
        .map(|(label, w)| label.parse().map(|l| (l, w)).map_err(|_| format!("{label:?} is no label")))
        .collect();
    match weights {
        Ok(weights) => shared.ask(Ask::Utility(id, weights, (body.exploration, body.curiosity))).await,
        Err(why) => refused(&why),
    }
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RequestBody {
    label: u8,
}

async fn request(State(shared): State<Shared>, Path(id): Path<u8>, Json(body): Json<RequestBody>) -> Response {
    shared.ask(Ask::Request(id, body.label)).await
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct ConstraintsBody {
    hold: bool,
    #[serde(default)]
    abort: bool,
}

async fn constraints(State(shared): State<Shared>, Path(id): Path<u8>, Json(body): Json<ConstraintsBody>) -> Response {
    shared.ask(Ask::Order(id, Constraints { hold: body.hold, abort: body.abort })).await
}

async fn fence(State(shared): State<Shared>, Path(id): Path<u8>, Json(body): Json<FenceOrder>) -> Response {
    shared.ask(Ask::Fence(id, body)).await
}

async fn limits(State(shared): State<Shared>, Path(id): Path<u8>, Json(body): Json<LimitsOrder>) -> Response {
    shared.ask(Ask::Limits(id, body)).await
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct SettingsBody {
    planner: Option<String>,
    refine_words_per_s: Option<u32>,
}

async fn settings(State(shared): State<Shared>, Path(id): Path<u8>, Json(body): Json<SettingsBody>) -> Response {
    shared.ask(Ask::Settings(id, body.planner, body.refine_words_per_s)).await
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct BudgetBody {
    budget_bps: u32,
    shares: Option<SharesBody>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct SharesBody {
    directive: u8,
    status: u8,
    fix: u8,
    map: u8,
    exemplar: u8,
}

async fn budget(State(shared): State<Shared>, Json(body): Json<BudgetBody>) -> Response {
    let shares = body.shares.map(|s| Shares([s.directive, s.status, s.fix, s.map, s.exemplar]));
    shared.ask(Ask::Budget(body.budget_bps, shares)).await
}

async fn page(uri: Uri) -> Response {
    match assets::find(uri.path().trim_start_matches('/')) {
        Some((content_type, bytes)) => ([(header::CONTENT_TYPE, content_type)], bytes).into_response(),
        None => not_found(),
    }
}
