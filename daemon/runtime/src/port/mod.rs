//! Ways to modems and instruments: serial, TCP, UDP, files. They move bytes, and open themselves again whenever they fail.

mod carry;
mod keeper;
mod tcp;
mod udp;

use bytes::Bytes;
use keeper::Keeper;
use scenecast_core::PortAddress;
use std::io;
use std::time::Duration;
use tokio::sync::mpsc;

/// A request to a port.
#[derive(Debug)]
enum ToPort {
    Bytes(Bytes),
    /// Close and open again: nobody answers.
    Reopen,
}

/// A report of a port.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum FromPort {
    Open,
    /// It is closed, and being opened again.
    Closed,
    Bytes(Bytes),
}

/// A port and the way to it.
#[derive(Debug)]
pub struct Port {
    to: mpsc::Sender<ToPort>,
    from: mpsc::Receiver<FromPort>,
}

/// The far side of a [`Port`].
struct PortEnds {
    to: mpsc::Receiver<ToPort>,
    from: mpsc::Sender<FromPort>,
}

impl Port {
    /// Opens it now; one that fails later is opened again by itself. `name` is for the log.
    ///
    /// # Errors
    /// Why it cannot be opened. A peer that does not take a connection yet is waited for instead.
    pub async fn open(name: &'static str, place: PortAddress) -> io::Result<Self> {
        let first = match &place {
            PortAddress::Connect(_) => None,
            there => Some(keeper::open(there).await?),
        };
        let (port, ends) = Self::pair();
        tokio::spawn(Keeper { name, place, quiet: None, ends }.run(first));
        Ok(port)
    }

    /// Opens it as soon as it is there, and again for ever. Where `quiet` is given, an instrument
    /// that is silent for so long counts as gone: an unplugged adapter or a half-open connection may never report an error.
    pub fn open_when_there(name: &'static str, place: PortAddress, quiet: Option<Duration>) -> Self {
        let (port, ends) = Self::pair();
        tokio::spawn(Keeper { name, place, quiet, ends }.run(None));
        port
    }

    fn pair() -> (Self, PortEnds) {
        let (to, to_port) = mpsc::channel(64);
        let (from_port, from) = mpsc::channel(64);
        (Self { to, from }, PortEnds { to: to_port, from: from_port })
    }

    /// The next report of the port. Safe to abandon.
    pub async fn next(&mut self) -> FromPort {
        match self.from.recv().await {
            Some(told) => told,
            None => std::future::pending().await,
        }
    }

    /// The next report of an optional port; without one, it waits for ever. Safe to abandon.
    pub async fn next_of(port: &mut Option<Self>) -> FromPort {
        match port {
            Some(port) => port.next().await,
            None => std::future::pending().await,
        }
    }

    /// Writes bytes and returns whether the port took them. Refused bytes need not be written again: they would be stale.
    pub fn write(&self, bytes: Vec<u8>) -> bool {
        self.to.try_send(ToPort::Bytes(bytes.into())).is_ok()
    }

    /// Closes it and opens it again.
    pub fn reopen(&self) {
        let _ = self.to.try_send(ToPort::Reopen);
    }
}

impl PortEnds {
    /// The port has been opened: bytes that waited for it are stale. Returns whether the host is still there.
    async fn tell_open(&mut self) -> bool {
        while self.to.try_recv().is_ok() {}
        self.from.send(FromPort::Open).await.is_ok()
    }

    /// Returns whether the host is still there.
    async fn tell(&self, told: FromPort) -> bool {
        self.from.send(told).await.is_ok()
    }
}

/// Bytes of a buffer that were just read.
fn read(buffer: &[u8], n: usize) -> FromPort {
    FromPort::Bytes(Bytes::copy_from_slice(buffer.get(..n).unwrap_or_default()))
}
