//! Changes as server-sent events.

use super::connections::EVENTS;
use super::server::{Shared, refusal};
use super::snapshot::Snapshot;
use super::state::MapEvent;
use axum::body::{Body, Bytes};
use axum::extract::State;
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use std::collections::{BTreeMap, VecDeque};
use std::convert::Infallible;
use std::sync::Arc;
use tokio::sync::{OwnedSemaphorePermit, watch};

/// Most streams at a time.
pub(super) const MOST: usize = 64;

/// What a reader has been told.
struct Feed {
    snapshots: watch::Receiver<Arc<Snapshot>>,
    told: BTreeMap<u8, u64>,
    queue: VecDeque<Bytes>,
    first: bool,
    _seat: OwnedSemaphorePermit,
}

/// Events as they come: always the newest state, and which maps have changed. A slow reader misses states, never the last.
pub(super) async fn events(State(shared): State<Shared>) -> Response {
    let Ok(seat) = shared.streams.clone().try_acquire_owned() else {
        return refusal(StatusCode::SERVICE_UNAVAILABLE, &format!("{MOST} streams of events are open: no more are"));
    };
    let (told, queue) = (BTreeMap::new(), VecDeque::new());
    let feed = Feed { snapshots: shared.snapshots, told, queue, first: true, _seat: seat };
    let stream = futures_util::stream::unfold(feed, |mut feed| async move {
        while feed.queue.is_empty() {
            feed.next().await?;
        }
        feed.queue.pop_front().map(|bytes| (Ok::<_, Infallible>(bytes), feed))
    });
    ([(header::CONTENT_TYPE, EVENTS)], Body::from_stream(stream)).into_response()
}

impl Feed {
    /// Waits for a new state; `None` when there will be none.
    async fn next(&mut self) -> Option<()> {
        if !std::mem::take(&mut self.first) {
            self.snapshots.changed().await.ok()?;
        }
        let snapshot = self.snapshots.borrow_and_update().clone();
        if snapshot.json.is_empty() {
            return Some(());
        }
        // The text is the same for all readers, so they share it.
        let (begin, end) = (Bytes::from_static(b"event: state\ndata: "), Bytes::from_static(b"\n\n"));
        self.queue.extend([begin, snapshot.json.clone(), end]);
        for v in &snapshot.state.vehicles {
            if self.told.insert(v.id, v.map.version) != Some(v.map.version) {
                let event = MapEvent { vehicle: v.id, version: v.map.version };
                let data = serde_json::to_string(&event).unwrap_or_default();
                self.queue.push_back(format!("event: map\ndata: {data}\n\n").into());
            }
        }
        Some(())
    }
}
