//! Programs that connect and send items: each gets an answer on a line of its own.

use super::feed::{Arrived, Feed, LabelQueue};
use scenecast_core::UserError;
use scenecast_labels::{Item, Refusal, Stream};
use std::io::{self, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::sync_channel;
use std::time::{Duration, Instant};

/// Connections at a time.
const MAX_CONNECTIONS: usize = 4;
/// A connection that sends no byte for so long is closed, so that it does not keep others out.
const IDLE: Duration = Duration::from_secs(60);
/// Longest wait for the map to take an item.
const ANSWER_WAIT: Duration = Duration::from_secs(30);

/// A connection of either kind.
pub(super) trait Connection: Read + Write + Send + 'static {
    fn set_timeouts(&self, idle: Duration) -> io::Result<()>;
}

impl Connection for TcpStream {
    fn set_timeouts(&self, idle: Duration) -> io::Result<()> {
        self.set_nonblocking(false)?;
        self.set_read_timeout(Some(idle))?;
        self.set_write_timeout(Some(idle))
    }
}

/// Listens at an address and port.
pub(crate) fn network(place: &str) -> Result<Feed, UserError> {
    let failed = |e: io::Error| UserError::Failed(format!("labels.source: {place}: {e}"));
    let listener = TcpListener::bind(place).map_err(failed)?;
    let local = listener.local_addr().map_err(failed)?;
    if !local.ip().is_loopback() {
        tracing::warn!("labels.source: every program that reaches {local} can write the map");
    }
    tracing::info!("labels are taken at {local}");
    serve(move || listener.accept().map(|(stream, peer)| (stream, peer.to_string())))
}

/// Accepts connections on a thread of its own, each with its thread.
pub(super) fn serve<C: Connection>(
    accept: impl Fn() -> io::Result<(C, String)> + Send + 'static,
) -> Result<Feed, UserError> {
    let (queue, feed) = LabelQueue::new();
    let open = Arc::new(AtomicUsize::new(0));
    let listen = move || {
        loop {
            let Ok((stream, peer)) = accept() else {
                std::thread::sleep(Duration::from_millis(200));
                continue;
            };
            if open.load(Ordering::Relaxed) >= MAX_CONNECTIONS {
                tracing::warn!("labels: {peer} is turned away: there are {MAX_CONNECTIONS} connections already");
                continue;
            }
            open.fetch_add(1, Ordering::Relaxed);
            let (queue, count) = (queue.clone(), Arc::clone(&open));
            let work = move || {
                receive(stream, &peer, &queue);
                count.fetch_sub(1, Ordering::Relaxed);
            };
            if std::thread::Builder::new().name("labels-in".to_owned()).spawn(work).is_err() {
                open.fetch_sub(1, Ordering::Relaxed);
            }
        }
    };
    let started = std::thread::Builder::new().name("labels-listen".to_owned()).spawn(listen);
    started.map_err(|e| UserError::Failed(format!("the labels' thread did not start: {e}")))?;
    Ok(feed)
}

/// Takes the items of a connection until it ends, or until a header of it is refused.
fn receive(mut stream: impl Connection, peer: &str, queue: &LabelQueue) {
    if stream.set_timeouts(IDLE).is_err() {
        return;
    }
    let (mut items, mut buffer) = (Stream::default(), vec![0; 1 << 16]);
    while !items.is_over() {
        let length = match stream.read(&mut buffer) {
            Ok(0) | Err(_) => break,
            Ok(length) => length,
        };
        let mut found: Vec<Result<Item, Refusal>> = Vec::new();
        items.push(buffer.get(..length).unwrap_or_default(), |item| found.push(item));
        for item in found {
            if !hand_over(item, peer, queue, &mut stream) {
                return;
            }
        }
    }
    if let Some(why) = items.finish() {
        hand_over(Err(why), peer, queue, &mut stream);
    }
}

/// Gives an item to the map and its answer to the connection; `false` if either is gone.
fn hand_over(item: Result<Item, Refusal>, peer: &str, queue: &LabelQueue, stream: &mut impl Write) -> bool {
    let (answer, answered) = sync_channel(1);
    let at = Some(Instant::now());
    let arrived = Arrived { origin: peer.to_owned(), mark: None, at, item, answer: Some(answer) };
    if !queue.push(arrived) {
        return false;
    }
    let line = match answered.recv_timeout(ANSWER_WAIT) {
        Ok(Ok(())) => "ok\n".to_owned(),
        Ok(Err(why)) => format!("refused: {why}\n"),
        Err(_) => "refused: the map does not take it now\n".to_owned(),
    };
    stream.write_all(line.as_bytes()).is_ok()
}
