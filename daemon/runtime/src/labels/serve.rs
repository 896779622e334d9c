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

const MAX_CONNECTIONS: usize = 4;
/// A connection that sends no byte for so long is closed, so that it does not keep others out.
const IDLE: Duration = Duration::from_secs(60);

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

/// Listens at the address and port of a key.
pub(crate) fn network(place: &str, key: &str) -> Result<Feed, UserError> {
    let failed = |e: io::Error| UserError::Failed(format!("{key}: {place}: {e}"));
    let listener = TcpListener::bind(place).map_err(failed)?;
    let local = listener.local_addr().map_err(failed)?;
    if !local.ip().is_loopback() {
        tracing::warn!("{key}: every program that reaches {local} can write the map");
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
                if let Err(why) = receive(stream, &peer, &queue) {
                    tracing::warn!("labels: {peer}: the connection is closed: {why}");
                }
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

/// Why a connection does not go on.
#[derive(Debug, thiserror::Error)]
enum ConnectionEnd {
    #[error("no byte went through it for {} s", IDLE.as_secs())]
    Silent,
    #[error(transparent)]
    Broken(io::Error),
    #[error("the vehicle's program ends")]
    ProgramEnds,
}

impl From<io::Error> for ConnectionEnd {
    fn from(error: io::Error) -> Self {
        match error.kind() {
            io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut => Self::Silent,
            _ => Self::Broken(error),
        }
    }
}

/// Takes the items of a connection until it ends, or until a header of it is refused.
fn receive(mut stream: impl Connection, peer: &str, queue: &LabelQueue) -> Result<(), ConnectionEnd> {
    stream.set_timeouts(IDLE)?;
    let (mut items, mut buffer) = (Stream::default(), vec![0; 1 << 16]);
    let mut end = Ok(());
    while !items.is_over() {
        let length = match stream.read(&mut buffer) {
            Ok(0) => break,
            Ok(length) => length,
            Err(e) if e.kind() == io::ErrorKind::Interrupted => continue,
            Err(e) => {
                end = Err(e.into());
                break;
            }
        };
        let mut found: Vec<Result<Item, Refusal>> = Vec::new();
        items.push(buffer.get(..length).unwrap_or_default(), |item| found.push(item));
        for item in found {
            hand_over(item, peer, queue, &mut stream)?;
        }
    }
    if let Some(why) = items.finish() {
        hand_over(Err(why), peer, queue, &mut stream)?;
    }
    end
}

/// Gives an item to the map and its answer to the connection. The answer comes when the map has taken or refused the item,
/// however long that takes, so that it is never a wrong one.
fn hand_over(
    item: Result<Item, Refusal>,
    peer: &str,
    queue: &LabelQueue,
    stream: &mut impl Write,
) -> Result<(), ConnectionEnd> {
    let (answer, answered) = sync_channel(1);
    let at = Some(Instant::now());
    let is_given = queue.push(Arrived { origin: peer.to_owned(), mark: None, at, item, answer: Some(answer) });
    let answer = if is_given { answered.recv().ok() } else { None };
    let line = match &answer {
        Some(Ok(())) => "ok\n".to_owned(),
        Some(Err(why)) => format!("refused: {why}\n"),
        None => "refused: the vehicle's program ends\n".to_owned(),
    };
    stream.write_all(line.as_bytes())?;
    answer.map(drop).ok_or(ConnectionEnd::ProgramEnds)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::SyncSender;

    /// A program that sends some bytes and then nothing.
    struct Silent<'a>(&'a [u8], Vec<u8>, SyncSender<Vec<u8>>);

    impl Connection for Silent<'static> {
        fn set_timeouts(&self, _: Duration) -> io::Result<()> {
            Ok(())
        }
    }

    impl Read for Silent<'_> {
        fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
            if self.0.is_empty() { Err(io::ErrorKind::WouldBlock.into()) } else { self.0.read(buffer) }
        }
    }

    impl Write for Silent<'_> {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.1.extend(bytes);
            Ok(bytes.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    impl Drop for Silent<'_> {
        fn drop(&mut self) {
            let _ = self.2.send(std::mem::take(&mut self.1));
        }
    }

    /// Receives `{"kind":"classes"}`, which `take` answers; returns what the program reads, and why the connection ended.
    fn run(take: impl FnOnce(Feed)) -> (String, String) {
        let (queue, feed) = LabelQueue::new();
        let (said, hears) = sync_channel(1);
        let stream = Silent(b"{\"kind\":\"classes\"}\n", Vec::new(), said);
        let work = std::thread::spawn(move || receive(stream, "here", &queue));
        take(feed);
        let end = work.join().unwrap().unwrap_err();
        (String::from_utf8(hears.recv().unwrap()).unwrap(), end.to_string())
    }

    #[test]
    fn an_idle_or_unanswered_connection_ends_with_the_reason() {
        let answered = run(|mut feed| {
            let arrived = feed.next(IDLE).unwrap();
            assert!(arrived.at.is_some() && arrived.item.is_ok());
            arrived.answer.unwrap().send(Ok(())).unwrap();
        });
        assert_eq!(answered, ("ok\n".to_owned(), "no byte went through it for 60 s".to_owned()));
        // The vehicle's program ends before the item is taken.
        let unanswered = run(|mut feed| drop(feed.next(IDLE)));
        let why = "the vehicle's program ends";
        assert_eq!(unanswered, (format!("refused: {why}\n"), why.to_owned()));
    }
}
