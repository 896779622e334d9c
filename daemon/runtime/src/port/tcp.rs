//! TCP ports that wait for the other side to connect.

use super::carry::{PortActivity, carry};
use super::{FromPort, PortEnds};
use std::io;
use std::net::SocketAddr;
use std::time::Duration;
use tokio::net::{TcpListener, TcpStream};
use tokio::time::Instant;

/// Pause after the system refused to accept a connection.
const RETRY_INTERVAL: Duration = Duration::from_millis(200);
/// A peer that has sent no byte for this time gives way to another one. One that has never sent a byte is dropped.
const SILENCE_TIMEOUT: Duration = Duration::from_secs(10);
/// Minimum time between two log lines about connections.
const LOG_INTERVAL: Duration = Duration::from_secs(1);

/// The reason that a connection is no longer served.
enum Left {
    HostGone,
    Ended,
    /// The peer was silent; a newcomer takes its place, if there is one.
    Silent(Option<(TcpStream, SocketAddr)>),
}

/// Serves one peer at a time until the host is gone. Newcomers are refused while the peer is heard: whoever reaches the
/// port must not be able to take the modem's place.
pub(super) async fn accept(
    name: &'static str,
    listener: TcpListener,
    quiet: Option<Duration>,
    ends: &mut PortEnds,
) -> io::Result<()> {
    let mut door = Door { name, listener, log: LogLimit::default(), closed_until: Instant::now() };
    let mut next = None;
    loop {
        let (stream, peer) = match next.take() {
            Some(newcomer) => newcomer,
            None => tokio::select! {
                newcomer = door.next() => newcomer,
                () = ends.from.closed() => return Ok(()),
            },
        };
        door.log(&format!("{peer} connected"));
        let left = serve(stream, peer, quiet, ends, &mut door).await;
        match left {
            Left::HostGone => return Ok(()),
            Left::Ended => {}
            Left::Silent(newcomer) => next = newcomer,
        }
        if !ends.report(FromPort::Closed).await {
            return Ok(());
        }
    }
}

/// Carries bytes over one connection, and refuses others meanwhile.
async fn serve(
    stream: TcpStream,
    peer: SocketAddr,
    quiet: Option<Duration>,
    ends: &mut PortEnds,
    door: &mut Door,
) -> Left {
    let _ = stream.set_nodelay(true);
    let activity = PortActivity::new();
    let carried = carry(stream, quiet, &activity, ends);
    tokio::pin!(carried);
    loop {
        tokio::select! {
            result = &mut carried => return match result {
                Ok(()) => Left::HostGone,
                Err(e) => {
                    door.log(&format!("the connection of {peer} ended: {e}"));
                    Left::Ended
                }
            },
            newcomer = door.next() => {
                if activity.silence() >= SILENCE_TIMEOUT {
                    door.log(&format!("{peer} is silent and gives way to {}", newcomer.1));
                    return Left::Silent(Some(newcomer));
                }
                door.log(&format!("refused {}, because {peer} is connected", newcomer.1));
            }
            () = tokio::time::sleep_until(activity.began() + SILENCE_TIMEOUT), if !activity.has_spoken() => {
                // The peer may have spoken since the branch was enabled.
                if !activity.has_spoken() {
                    door.log(&format!("dropped {peer}, which has sent no byte"));
                    return Left::Silent(None);
                }
            }
        }
    }
}

/// The listener, with the log lines about connections.
struct Door {
    name: &'static str,
    listener: TcpListener,
    log: LogLimit,
    closed_until: Instant,
}

impl Door {
    async fn next(&mut self) -> (TcpStream, SocketAddr) {
        loop {
            tokio::time::sleep_until(self.closed_until).await;
            match self.listener.accept().await {
                Ok(accepted) => return accepted,
                Err(e) => {
                    self.log(&e.to_string());
                    self.closed_until = Instant::now() + RETRY_INTERVAL;
                }
            }
        }
    }

    fn log(&mut self, text: &str) {
        match self.log.admit(Instant::now()) {
            Some(0) => tracing::info!("{}: {text}", self.name),
            Some(left_out) => tracing::info!("{}: {text}; {left_out} other lines were left out", self.name),
            None => {}
        }
    }
}

