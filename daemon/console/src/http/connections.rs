//! Connections, with bounds on their number, time and memory.

use super::access::PeerAddress;
use axum::Router;
use axum::body::{Body, Bytes};
use axum::http::header::CONTENT_TYPE;
use http_body_util::BodyExt;
use hyper::body::{Body as HttpBody, Frame, Incoming, SizeHint};
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use std::collections::BTreeMap;
use std::convert::Infallible;
use std::pin::Pin;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, ready};
use std::time::{Duration, Instant};
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::Notify;
use tokio::task::AbortHandle;
use tokio::time::Sleep;
use tower_service::Service;

/// Connections at a time. A further one replaces the oldest connection that waits for its client, or else the oldest
/// that is not a stream of events; the number of streams has a lower bound.
const MAX_CONNECTIONS: usize = 256;
/// No connection is replaced before: without it, a flood of others ends a request before its head is read. Further
/// connections wait meanwhile, in the queue of the system.
const MIN_TIME: Duration = Duration::from_millis(250);
/// For the head of a request, also for the next one on a connection.
const HEAD_TIMEOUT: Duration = Duration::from_secs(10);
const MAX_HEAD_BYTES: usize = 16 * 1024;
const MAX_HEADERS: usize = 64;
/// The type of a stream of events.
pub(super) const EVENT_STREAM: &str = "text/event-stream";
/// For a client to read sent data.
const READ_TIMEOUT: Duration = Duration::from_secs(20);
/// For the client of a stream of events, once the buffers are full.
const STREAM_READ_TIMEOUT: Duration = Duration::from_secs(5);
/// The bytes that a client must read within the timeout, unless it reads everything.
const MIN_PROGRESS_BYTES: usize = 8 * 1024;
/// The kernel's send buffer of a stream of events: data in it count as sent, although the client may not have read them.
const STREAM_SEND_BUFFER_BYTES: usize = 8 * 1024;

/// Serves `router` on `listener` until the runtime ends.
pub(super) async fn serve(listener: TcpListener, router: Router) {
    let connections = Connections::default();
    for number in 0u64.. {
        let (stream, from) = match listener.accept().await {
            Ok((stream, from)) => (stream, PeerAddress(from.ip())),
            Err(e) => {
                // Out of file descriptors, or the client has left: a later connection may succeed.
                tracing::warn!("the operator's page cannot take a connection: {e}");
                tokio::time::sleep(Duration::from_millis(100)).await;
                continue;
            }
        };
        let activity = connections.room(number).await;
        let (all, router) = (connections.clone(), router.clone());
        let task = tokio::spawn(async move {
            // An error here is the fault of the client.
            let _ = serve_one(stream, from, router, activity).await;
            all.remove(number);
        });
        connections.add(number, task.abort_handle());
    }
}

async fn serve_one(
    stream: TcpStream,
    from: PeerAddress,
    router: Router,
    activity: Arc<Activity>,
) -> Result<(), hyper::Error> {
    let _ = stream.set_nodelay(true);
    let io = TimeoutStream::new(stream, activity.clone());
    let service = hyper::service::service_fn(move |request: hyper::Request<Incoming>| {
        let active = Arc::new(ActiveRequest::new(&activity));
        let mut request = request.map(|body| Body::new(RequestBody::new(body, active.clone())));
        request.extensions_mut().insert(from);
        let mut router = router.clone();
        async move {
            let response = router.call(request).await?;
            if response.headers().get(CONTENT_TYPE).is_some_and(|kind| kind == EVENT_STREAM) {
                active.activity.is_stream.store(true, Ordering::Relaxed);
            }
            // The request is active until the last byte is sent.
            Ok::<_, Infallible>(response.map(move |body| {
                Body::new(body.map_frame(move |frame| {
                    let _active = &active;
                    frame
                }))
            }))
        }
    });
    let mut http = http1::Builder::new();
    http.timer(TokioTimer::new())
        .header_read_timeout(HEAD_TIMEOUT)
        .max_buf_size(MAX_HEAD_BYTES)
        .max_headers(MAX_HEADERS);
    http.serve_connection(TokioIo::new(io), service).with_upgrades().await
}

/// The use of a connection.
#[derive(Debug, Default)]
struct Activity {
    /// Requests that were received whole and whose response is not complete.
    requests: AtomicUsize,
    is_stream: AtomicBool,
}

