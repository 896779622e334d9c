//! The HTTP server: what is asked for, and who answers it.

use super::answer::{Ask, Reply};
use super::body::Order;
use super::guard::{self, Names};
use super::maps::Maps;
use super::operations::operations;
use super::orders::{BudgetOrder, ConstraintsOrder, ExemplarOrder, UtilityOrder};
use super::snapshot::Snapshot;
use super::state::Refusal;
use super::token::Access;
use super::{assets, compress, connections, events};
use axum::extract::{DefaultBodyLimit, FromRequestParts, Path, State};
use axum::http::request::Parts;
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::{Json, Router};
use scenecast_core::UserError;
use scenecast_protocol::directive::Constraints;
use scenecast_surface::{FenceOrder, LimitsOrder, SettingsOrder};
use std::collections::BTreeMap;
use std::sync::Arc;
use tokio::net::TcpListener;
use tokio::sync::{Semaphore, mpsc, oneshot, watch};
use zeroize::Zeroizing;

/// Most bytes of a body.
const BODY: usize = 16 * 1024;

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

/// A place to listen on, and who may ask there.
#[derive(Debug)]
pub struct Entrance {
    listener: TcpListener,
    access: Access,
}

/// What every handler sees.
#[derive(Debug, Clone)]
pub(super) struct Shared {
    requests: mpsc::Sender<Request>,
    pub(super) snapshots: watch::Receiver<Arc<Snapshot>>,
    pub(super) maps: Arc<Maps>,
    pub(super) access: Arc<Access>,
    pub(super) streams: Arc<Semaphore>,
}

/// Takes an address to listen on; one that is taken is the user's to change, as is one that others reach without a token.
///
/// `name` is the one by which others ask for this machine, if it has one.
pub async fn bind(
    address: &str,
    how_to_change: &str,
    token: Option<Zeroizing<String>>,
    name: &str,
) -> Result<Entrance, UserError> {
    let addresses: Vec<_> = tokio::net::lookup_host(address)
        .await
        .map_err(|e| UserError::Input(format!("{how_to_change}: {address} is no ADDRESS:PORT to listen on: {e}")))?
        .collect();
    let is_loopback = addresses.iter().all(|a| a.ip().is_loopback());
    if !is_loopback && token.is_none() {
        return Err(UserError::Input(format!(
            "{how_to_change} = {address}: others than this machine could steer the vehicle there; set console.token_file to \
             a file that scenecast key token has written, or listen on a loopback address such as 127.0.0.1:8460"
        )));
    }
    let names = if is_loopback { Names::Loopback } else { Names::Network(name.to_owned()) };
    let problem =
        |e| UserError::Input(format!("cannot listen on {address}: {e}; choose another port with {how_to_change}"));
    let listener = TcpListener::bind(address).await.map_err(problem)?;
    Ok(Entrance { listener, access: Access::new(names, token) })
}

/// Serves the page until the runtime ends.
pub fn start(entrance: Entrance) -> Console {
    let (ask, requests) = mpsc::channel(64);
    let (snapshots, seen) = watch::channel(Arc::new(Snapshot::default()));
    let shared = Shared {
        requests: ask,
        snapshots: seen,
        maps: Arc::default(),
        access: Arc::new(entrance.access),
        streams: Arc::new(Semaphore::new(events::MOST)),
    };
    tokio::spawn(connections::serve(entrance.listener, router(shared)));
    Console { requests, snapshots }
}

fn router(shared: Shared) -> Router {
    let routes = operations().into_iter().fold(Router::new(), |r, o| r.route(o.path, (o.route)()));
    routes
        .fallback(assets::page)
        .layer(axum::middleware::from_fn(compress::compress))
        .layer(DefaultBodyLimit::max(BODY))
        .layer(axum::middleware::from_fn_with_state(shared.access.clone(), guard::guard))
        .with_state(shared)
}

impl Shared {
    /// What the surface says to an ask; the error is an answer that says that it is busy.
    pub(super) async fn reply(&self, ask: Ask) -> Result<Reply, Response> {
        let busy = || refusal(StatusCode::SERVICE_UNAVAILABLE, "too many requests at once");
        let (reply, answered) = oneshot::channel();
        self.requests.try_send((ask, reply)).map_err(|_| busy())?;
        answered.await.map_err(|_| busy())
    }

    pub(super) async fn ask(&self, ask: Ask) -> Response {
        self.reply(ask).await.map_or_else(|busy| busy, respond)
    }
}