/// Admits one log line in each interval.
#[derive(Debug, Default)]
struct LogLimit {
    last: Option<Instant>,
    left_out: u64,
}

impl LogLimit {
    /// The number of lines left out since the last one; `None` if this one is left out too.
    fn admit(&mut self, now: Instant) -> Option<u64> {
        if self.last.is_some_and(|last| now < last + LOG_INTERVAL) {
            self.left_out += 1;
            return None;
        }
        self.last = Some(now);
        Some(std::mem::take(&mut self.left_out))
    }
}

#[cfg(test)]
mod tests {
    use super::super::Port;
    use super::*;
    use tokio::io::{AsyncReadExt, AsyncWriteExt};

    async fn listening() -> (Port, SocketAddr) {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = listener.local_addr().unwrap();
        let (port, mut ends) = Port::pair();
        tokio::spawn(async move { accept("test", listener, None, &mut ends).await });
        (port, address)
    }

    /// A peer that has connected and sent a byte, which the port has reported.
    async fn heard(port: &mut Port, address: SocketAddr, byte: u8) -> TcpStream {
        let mut peer = TcpStream::connect(address).await.unwrap();
        assert_eq!(port.next().await, FromPort::Open);
        peer.write_all(&[byte]).await.unwrap();
        assert_eq!(port.next().await, FromPort::Bytes(vec![byte].into()));
        peer
    }

    async fn is_refused(mut peer: TcpStream) -> bool {
        matches!(peer.read(&mut [0; 8]).await, Ok(0) | Err(_))
    }

    #[tokio::test]
    async fn a_peer_that_is_heard_is_not_replaced_by_a_storm() {
        let (mut port, address) = listening().await;
        let mut first = heard(&mut port, address, 1).await;
        for _ in 0..200 {
            let mut stranger = TcpStream::connect(address).await.unwrap();
            let _ = stranger.write_all(b"junk").await;
            assert!(is_refused(stranger).await);
        }
        first.write_all(&[2]).await.unwrap();
        assert_eq!(port.next().await, FromPort::Bytes(vec![2].into()));
        assert!(port.write(vec![3]));
        assert_eq!(first.read_u8().await.unwrap(), 3);
        drop(first);
        assert_eq!(port.next().await, FromPort::Closed);
        heard(&mut port, address, 4).await;
    }

    #[tokio::test]
    async fn a_silent_peer_gives_way_after_ten_seconds() {
        let (mut port, address) = listening().await;
        let first = heard(&mut port, address, 1).await;
        tokio::time::pause();
        tokio::time::advance(SILENCE_TIMEOUT - LOG_INTERVAL).await;
        assert!(is_refused(TcpStream::connect(address).await.unwrap()).await);
        tokio::time::advance(LOG_INTERVAL).await;
        let mut second = TcpStream::connect(address).await.unwrap();
        assert_eq!(port.next().await, FromPort::Closed);
        assert_eq!(port.next().await, FromPort::Open);
        assert!(is_refused(first).await);
        second.write_all(&[2]).await.unwrap();
        assert_eq!(port.next().await, FromPort::Bytes(vec![2].into()));
    }

    #[tokio::test]
    async fn a_peer_that_never_speaks_is_dropped() {
        let (mut port, address) = listening().await;
        let silent = TcpStream::connect(address).await.unwrap();
        assert_eq!(port.next().await, FromPort::Open);
        tokio::time::pause();
        let began = Instant::now();
        assert_eq!(port.next().await, FromPort::Closed);
        assert_eq!(began.elapsed().as_secs(), SILENCE_TIMEOUT.as_secs());
        assert!(is_refused(silent).await);
    }

    #[test]
    fn a_storm_costs_one_line_a_second() {
        let (mut log, now) = (LogLimit::default(), Instant::now());
        let admitted: Vec<u64> = (0..3000).filter_map(|i| log.admit(now + Duration::from_millis(i))).collect();
        assert_eq!(admitted, [0, 999, 999]);
    }
}