/// A request whose response is not complete. It is active once its body has arrived: until then the connection waits for
/// its client, and clients that send no body must not displace others.
struct ActiveRequest {
    activity: Arc<Activity>,
    is_whole: AtomicBool,
}

impl ActiveRequest {
    fn new(activity: &Arc<Activity>) -> Self {
        Self { activity: activity.clone(), is_whole: AtomicBool::new(false) }
    }

    fn handle_whole(&self) {
        if !self.is_whole.swap(true, Ordering::Relaxed) {
            self.activity.requests.fetch_add(1, Ordering::Relaxed);
        }
    }
}

impl Drop for ActiveRequest {
    fn drop(&mut self) {
        if *self.is_whole.get_mut() {
            self.activity.requests.fetch_sub(1, Ordering::Relaxed);
        }
    }
}

/// The body of a request; its end makes the request active.
struct RequestBody {
    body: Incoming,
    request: Arc<ActiveRequest>,
}

impl RequestBody {
    fn new(body: Incoming, request: Arc<ActiveRequest>) -> Self {
        if body.is_end_stream() {
            request.handle_whole();
        }
        Self { body, request }
    }
}

impl HttpBody for RequestBody {
    type Data = Bytes;
    type Error = hyper::Error;

    fn poll_frame(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<Option<hyper::Result<Frame<Bytes>>>> {
        let frame = ready!(Pin::new(&mut self.body).poll_frame(cx));
        if frame.is_none() || self.body.is_end_stream() {
            self.request.handle_whole();
        }
        Poll::Ready(frame)
    }

    fn is_end_stream(&self) -> bool {
        self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.body.size_hint()
    }
}

/// All connections by their number.
#[derive(Clone, Default)]
struct Connections {
    all: Arc<Mutex<BTreeMap<u64, Connection>>>,
    one_ended: Arc<Notify>,
}

struct Connection {
    activity: Arc<Activity>,
    since: Instant,
    /// Ends the connection; `None` until its task has started.
    end: Option<AbortHandle>,
}

impl Connection {
    /// The number of its active requests; `None` if it must not be ended.
    fn active_requests(&self) -> Option<usize> {
        let may_end = self.end.is_some() && !self.activity.is_stream.load(Ordering::Relaxed);
        may_end.then(|| self.activity.requests.load(Ordering::Relaxed))
    }
}

impl Connections {
    fn lock(&self) -> MutexGuard<'_, BTreeMap<u64, Connection>> {
        self.all.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Registers a connection as soon as there is room for it.
    async fn room(&self, number: u64) -> Arc<Activity> {
        loop {
            match self.take_room(number, Instant::now()) {
                Ok(activity) => return activity,
                Err(wait) => drop(tokio::time::timeout(wait, self.one_ended.notified()).await),
            }
        }
    }

    /// Registers a connection, and ends another one if there are too many; or the time until one may be ended.
    fn take_room(&self, number: u64, now: Instant) -> Result<Arc<Activity>, Duration> {
        let mut all = self.lock();
        if all.len() >= MAX_CONNECTIONS {
            let replaced = all.iter().filter_map(|(&n, c)| Some((c.active_requests()?, n, c.since))).min();
            if let Some((_, replaced, since)) = replaced {
                let wait = MIN_TIME.saturating_sub(now.saturating_duration_since(since));
                if !wait.is_zero() {
                    return Err(wait);
                }
                if let Some(end) = all.remove(&replaced).and_then(|c| c.end) {
                    end.abort();
                }
            }
        }
        let activity = Arc::<Activity>::default();
        all.insert(number, Connection { activity: activity.clone(), since: now, end: None });
        Ok(activity)
    }

    fn add(&self, number: u64, end: AbortHandle) {
        // The connection may have ended meanwhile.
        if let Some(connection) = self.lock().get_mut(&number) {
            connection.end = Some(end);
        }
    }

    fn remove(&self, number: u64) {
        self.lock().remove(&number);
        self.one_ended.notify_one();
    }
}

/// A stream that fails when the client does not read.
struct TimeoutStream {
    stream: TcpStream,
    activity: Arc<Activity>,
    is_bounded: bool,
    /// Runs while data wait for the client.
    timeout: Option<Pin<Box<Sleep>>>,
    /// Bytes written since the timeout began.
    progress: usize,
}

impl TimeoutStream {
    fn new(stream: TcpStream, activity: Arc<Activity>) -> Self {
        Self { stream, activity, is_bounded: false, timeout: None, progress: 0 }
    }

