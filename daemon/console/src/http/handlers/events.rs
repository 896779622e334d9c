//! Changes as server-sent events.

use crate::http::connections::EVENT_STREAM;
use crate::http::response::error;
use crate::http::seats::{MAX_STREAMS, Seat};
use crate::http::shared::Shared;
use crate::snapshot::Snapshot;
use crate::state::MapEvent;
use axum::Extension;
use axum::body::{Body, Bytes};
use axum::extract::State;
use axum::http::{HeaderName, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use scenecast_surface::Giver;
use std::collections::{BTreeMap, VecDeque};
use std::convert::Infallible;
use std::sync::Arc;
use std::time::Instant;
use tokio::sync::watch;

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
