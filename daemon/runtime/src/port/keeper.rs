//! Opens a port, again whenever it fails, and moves bytes between its stream and the host.

use super::udp::{self, PeerRule, UdpPeer};
use super::{FromPort, PortEnds, ToPort, read, tcp};
use scenecast_core::PortAddress;
use std::fs::File;
use std::io::{self, Write};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream, UdpSocket};
use tokio::time::Instant;
use tokio_serial::{SerialPort, SerialPortBuilderExt, SerialStream};

/// Time before a failed port is first opened again.
const FIRST_RETRY_INTERVAL: Duration = Duration::from_millis(200);
/// Maximum time between two attempts, short enough that a cable is soon noticed when it is plugged in again.
const MAX_RETRY_INTERVAL: Duration = Duration::from_secs(2);
/// Maximum wait for a connection; the default of the system is minutes.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(5);

/// An open port of any kind.
pub(crate) enum Opened {
    Serial(SerialStream),
    Connection(TcpStream),
    Listener(TcpListener),
    Socket(UdpSocket, Option<std::net::SocketAddr>),
    File(File),
}

pub(crate) async fn open(place: &PortAddress) -> io::Result<Opened> {
    Ok(match place {
        PortAddress::Serial(device, baud) => Opened::Serial(serial(device, *baud)?),
        PortAddress::Listen(address) => Opened::Listener(TcpListener::bind(address).await?),
        PortAddress::Connect(address) => {
            let connection = tokio::time::timeout(CONNECT_TIMEOUT, TcpStream::connect(address)).await;
            Opened::Connection(connection.map_err(|_| io::Error::new(io::ErrorKind::TimedOut, "no answer"))??)
        }
        PortAddress::Datagrams(own, remote) => {
            let (socket, remote) = udp::open(own, remote).await?;
            Opened::Socket(socket, remote)
        }
        PortAddress::File(path) => Opened::File(File::options().create(true).append(true).open(path)?),
    })
}

fn serial(device: &str, baud: u32) -> io::Result<SerialStream> {
    let mut stream = tokio_serial::new(device, baud).open_native_async()?;
    // Two ends may share a pseudo-terminal in a rehearsal; a system without exclusive access needs none.
    let _ = stream.set_exclusive(false);
    // Some modems garble their output while RTS is up and flow control off; a pseudo-terminal has no such line.
    let _ = stream.write_request_to_send(false);
    Ok(stream)
}

/// Keeps a port open until its host is gone. An unplugged adapter is opened again when its path exists again.
pub(super) struct PortKeeper {
    pub(super) name: &'static str,
    pub(super) place: PortAddress,
    pub(super) quiet: Option<Duration>,
    pub(super) rule: PeerRule,
    /// Whether datagrams go to the end of a link, which may know no address of ours.
    pub(super) knocks: bool,
    pub(super) ends: PortEnds,
}

impl PortKeeper {
    /// Serves `first`, then opens and serves the port again after each failure.
    pub(super) async fn run(mut self, first: Option<Opened>) {
        let mut next = first;
        let mut pause = FIRST_RETRY_INTERVAL;
        let (mut is_logged, mut was_open) = (false, false);
        while !self.ends.from.is_closed() {
            let began = Instant::now();
            let opened = match next.take() {
                Some(opened) => Ok(opened),
                None => open(&self.place).await,
            };
            let activity = PortActivity::new();
            let is_again = std::mem::replace(&mut was_open, opened.is_ok()) && is_logged;
            let ended = match opened {
                Ok(opened) => self.serve(opened, &activity, is_again).await,
                Err(e) => Err(e),
            };
            let Err(e) = ended else { return };
            // A port that is opened again and says nothing, or only who it is, has not recovered.
            let lasted = began.elapsed() > MAX_RETRY_INTERVAL + self.quiet.unwrap_or_default();
            if lasted && (activity.has_spoken() || !self.is_stream()) {
                (pause, is_logged) = (FIRST_RETRY_INTERVAL, false);
            }
            // A lasting failure is logged once as a warning.
            match std::mem::replace(&mut is_logged, true) {
                false => tracing::warn!("{}: {}: {e}; it is opened again when it is available", self.name, self.place),
                true => tracing::debug!("{}: {}: {e}", self.name, self.place),
            }
            tokio::time::sleep(pause).await;
            pause = (pause * 2).min(MAX_RETRY_INTERVAL);
        }
    }