    /// Bounds the send buffer once the response is known to be a stream of events.
    fn prepare_write(&mut self) {
        if !self.is_bounded && self.activity.is_stream.load(Ordering::Relaxed) {
            self.is_bounded = true;
            // Without the bound the stream ends too, but later.
            let _ = socket2::SockRef::from(&self.stream).set_send_buffer_size(STREAM_SEND_BUFFER_BYTES);
        }
    }

    fn wait(&mut self, cx: &mut Context<'_>) -> Poll<std::io::Error> {
        let limit = if self.is_bounded { STREAM_READ_TIMEOUT } else { READ_TIMEOUT };
        if self.timeout.is_none() {
            self.progress = 0;
        }
        let timeout = self.timeout.get_or_insert_with(|| Box::pin(tokio::time::sleep(limit)));
        ready!(timeout.as_mut().poll(cx));
        Poll::Ready(std::io::ErrorKind::TimedOut.into())
    }

    fn or_wait(&mut self, written: Poll<std::io::Result<usize>>, cx: &mut Context<'_>) -> Poll<std::io::Result<usize>> {
        let Poll::Ready(result) = written else { return self.wait(cx).map(Err) };
        self.progress += result.as_ref().map_or(0, |n| *n);
        if self.progress >= MIN_PROGRESS_BYTES {
            self.handle_progress();
        }
        Poll::Ready(result)
    }

    fn handle_progress(&mut self) {
        (self.timeout, self.progress) = (None, 0);
    }
}

impl AsyncRead for TimeoutStream {
    fn poll_read(mut self: Pin<&mut Self>, cx: &mut Context<'_>, buf: &mut ReadBuf<'_>) -> Poll<std::io::Result<()>> {
        Pin::new(&mut self.stream).poll_read(cx, buf)
    }
}

impl AsyncWrite for TimeoutStream {
    fn poll_write(mut self: Pin<&mut Self>, cx: &mut Context<'_>, buf: &[u8]) -> Poll<std::io::Result<usize>> {
        self.prepare_write();
        let written = Pin::new(&mut self.stream).poll_write(cx, buf);
        self.or_wait(written, cx)
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        bufs: &[std::io::IoSlice<'_>],
    ) -> Poll<std::io::Result<usize>> {
        self.prepare_write();
        let written = Pin::new(&mut self.stream).poll_write_vectored(cx, bufs);
        self.or_wait(written, cx)
    }

    fn is_write_vectored(&self) -> bool {
        self.stream.is_write_vectored()
    }

    /// Called when all data are written.
    fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<std::io::Result<()>> {
        self.handle_progress();
        Pin::new(&mut self.stream).poll_flush(cx)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<std::io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(cx)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn a_new_connection_replaces_the_oldest_one_that_only_waits() {
        let (connections, begin) = (Connections::default(), Instant::now());
        let open = |number: u64, now| {
            let activity = connections.take_room(number, now)?;
            connections.add(number, tokio::spawn(std::future::pending::<()>()).abort_handle());
            Ok::<_, Duration>(activity)
        };
        let activities: Vec<_> = (0..MAX_CONNECTIONS as u64).map(|n| open(n, begin).unwrap()).collect();
        let served = ActiveRequest::new(&activities[0]);
        served.handle_whole();
        let _without_body = ActiveRequest::new(&activities[1]);
        let tenth = MIN_TIME / 10;
        assert_eq!(open(1000, begin + tenth).unwrap_err(), 9 * tenth);
        let later = begin + MIN_TIME;
        open(1000, later).unwrap();
        open(1001, later).unwrap();
        let all: Vec<u64> = connections.lock().keys().copied().collect();
        assert_eq!((&all[..2], &all[all.len() - 2..]), (&[0, 3][..], &[1000, 1001][..]));
        drop(served);
        open(1002, later).unwrap();
        assert!(!connections.lock().contains_key(&0), "its request has ended");
    }

    #[tokio::test]
    async fn the_end_of_one_connection_makes_room_at_once() {
        let connections = Connections::default();
        for number in 0..MAX_CONNECTIONS as u64 {
            connections.room(number).await;
            connections.add(number, tokio::spawn(std::future::pending::<()>()).abort_handle());
        }
        let room = connections.room(1000);
        tokio::pin!(room);
        assert!(std::future::poll_fn(|cx| Poll::Ready(room.as_mut().poll(cx).is_pending())).await);
        connections.remove(5);
        assert!(std::future::poll_fn(|cx| Poll::Ready(room.as_mut().poll(cx).is_ready())).await);
    }
}
