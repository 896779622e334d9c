//! The state that all handlers share.

use super::access::{Access, EditRate, Seats};
use super::response::{error, not_found, respond};
use crate::tiles::TiledMap;
use axum::body::Bytes;
use axum::extract::{FromRequestParts, Path};
use axum::http::request::Parts;
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use scenecast_protocol::map::Cell;
use scenecast_surface::{ClientRequest, Giver, OrderKind, Reply, Snapshot, SurfaceRequest};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;
use tokio::sync::{Mutex, Semaphore, mpsc, oneshot, watch};

/// A request that waits for the reply of the surface.
pub type PendingRequest = (ClientRequest, oneshot::Sender<Reply>);

#[derive(Debug, Clone)]
pub(super) struct Shared {
    requests: mpsc::Sender<PendingRequest>,
    pub(super) snapshots: watch::Receiver<Arc<Snapshot>>,
    pub(super) maps: Arc<MapCache>,
    pub(super) access: Arc<Access>,
    pub(super) seats: Seats,
    edit_rate: EditRate,
    pub(super) document: Bytes,
}

/// The latest map of each vehicle that a client has requested.
#[derive(Debug)]
pub(super) struct MapCache {
    pub(super) maps: Mutex<BTreeMap<u8, Arc<CachedMap>>>,
    /// One file is made at a time, so that the link keeps the rest of the machine.
    pub(super) makers: Semaphore,
    /// A random number that names this run of the server in the tags of maps.
    pub(super) run: u32,
}

/// A map, and the responses that were made of it, since several pages request the same.
#[derive(Debug)]
pub(super) struct CachedMap {
    pub(super) map: TiledMap,
    /// Mission time at which the vehicle confirmed the map last.
    pub(super) updated_s: Option<f64>,
    /// Packed tiles, by the tag since which they have changed.
    pub(super) packed: Mutex<BTreeMap<Option<String>, Bytes>>,
}

impl Shared {
    pub(super) fn new(
        requests: mpsc::Sender<PendingRequest>,
        snapshots: watch::Receiver<Arc<Snapshot>>,
        access: Access,
        document: Bytes,
    ) -> Self {
        let mut run = [0; 4];
        // A number that repeats costs a client of an earlier run at most a wrong map until its next one.
        let _ = getrandom::fill(&mut run);
        Self {
            requests,
            snapshots,
            maps: Arc::new(MapCache {
                maps: Mutex::default(),
                makers: Semaphore::new(1),
                run: u32::from_le_bytes(run),
            }),
            access: Arc::new(access),
            seats: Seats::default(),
            edit_rate: EditRate::default(),
            document,
        }
    }

    /// The reply of the surface to a reading; the error is a response with status 503.
    pub(super) async fn request(&self, request: SurfaceRequest) -> Result<Reply, Response> {
        self.send(ClientRequest { by: None, request }).await
    }

    async fn send(&self, request: ClientRequest) -> Result<Reply, Response> {
        let busy = || error(StatusCode::SERVICE_UNAVAILABLE, "too many requests at once");
        // Many readings leave room for orders, and many orders for a hold.
        let kept_free = match request.request.order_kind() {
            Some(OrderKind::Stop) => 0,
            _ if request.request.is_reading() => self.requests.max_capacity() / 2,
            _ => self.requests.max_capacity() / 4,
        };
        if self.requests.capacity() <= kept_free {
            return Err(busy());
        }
        let (sender, reply) = oneshot::channel();
        self.requests.try_send((request, sender)).map_err(|_| busy())?;
        reply.await.map_err(|_| busy())
    }

    /// The reply of the surface to a reading, as a response.
    pub(super) async fn respond(&self, request: SurfaceRequest) -> Response {
        self.request(request).await.map_or_else(|busy| busy, respond)
    }

    /// Tells the surface something of a principal that needs no reply, unless there is much of it.
    pub(super) fn note(&self, by: Giver, request: SurfaceRequest) {
        let has_room = self.requests.capacity() > self.requests.max_capacity() / 2;
        if has_room && self.edit_rate.take(by.name(), Instant::now()) {
            let _ = self.requests.try_send((ClientRequest { by: Some(by), request }, oneshot::channel().0));
        }
    }

    /// The reply of the surface to an order of a principal, as a response.
    pub(super) async fn order(&self, by: Giver, request: SurfaceRequest) -> Response {
        let is_edit = request.order_kind() == Some(OrderKind::Record);
        if is_edit && !self.edit_rate.take(by.name(), Instant::now()) {
            let refusal = error(
                StatusCode::TOO_MANY_REQUESTS,
                "too many edits by you: ten a second are possible, so try again soon",
            );
            return ([(header::RETRY_AFTER, "1")], refusal).into_response();
        }
        self.send(ClientRequest { by: Some(by), request }).await.map_or_else(|busy| busy, respond)
    }
}

/// The address of the vehicle in a path.
pub(super) struct VehicleId(pub(super) u8);

impl<S: Send + Sync> FromRequestParts<S> for VehicleId {
    type Rejection = Response;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Response> {
        let found = Path::<BTreeMap<String, String>>::from_request_parts(parts, state).await;
        let id = found.ok().and_then(|Path(names)| names.get("id")?.parse().ok());
        id.map(Self).ok_or_else(not_found)
    }
}

/// The column and the row of a cell in a path.
pub(super) struct MapCell(pub(super) Cell);

impl<S: Send + Sync> FromRequestParts<S> for MapCell {
    type Rejection = Response;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Response> {
        let found = Path::<BTreeMap<String, String>>::from_request_parts(parts, state).await;
        let cell =
            found.ok().and_then(|Path(names)| Some((names.get("x")?.parse().ok()?, names.get("y")?.parse().ok()?)));
        cell.map(|(x, y)| Self(Cell::new(x, y))).ok_or_else(not_found)
    }
}

/// The name of an archived map in a path.
pub(super) struct ArchiveName(pub(super) String);

impl<S: Send + Sync> FromRequestParts<S> for ArchiveName {
    type Rejection = Response;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Response> {
        let found = Path::<BTreeMap<String, String>>::from_request_parts(parts, state).await;
        found.ok().and_then(|Path(mut names)| names.remove("name")).map(Self).ok_or_else(not_found)
    }
}