    /// Whether the port is a stream of bytes of one device.
    fn is_stream(&self) -> bool {
        matches!(self.place, PortAddress::Serial(..) | PortAddress::Connect(_))
    }

    /// Carries bytes until the port fails, or the host is gone (`Ok`). `is_again`: it was open before and failed, which was logged.
    async fn serve(&mut self, opened: Opened, activity: &PortActivity, is_again: bool) -> io::Result<()> {
        match opened {
            Opened::Listener(_) => {}
            _ if is_again => tracing::debug!("{}: open", self.name),
            _ => tracing::info!("{}: open", self.name),
        }
        let result = match opened {
            Opened::Serial(stream) => carry(stream, self.quiet, activity, &mut self.ends).await,
            Opened::Connection(stream) => {
                let _ = stream.set_nodelay(true);
                carry(stream, self.quiet, activity, &mut self.ends).await
            }
            Opened::Listener(listener) => return tcp::accept(self.name, listener, self.quiet, &mut self.ends).await,
            Opened::Socket(socket, remote) => {
                let peer = UdpPeer::new(self.name, remote, self.rule, self.knocks, Instant::now());
                udp::carry(socket, peer, self.quiet, &mut self.ends).await
            }
            Opened::File(file) => append(file, &mut self.ends).await,
        };
        if result.is_err() && !self.ends.report(FromPort::Closed).await {
            return Ok(());
        }
        result
    }
}

/// A stream that accepts no byte for this time counts as dead.
const WRITE_TIMEOUT: Duration = Duration::from_secs(30);

/// When a peer last sent a byte.
#[derive(Debug)]
pub(super) struct PortActivity {
    began: Instant,
    /// Microseconds from the beginning to the last received byte, at least 1; 0 before the first.
    last_us: AtomicU64,
}

impl PortActivity {
    pub(super) fn new() -> Self {
        Self { began: Instant::now(), last_us: AtomicU64::new(0) }
    }

    pub(super) fn began(&self) -> Instant {
        self.began
    }

    pub(super) fn has_spoken(&self) -> bool {
        self.last_us.load(Ordering::Relaxed) > 0
    }

    /// Time since the last received byte, or since the beginning.
    pub(super) fn silence(&self) -> Duration {
        let last = Duration::from_micros(self.last_us.load(Ordering::Relaxed));
        self.began.elapsed().saturating_sub(last)
    }

    fn note(&self) {
        let us = u64::try_from(self.began.elapsed().as_micros()).unwrap_or(u64::MAX);
        self.last_us.store(us.max(1), Ordering::Relaxed);
    }
}

/// Carries bytes both ways until the stream ends or fails, or is silent for `quiet`, or until the host is gone (`Ok`).
pub(super) async fn carry(
    stream: impl AsyncRead + AsyncWrite + Unpin,
    quiet: Option<Duration>,
    activity: &PortActivity,
    ends: &mut PortEnds,
) -> io::Result<()> {
    if !ends.report_open().await {
        return Ok(());
    }
    let (mut reader, mut writer) = tokio::io::split(stream);
    let mut buffer = [0; 4096];
    let mut out = bytes::Bytes::new();
    let (mut last_read, mut written) = (Instant::now(), Instant::now());
    loop {
        // A slow write must not delay input from the device. No write waits for the line to drain, which would block
        // the thread.
        tokio::select! {
            n = writer.write(&out), if !out.is_empty() => {
                let n = n?;
                if n == 0 {
                    return Err(io::ErrorKind::WriteZero.into());
                }
                let _ = out.split_to(n);
                written = Instant::now();
            }
            () = tokio::time::sleep_until(written + WRITE_TIMEOUT), if !out.is_empty() => {
                return Err(io::Error::new(io::ErrorKind::TimedOut, "it accepts no bytes"));
            }
            order = ends.to.recv(), if out.is_empty() => match order {
                Some(ToPort::Bytes(bytes)) => (out, written) = (bytes, Instant::now()),
                Some(ToPort::Reopen) => return Err(reopening()),
                // A stream has one peer.
                Some(ToPort::Judged(..)) => {}
                None => return Ok(()),
            },
            n = reader.read(&mut buffer) => {
                let n = n?;
                if n == 0 {
                    return Err(io::ErrorKind::UnexpectedEof.into());
                }
                last_read = Instant::now();
                activity.note();
                if !ends.report(read(&buffer, n)).await {
                    return Ok(());
                }
            }
            e = silence(last_read, quiet) => return Err(e),
        }
    }
}

