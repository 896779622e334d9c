//! Connections: as many as there is room for, each with bounds in time and memory.

use axum::Router;
use axum::body::Body;
use axum::http::header::CONTENT_TYPE;
use http_body_util::BodyExt;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use std::collections::BTreeMap;
use std::convert::Infallible;
use std::pin::Pin;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, ready};
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::{TcpListener, TcpStream};
use tokio::task::AbortHandle;
use tokio::time::Sleep;
use tower_service::Service;

/// Most connections at a time. A new one takes the place of the oldest that asks for nothing, or else of the oldest that is
/// no stream of events; of streams there are fewer than seats.
const MOST: usize = 256;
/// Longest time for the head of a request, also of the next one on a connection.
const HEAD: Duration = Duration::from_secs(10);
/// Most bytes of a head.
const HEAD_BYTES: usize = 16 * 1024;
/// Most headers in it.
const HEADERS: usize = 64;
/// The type of a stream of events.
pub(super) const EVENTS: &str = "text/event-stream";
/// How long a client may leave what it is sent unread.
const UNREAD: Duration = Duration::from_secs(20);

/// Serves `router` on `listener` for ever.
pub(super) async fn serve(listener: TcpListener, router: Router) {
    let seats = Seats::default();
    for number in 0u64.. {
        let stream = match listener.accept().await {
            Ok((stream, _)) => stream,
            Err(e) => {
                // Out of descriptors, or a client that was gone before it was taken: the next one may do better.
                tracing::warn!("the operator's page cannot take a connection: {e}");
                tokio::time::sleep(Duration::from_millis(100)).await;
                continue;
            }
        };
        let work = seats.make_room(number);
        let (seats_then, router) = (seats.clone(), router.clone());
        let task = tokio::spawn(async move {
            // A client that breaks off or says nonsense is its own affair.
            let _ = converse(stream, router, work).await;
            seats_then.leave(number);
        });
        seats.take(number, task.abort_handle());
    }
}

async fn converse(stream: TcpStream, router: Router, work: Arc<Work>) -> Result<(), hyper::Error> {
    let _ = stream.set_nodelay(true);
    let service = hyper::service::service_fn(move |request: hyper::Request<hyper::body::Incoming>| {
        let asking = Asking::new(&work);
        let mut router = router.clone();
        async move {
            let answer = router.call(request.map(Body::new)).await?;
            if answer.headers().get(CONTENT_TYPE).is_some_and(|kind| kind == EVENTS) {
                asking.0.is_stream.store(true, Ordering::Relaxed);
            }
            // The client waits for us until the last byte is out.
            Ok::<_, Infallible>(answer.map(move |body| {
                Body::new(body.map_frame(move |frame| {
                    let _until_the_last = &asking;
                    frame
                }))
            }))
        }
    });
    let mut http = http1::Builder::new();
    http.timer(TokioTimer::new()).header_read_timeout(HEAD).max_buf_size(HEAD_BYTES).max_headers(HEADERS);
    http.serve_connection(TokioIo::new(Impatient { stream, unread: None }), service).await
}

/// What a connection is there for.
#[derive(Debug, Default)]
struct Work {
    /// Requests that are being answered.
    asks: AtomicUsize,
    is_stream: AtomicBool,
}

/// A request that is being answered.
struct Asking(Arc<Work>);

impl Asking {
    fn new(work: &Arc<Work>) -> Self {
        work.asks.fetch_add(1, Ordering::Relaxed);
        Self(work.clone())
    }
}

impl Drop for Asking {
    fn drop(&mut self) {
        self.0.asks.fetch_sub(1, Ordering::Relaxed);
    }
}

/// The connections that there are.
#[derive(Clone, Default)]
struct Seats(Arc<Mutex<BTreeMap<u64, Seat>>>);

struct Seat {
    work: Arc<Work>,
    /// Ends the connection; none while it is being set up.
    end: Option<AbortHandle>,
}

impl Seat {
    /// Whether it may be taken away, and how hard that is.
    fn hardness(&self) -> Option<usize> {
        let may_end = self.end.is_some() && !self.work.is_stream.load(Ordering::Relaxed);
        may_end.then(|| self.work.asks.load(Ordering::Relaxed))
    }
}

impl Seats {
    fn lock(&self) -> MutexGuard<'_, BTreeMap<u64, Seat>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Reserves a seat, if need be that of another connection.
    fn make_room(&self, number: u64) -> Arc<Work> {
        let mut seats = self.lock();
        if seats.len() >= MOST {
            let weakest = seats.iter().filter_map(|(&n, s)| Some((s.hardness()?, n))).min();
            if let Some(end) = weakest.and_then(|(_, n)| seats.remove(&n)).and_then(|s| s.end) {
                end.abort();
            }
        }
        let work = Arc::<Work>::default();
        seats.insert(number, Seat { work: work.clone(), end: None });
        work
    }

    fn take(&self, number: u64, end: AbortHandle) {
        // It may have left already.
        if let Some(seat) = self.lock().get_mut(&number) {
            seat.end = Some(end);
        }
    }

    fn leave(&self, number: u64) {
        self.lock().remove(&number);
    }
}

/// A stream that gives a client up that does not read.
struct Impatient {
    stream: TcpStream,
    unread: Option<Pin<Box<Sleep>>>,
}

impl Impatient {
    fn wait(&mut self, cx: &mut Context<'_>) -> Poll<std::io::Error> {
        let unread = self.unread.get_or_insert_with(|| Box::pin(tokio::time::sleep(UNREAD)));
        ready!(unread.as_mut().poll(cx));
        Poll::Ready(std::io::ErrorKind::TimedOut.into())
    }

    fn or_wait(&mut self, written: Poll<std::io::Result<usize>>, cx: &mut Context<'_>) -> Poll<std::io::Result<usize>> {
        if written.is_ready() {
            self.unread = None;
            return written;
        }
        self.wait(cx).map(Err)
    }
}

impl AsyncRead for Impatient {
    fn poll_read(mut self: Pin<&mut Self>, cx: &mut Context<'_>, buf: &mut ReadBuf<'_>) -> Poll<std::io::Result<()>> {
        Pin::new(&mut self.stream).poll_read(cx, buf)
    }
}

impl AsyncWrite for Impatient {
    fn poll_write(mut self: Pin<&mut Self>, cx: &mut Context<'_>, buf: &[u8]) -> Poll<std::io::Result<usize>> {
        let written = Pin::new(&mut self.stream).poll_write(cx, buf);
        self.or_wait(written, cx)
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        bufs: &[std::io::IoSlice<'_>],
    ) -> Poll<std::io::Result<usize>> {
        let written = Pin::new(&mut self.stream).poll_write_vectored(cx, bufs);
        self.or_wait(written, cx)
    }

    fn is_write_vectored(&self) -> bool {
        self.stream.is_write_vectored()
    }

    fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<std::io::Result<()>> {
        Pin::new(&mut self.stream).poll_flush(cx)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<std::io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(cx)
    }
}
