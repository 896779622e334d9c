//! Ports to instruments: serial devices, TCP, UDP and files, opened again whenever they fail.

use crate::config::Place;
use bytes::Bytes;
use std::io;
use std::net::SocketAddr;
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};
use tokio::net::{TcpStream, UdpSocket};
use tokio::sync::mpsc;
use tokio_serial::SerialPortBuilderExt;

/// What a port tells.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum FromPort {
    /// It is open.
    Open,
    /// Bytes came.
    Bytes(Bytes),
    /// It has failed and is opened again.
    Closed,
}

/// A port to an instrument.
#[derive(Debug)]
pub(super) struct Port {
    from: mpsc::Receiver<FromPort>,
    to: mpsc::Sender<Bytes>,
}

impl Port {
    /// Opens it, and opens it again for ever; `name` is for the log. An instrument that says nothing for `quiet` counts as
    /// gone, where that is given: an unplugged adapter or a half-open connection may never tell.
    pub(super) fn open(name: &'static str, place: Place, quiet: Option<Duration>) -> Self {
        let (to, outgoing) = mpsc::channel(64);
        let (incoming, from) = mpsc::channel(64);
        tokio::spawn(Keeper { name, place, quiet, outgoing, incoming }.run());
        Self { from, to }
    }

    /// The next thing that it tells; safe to abandon.
    pub(super) async fn next(&mut self) -> FromPort {
        match self.from.recv().await {
            Some(told) => told,
            None => std::future::pending().await,
        }
    }

    /// Writes bytes; what a port does not take is dropped, for it is stale by the time that it would.
    pub(super) fn write(&self, bytes: Vec<u8>) {
        let _ = self.to.try_send(bytes.into());
    }
}

struct Keeper {
    name: &'static str,
    place: Place,
    quiet: Option<Duration>,
    outgoing: mpsc::Receiver<Bytes>,
    incoming: mpsc::Sender<FromPort>,
}

const FIRST_PAUSE: Duration = Duration::from_millis(200);
const LONGEST_PAUSE: Duration = Duration::from_secs(5);
const WRITE_LIMIT: Duration = Duration::from_secs(10);

impl Keeper {
    async fn run(mut self) {
        let mut pause = FIRST_PAUSE;
        let mut said = false;
        while !self.incoming.is_closed() {
            let began = tokio::time::Instant::now();
            let ended = self.serve().await;
            let lasted = began.elapsed() > LONGEST_PAUSE;
            if lasted {
                (pause, said) = (FIRST_PAUSE, false);
            }
            match ended {
                Ok(()) => return,
                Err(e) if !said => {
                    tracing::warn!("{}: {:?}: {e}; it is opened again when it is there", self.name, self.place);
                }
                Err(e) => tracing::debug!("{}: {e}", self.name),
            }
            said = true;
            let _ = self.incoming.send(FromPort::Closed).await;
            tokio::time::sleep(pause).await;
            pause = (pause * 2).min(LONGEST_PAUSE);
        }
    }

    /// Opens once and carries bytes until that fails, or the host is gone (`Ok`).
    async fn serve(&mut self) -> io::Result<()> {
        match self.place.clone() {
            Place::Serial(device, baud) => {
                let stream = tokio_serial::new(device, baud).open_native_async();
                self.carry(stream.map_err(io::Error::from)?).await
            }
            Place::Tcp(address) | Place::Gpsd(address) => {
                let connect = TcpStream::connect(&address);
                let stream = tokio::time::timeout(WRITE_LIMIT, connect).await.map_err(|_| timed_out())??;
                let _ = stream.set_nodelay(true);
                self.carry(stream).await
            }
            Place::Udp(address) => self.carry_packets(UdpSocket::bind(&address).await?, None).await,
            Place::UdpTo(address) => {
                let peer = tokio::net::lookup_host(&address).await?.next().ok_or(io::ErrorKind::NotFound)?;
                let own: SocketAddr = if peer.is_ipv4() { ([0, 0, 0, 0], 0).into() } else { ([0u16; 8], 0).into() };
                self.carry_packets(UdpSocket::bind(own).await?, Some(peer)).await
            }
            Place::File(path) => self.append(&path).await,
        }
    }

    async fn open(&mut self) {
        while self.outgoing.try_recv().is_ok() {}
        tracing::info!("{}: open", self.name);
        let _ = self.incoming.send(FromPort::Open).await;
    }

    /// Ends when nothing has come for too long.
    async fn silence(quiet: Option<Duration>) -> io::Error {
        match quiet {
            Some(quiet) => tokio::time::sleep(quiet).await,
            None => std::future::pending().await,
        }
        io::Error::new(io::ErrorKind::TimedOut, "nothing came for long")
    }

    async fn carry(&mut self, stream: impl AsyncRead + AsyncWrite) -> io::Result<()> {
        self.open().await;
        let (mut reader, mut writer) = tokio::io::split(Box::pin(stream));
        let mut buffer = [0; 4096];
        loop {
            let quiet = self.quiet;
            tokio::select! {
                bytes = self.outgoing.recv() => {
                    let Some(bytes) = bytes else { return Ok(()) };
                    tokio::time::timeout(WRITE_LIMIT, writer.write_all(&bytes)).await.map_err(|_| timed_out())??;
                }
                n = reader.read(&mut buffer) => {
                    let n = n?;
                    if n == 0 {
                        return Err(io::ErrorKind::UnexpectedEof.into());
                    }
                    let bytes = Bytes::copy_from_slice(buffer.get(..n).unwrap_or_default());
                    if self.incoming.send(FromPort::Bytes(bytes)).await.is_err() {
                        return Ok(());
                    }
                }
                e = Self::silence(quiet) => return Err(e),
            }
        }
    }

    async fn carry_packets(&mut self, socket: UdpSocket, mut peer: Option<SocketAddr>) -> io::Result<()> {
        self.open().await;
        let mut buffer = [0; 2048];
        loop {
            tokio::select! {
                bytes = self.outgoing.recv() => {
                    let Some(bytes) = bytes else { return Ok(()) };
                    if let Some(peer) = peer {
                        // A peer that is not there yet refuses; it may come.
                        let _ = socket.send_to(&bytes, peer).await;
                    }
                }
                heard = socket.recv_from(&mut buffer) => match heard {
                    Ok((n, from)) => {
                        peer = Some(from);
                        let bytes = Bytes::copy_from_slice(buffer.get(..n).unwrap_or_default());
                        if self.incoming.send(FromPort::Bytes(bytes)).await.is_err() {
                            return Ok(());
                        }
                    }
                    Err(e) if e.kind() == io::ErrorKind::ConnectionRefused => {}
                    Err(e) => return Err(e),
                },
            }
        }
    }

    async fn append(&mut self, path: &std::path::Path) -> io::Result<()> {
        use std::io::Write;
        let mut file = std::fs::OpenOptions::new().create(true).append(true).open(path)?;
        self.open().await;
        while let Some(bytes) = self.outgoing.recv().await {
            file.write_all(&bytes)?;
        }
        Ok(())
    }
}

fn timed_out() -> io::Error {
    io::ErrorKind::TimedOut.into()
}