/// Returns an error after `quiet` without a received byte; without `quiet` it never returns.
pub(super) async fn silence(last_read: Instant, quiet: Option<Duration>) -> io::Error {
    until(quiet.map(|quiet| last_read + quiet)).await;
    io::Error::new(io::ErrorKind::TimedOut, "no bytes arrived for too long")
}

/// Returns at a moment; without one it never returns.
pub(super) async fn until(due: Option<Instant>) {
    match due {
        Some(due) => tokio::time::sleep_until(due).await,
        None => std::future::pending().await,
    }
}

/// The error that makes the keeper open the port again, on the host's request.
pub(super) fn reopening() -> io::Error {
    io::Error::other("it does not answer")
}

/// Appends the bytes that the host writes to a file.
pub(super) async fn append(mut file: std::fs::File, ends: &mut PortEnds) -> io::Result<()> {
    if !ends.report_open().await {
        return Ok(());
    }
    while let Some(order) = ends.to.recv().await {
        match order {
            ToPort::Bytes(bytes) => file.write_all(&bytes)?,
            ToPort::Reopen => return Err(reopening()),
            ToPort::Judged(..) => {}
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::{FromPort, Port};
    use super::*;

    const SECOND: Duration = Duration::from_secs(1);

    /// A carried stream that holds 16 unread bytes: its far side, the port and the task.
    fn carried(quiet: Option<Duration>) -> (tokio::io::DuplexStream, Port, tokio::task::JoinHandle<io::Result<()>>) {
        let (near, far) = tokio::io::duplex(16);
        let (port, mut ends) = Port::pair();
        let task = tokio::spawn(async move { carry(near, quiet, &PortActivity::new(), &mut ends).await });
        (far, port, task)
    }

    #[tokio::test(start_paused = true)]
    async fn a_device_that_accepts_no_bytes_is_read_until_its_timeout() {
        let (mut far, mut port, task) = carried(None);
        assert_eq!(port.next().await, FromPort::Open);
        assert!(port.write(vec![7; 100]));
        let began = Instant::now();
        for i in 0..29 {
            far.write_all(&[i]).await.unwrap();
            assert_eq!(port.next().await, FromPort::Bytes(vec![i].into()));
            tokio::time::sleep(SECOND).await;
        }
        assert!(!task.is_finished());
        assert_eq!(task.await.unwrap().unwrap_err().kind(), io::ErrorKind::TimedOut);
        assert_eq!(began.elapsed().as_secs(), WRITE_TIMEOUT.as_secs());
    }

    #[tokio::test(start_paused = true)]
    async fn a_slow_device_receives_all_bytes() {
        let (mut far, mut port, task) = carried(None);
        assert_eq!(port.next().await, FromPort::Open);
        assert!(port.write((0..100).collect()));
        let mut received = Vec::new();
        while received.len() < 100 {
            tokio::time::sleep(20 * SECOND).await;
            let mut buffer = [0; 8];
            let n = far.read(&mut buffer).await.unwrap();
            received.extend_from_slice(&buffer[..n]);
        }
        assert_eq!(received, (0..100).collect::<Vec<u8>>());
        drop(port);
        assert!(task.await.unwrap().is_ok(), "the host is gone");
    }

    #[tokio::test(start_paused = true)]
    async fn a_silent_instrument_counts_as_gone_despite_writes_to_it() {
        let (mut far, mut port, task) = carried(Some(10 * SECOND));
        assert_eq!(port.next().await, FromPort::Open);
        far.write_all(b"$").await.unwrap();
        let began = Instant::now();
        while !task.is_finished() {
            port.write(vec![1]);
            let _ = far.read(&mut [0; 8]).await;
            tokio::time::sleep(SECOND).await;
        }
        assert_eq!(task.await.unwrap().unwrap_err().kind(), io::ErrorKind::TimedOut);
        assert!((10..=12).contains(&began.elapsed().as_secs()));
    }
}