/// The answer that a reply makes.
pub(super) fn respond(reply: Reply) -> Response {
    match reply {
        Reply::Map(cells) => Json(cells.told()).into_response(),
        Reply::File(content_type, bytes) => ([(header::CONTENT_TYPE, content_type)], bytes).into_response(),
        Reply::Fit(fit) => Json(*fit).into_response(),
        Reply::Accepted(accepted) => (StatusCode::ACCEPTED, Json(accepted)).into_response(),
        Reply::NotFound => not_found(),
        Reply::Refused(why) => refusal(StatusCode::UNPROCESSABLE_ENTITY, &why),
    }
}

pub(super) fn refusal(status: StatusCode, why: &str) -> Response {
    (status, Json(Refusal { error: why.to_owned() })).into_response()
}

pub(super) fn not_found() -> Response {
    refusal(StatusCode::NOT_FOUND, "there is no such thing")
}

/// The vehicle in a path.
pub(super) struct VehicleId(pub(super) u8);

impl<S: Send + Sync> FromRequestParts<S> for VehicleId {
    type Rejection = Response;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Response> {
        let found = Path::<BTreeMap<String, String>>::from_request_parts(parts, state).await;
        let id = found.ok().and_then(|Path(names)| names.get("id")?.parse().ok());
        id.map(Self).ok_or_else(not_found)
    }
}

pub(super) async fn state(State(shared): State<Shared>) -> Response {
    let json = shared.snapshots.borrow().json.clone();
    if json.is_empty() {
        return refusal(StatusCode::SERVICE_UNAVAILABLE, "the mission has not begun");
    }
    ([(header::CONTENT_TYPE, "application/json")], json).into_response()
}

pub(super) async fn exemplar(State(shared): State<Shared>, VehicleId(id): VehicleId, uri: axum::http::Uri) -> Response {
    let file = uri.path().rsplit('/').next().unwrap_or_default();
    let name = file.strip_suffix(".webp").map(|name| name.split_once('-').unwrap_or((name, "")));
    let number = |text: &str| if text.is_empty() { Some(None) } else { text.parse().ok().map(Some) };
    match name.and_then(|(label, picture)| Some((label.parse().ok()?, number(picture)?))) {
        Some((label, picture)) => shared.ask(Ask::Exemplar(id, label, picture)).await,
        None => not_found(),
    }
}

pub(super) async fn utility(
    State(shared): State<Shared>,
    VehicleId(id): VehicleId,
    Order(order): Order<UtilityOrder>,
) -> Response {
    let weight =
        |(label, w): (String, f64)| label.parse().map(|l| (l, w)).map_err(|_| format!("{label:?} is no label"));
    match order.weights.into_iter().map(weight).collect::<Result<BTreeMap<u8, f64>, String>>() {
        Ok(weights) => shared.ask(Ask::Utility(id, weights, (order.exploration, order.curiosity))).await,
        Err(why) => refusal(StatusCode::UNPROCESSABLE_ENTITY, &why),
    }
}

pub(super) async fn request(
    State(shared): State<Shared>,
    VehicleId(id): VehicleId,
    Order(order): Order<ExemplarOrder>,
) -> Response {
    shared.ask(Ask::Request(id, order)).await
}

pub(super) async fn constraints(
    State(shared): State<Shared>,
    VehicleId(id): VehicleId,
    Order(order): Order<ConstraintsOrder>,
) -> Response {
    shared.ask(Ask::Order(id, Constraints { hold: order.hold, abort: order.abort })).await
}

pub(super) async fn fence(
    State(shared): State<Shared>,
    VehicleId(id): VehicleId,
    Order(order): Order<FenceOrder>,
) -> Response {
    shared.ask(Ask::Fence(id, order)).await
}

pub(super) async fn limits(
    State(shared): State<Shared>,
    VehicleId(id): VehicleId,
    Order(order): Order<LimitsOrder>,
) -> Response {
    shared.ask(Ask::Limits(id, order)).await
}

pub(super) async fn settings(
    State(shared): State<Shared>,
    VehicleId(id): VehicleId,
    Order(order): Order<SettingsOrder>,
) -> Response {
    shared.ask(Ask::Settings(id, order)).await
}

pub(super) async fn budget(State(shared): State<Shared>, Order(order): Order<BudgetOrder>) -> Response {
    shared.ask(Ask::Budget(order)).await
}
