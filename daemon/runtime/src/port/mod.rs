//! Ports to modems and instruments: serial, TCP, UDP, files. They move bytes, and are opened again after each failure.

mod carry;
mod keeper;
mod tcp;
mod udp;

use bytes::Bytes;
use keeper::PortKeeper;
pub(crate) use keeper::{Opened, open};
use scenecast_core::PortAddress;
use scenecast_host::FrameOutcome;
use std::io;
use std::net::SocketAddr;
use std::path::Path;
use std::time::Duration;
use tokio::sync::mpsc;
use tokio::task::JoinHandle;
use udp::PeerRule;

/// A request to a port.
#[derive(Debug)]
enum ToPort {
    Bytes(Bytes),
    /// Close and open again, for the device does not answer.
    Reopen,
    /// The host's judgement of a datagram of this sender.
    Judged(SocketAddr, FrameOutcome),
}

/// A report of a port.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum FromPort {
    Open,
    /// The port is closed and will be opened again.
    Closed,
    Bytes(Bytes),
    /// A whole datagram and its sender.
    Datagram(Bytes, SocketAddr),
}

/// The host's side of a port.
#[derive(Debug)]
pub struct Port {
    to: mpsc::Sender<ToPort>,
    from: mpsc::Receiver<FromPort>,
    /// The keeper, which ends with the port.
    task: Option<JoinHandle<()>>,
}

/// The task's side of a [`Port`].
struct PortEnds {
    to: mpsc::Receiver<ToPort>,
    from: mpsc::Sender<FromPort>,
}

impl Port {
    /// Opens the port now. If it fails later, it is opened again. `name` appears in the log. The owner gives
    /// [`Self::judge`] the result of each datagram.
    ///
    /// # Errors
    /// The port cannot be opened. A TCP peer that refuses the connection, and an adapter that is not plugged in, are no errors: they
    /// are tried again.
    pub async fn open_judged(name: &'static str, place: PortAddress) -> io::Result<Self> {
        let first = match &place {
            PortAddress::Connect(_) => None,
            there => match keeper::open(there).await {
                // A device that another program has open is reported as missing, too.
                Err(_) if matches!(there, PortAddress::Serial(device, _) if !Path::new(device).exists()) => None,
                opened => Some(opened?),
            },
        };
        let (mut port, ends) = Self::pair();
        let keeper = PortKeeper { name, place, quiet: None, rule: PeerRule::Judged, knocks: true, ends };
        port.task = Some(tokio::spawn(keeper.run(first)));
        Ok(port)
    }

    /// Opens the port as soon as it exists, and again after each failure. If `quiet` is given, a port that is silent
    /// for this time is opened again: an unplugged adapter or a half-open connection may never report an error. Of
    /// datagrams, those of the first sender are taken until it is silent.
    pub fn open_when_there(name: &'static str, place: PortAddress, quiet: Option<Duration>) -> Self {
        Self::kept(name, place, quiet, PeerRule::First)
    }

    /// The same for a port whose owner gives [`Self::judge`] the result of each datagram.
    pub fn open_judged_when_there(name: &'static str, place: PortAddress) -> Self {
        Self::kept(name, place, None, PeerRule::Judged)
    }

    fn kept(name: &'static str, place: PortAddress, quiet: Option<Duration>, rule: PeerRule) -> Self {
        let (mut port, ends) = Self::pair();
        port.task = Some(tokio::spawn(PortKeeper { name, place, quiet, rule, knocks: false, ends }.run(None)));
        port
    }

    fn pair() -> (Self, PortEnds) {
        let (to, to_port) = mpsc::channel(64);
        let (from_port, from) = mpsc::channel(64);
        (Self { to, from, task: None }, PortEnds { to: to_port, from: from_port })
    }

    /// Closes the port, and returns once its device is free for others.
    pub async fn close(self) {
        let Self { to, from, task } = self;
        drop((to, from));
        if let Some(task) = task {
            let _ = task.await;
        }
    }

    /// The next report of the port. Cancel-safe.
    pub async fn next(&mut self) -> FromPort {
        match self.from.recv().await {
            Some(report) => report,
            None => std::future::pending().await,
        }
    }

    /// The next report of an optional port; `None` never returns. Cancel-safe.
    pub async fn next_of(port: &mut Option<Self>) -> FromPort {
        match port {
            Some(port) => port.next().await,
            None => std::future::pending().await,
        }
    }

    /// Writes bytes and returns whether the port accepted them. Do not repeat refused bytes: they would be stale.
    pub fn write(&self, bytes: Vec<u8>) -> bool {
        self.to.try_send(ToPort::Bytes(bytes.into())).is_ok()
    }

    /// Reports the judgement of a datagram of this sender, before the reply to it is written.
    pub fn judge(&self, sender: SocketAddr, outcome: FrameOutcome) {
        if outcome > FrameOutcome::Dropped {
            // Without room, the judgement of the next datagram takes its place.
            let _ = self.to.try_send(ToPort::Judged(sender, outcome));
        }
    }

    /// Closes the port and opens it again.
    pub fn reopen(&self) {
        let _ = self.to.try_send(ToPort::Reopen);
    }
}

impl PortEnds {
    /// Reports an opened port and drops the stale bytes that waited for it. Returns whether the host is still there.
    async fn report_open(&mut self) -> bool {
        while self.to.try_recv().is_ok() {}
        self.from.send(FromPort::Open).await.is_ok()
    }

    /// Sends a report; returns whether the host is still there.
    async fn report(&self, report: FromPort) -> bool {
        self.from.send(report).await.is_ok()
    }
}

/// A report of the first `n` bytes of a buffer.
fn read(buffer: &[u8], n: usize) -> FromPort {
    FromPort::Bytes(Bytes::copy_from_slice(buffer.get(..n).unwrap_or_default()))
}
