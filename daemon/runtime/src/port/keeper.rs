//! Opens a port, and opens it again whenever it fails.

use super::carry::{append, carry};
use super::{FromPort, PortEnds, tcp, udp};
use scenecast_core::PortAddress;
use std::fs::File;
use std::io;
use std::time::Duration;
use tokio::net::{TcpListener, TcpStream, UdpSocket};
use tokio::time::Instant;
use tokio_serial::{SerialPort, SerialPortBuilderExt, SerialStream};

/// The first pause before opening again.
const FIRST_PAUSE: Duration = Duration::from_millis(200);
/// The longest one, so that a cable that is back is soon noticed.
const MAX_PAUSE: Duration = Duration::from_secs(2);
/// Longest wait for a connection: an address that nobody answers at must not take minutes.
const CONNECT_LIMIT: Duration = Duration::from_secs(5);

/// A port that is open.
pub(super) enum Opened {
    Serial(SerialStream),
    Connection(TcpStream),
    Listener(TcpListener),
    Socket(UdpSocket, Option<std::net::SocketAddr>),
    File(File),
}

pub(super) async fn open(place: &PortAddress) -> io::Result<Opened> {
    Ok(match place {
        PortAddress::Serial(device, baud) => Opened::Serial(serial(device, *baud)?),
        PortAddress::Listen(address) => Opened::Listener(TcpListener::bind(address).await?),
        PortAddress::Connect(address) => {
            let connection = tokio::time::timeout(CONNECT_LIMIT, TcpStream::connect(address)).await;
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
    // Two ends may share a pseudo-terminal in a rehearsal; where exclusiveness is not to be had, it is not needed.
    let _ = stream.set_exclusive(false);
    // Some modems garble their output while RTS is up and flow control off; a pseudo-terminal has no such line.
    let _ = stream.write_request_to_send(false);
    Ok(stream)
}

/// Keeps a port open until its host is gone: an unplugged adapter comes back under its stable path.
pub(super) struct Keeper {
    pub(super) name: &'static str,
    pub(super) place: PortAddress,
    pub(super) quiet: Option<Duration>,
    pub(super) ends: PortEnds,
}

impl Keeper {
    /// Serves `first`, and then whatever can be opened.
    pub(super) async fn run(mut self, first: Option<Opened>) {
        let mut next = first;
        let mut pause = FIRST_PAUSE;
        let mut said = false;
        while !self.ends.from.is_closed() {
            let began = Instant::now();
            let opened = match next.take() {
                Some(opened) => Ok(opened),
                None => open(&self.place).await,
            };
            let ended = match opened {
                Ok(opened) => self.serve(opened).await,
                Err(e) => Err(e),
            };
            let Err(e) = ended else { return };
            if began.elapsed() > MAX_PAUSE {
                (pause, said) = (FIRST_PAUSE, false);
            }
            // A failure that lasts is logged once.
            match std::mem::replace(&mut said, true) {
                false => tracing::warn!("{}: {}: {e}; it is opened again when it is there", self.name, self.place),
                true => tracing::debug!("{}: {}: {e}", self.name, self.place),
            }
            tokio::time::sleep(pause).await;
            pause = (pause * 2).min(MAX_PAUSE);
        }
    }

    /// Carries bytes until that fails, or the host is gone (`Ok`).
    async fn serve(&mut self, opened: Opened) -> io::Result<()> {
        if !matches!(opened, Opened::Listener(_)) {
            tracing::info!("{}: open", self.name);
        }
        let result = match opened {
            Opened::Serial(stream) => carry(stream, self.quiet, &mut self.ends).await,
            Opened::Connection(stream) => {
                let _ = stream.set_nodelay(true);
                carry(stream, self.quiet, &mut self.ends).await
            }
            Opened::Listener(listener) => return tcp::accept(self.name, listener, self.quiet, &mut self.ends).await,
            Opened::Socket(socket, remote) => udp::carry(socket, remote, self.quiet, &mut self.ends).await,
            Opened::File(file) => append(file, &mut self.ends).await,
        };
        if result.is_err() && !self.ends.tell(FromPort::Closed).await {
            return Ok(());
        }
        result
    }
}
