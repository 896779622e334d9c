//! Opens a port, again whenever it fails, and moves bytes between its stream and the host.

use super::carry::{PortActivity, append, carry};
use super::udp::{self, PeerRule, UdpPeer};
use super::{FromPort, PortEnds, tcp};
use scenecast_core::{FlowControl, PortAddress, SerialFormat, SerialLine};
use std::fs::File;
use std::io;
use std::time::Duration;
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
        PortAddress::Serial(device, line) => Opened::Serial(serial(device, line)?),
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

fn serial(device: &str, line: &SerialLine) -> io::Result<SerialStream> {
    use tokio_serial::{DataBits, FlowControl as Flow, Parity, StopBits};
    let (data_bits, parity, stop_bits) = match line.format {
        SerialFormat::EightNoneOne => (DataBits::Eight, Parity::None, StopBits::One),
        SerialFormat::EightNoneTwo => (DataBits::Eight, Parity::None, StopBits::Two),
        SerialFormat::EightEvenOne => (DataBits::Eight, Parity::Even, StopBits::One),
        SerialFormat::EightOddOne => (DataBits::Eight, Parity::Odd, StopBits::One),
        SerialFormat::SevenEvenOne => (DataBits::Seven, Parity::Even, StopBits::One),
        SerialFormat::SevenOddOne => (DataBits::Seven, Parity::Odd, StopBits::One),
    };
    let flow = match line.flow {
        FlowControl::None => Flow::None,
        FlowControl::Hardware => Flow::Hardware,
        FlowControl::Software => Flow::Software,
    };
    let port = tokio_serial::new(device, line.baud).data_bits(data_bits).parity(parity).stop_bits(stop_bits);
    let mut stream = port.flow_control(flow).open_native_async()?;
    // Two ends may share a pseudo-terminal in a rehearsal; a system without exclusive access needs none.
    let _ = stream.set_exclusive(false);
    // A pseudo-terminal has no such lines.
    let _ = stream.write_data_terminal_ready(line.dtr);
    if line.flow != FlowControl::Hardware {
        let _ = stream.write_request_to_send(line.rts);
    }
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

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use tokio_serial::StopBits;

    #[tokio::test]
    async fn a_serial_device_is_set_as_its_line_says() {
        // A pseudo-terminal takes stop bits and flow control; it has eight bits without parity whatever is asked.
        let (_other, device) = SerialStream::pair().unwrap();
        let name = device.name().unwrap();
        let line = |format, flow| SerialLine { format, flow, ..SerialLine::of_speed(9600) };
        for (format, flow, stop_bits, expected) in [
            (SerialFormat::EightNoneTwo, FlowControl::Software, StopBits::Two, tokio_serial::FlowControl::Software),
            (SerialFormat::EightNoneOne, FlowControl::Hardware, StopBits::One, tokio_serial::FlowControl::Hardware),
        ] {
            let Opened::Serial(stream) = open(&PortAddress::Serial(name.clone(), line(format, flow))).await.unwrap()
            else {
                panic!("a serial device")
            };
            assert_eq!((stream.stop_bits().unwrap(), stream.flow_control().unwrap()), (stop_bits, expected));
        }
    }
}
