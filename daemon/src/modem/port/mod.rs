//! Ways to a modem: serial, TCP, UDP. They move bytes, and open themselves again whenever they fail.

mod carry;
mod serial;
mod tcp;
mod udp;

use crate::problem::Problem;
use bytes::Bytes;
use std::time::Duration;
use tokio::sync::mpsc;

/// What a port is told.
#[derive(Debug)]
pub enum ToPort {
    /// Write this.
    Bytes(Bytes),
    /// Close and open again: nobody answers.
    Reopen,
}

/// What a port tells.
#[derive(Debug)]
pub enum FromPort {
    /// It is open.
    Open,
    /// It is closed, and being opened again.
    Closed,
    /// This was read.
    Bytes(Bytes),
}

/// Where the modem is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Place {
    /// A serial device and its speed, bit/s.
    Serial(String, u32),
    /// An address to listen on.
    Listen(String),
    /// An address to connect to.
    Connect(String),
    /// Datagrams: an address to receive at, and one to send to; without the first any port, without the second to whoever
    /// was heard last.
    Datagrams(String, String),
}

/// A port and the way to it.
#[derive(Debug)]
pub struct Port {
    /// To the modem.
    pub to: mpsc::Sender<ToPort>,
    /// From the modem.
    pub from: mpsc::Receiver<FromPort>,
}

/// The far side of a [`Port`].
struct Ends {
    to: mpsc::Receiver<ToPort>,
    from: mpsc::Sender<FromPort>,
}

/// The first pause before opening again.
const FIRST_PAUSE: Duration = Duration::from_millis(200);

/// The pause after `pause`: doubles up to two seconds, so that a cable that is back is soon noticed.
fn back_off(pause: Duration) -> Duration {
    (pause * 2).min(Duration::from_secs(2))
}

/// Opens a port; one that fails later is opened again by itself.
pub async fn open(place: Place) -> Result<Port, Problem> {
    let (to, to_port) = mpsc::channel(64);
    let (from_port, from) = mpsc::channel(64);
    let ends = Ends { to: to_port, from: from_port };
    match place {
        Place::Serial(device, baud) => serial::open(device, baud, ends)?,
        Place::Listen(address) => tcp::listen(&address, ends).await?,
        Place::Connect(address) => tcp::connect(address, ends),
        Place::Datagrams(local, remote) => udp::open(&local, &remote, ends).await?,
    }
    Ok(Port { to, from })
}
