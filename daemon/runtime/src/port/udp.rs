//! Datagrams with one frame each, for benches, radio links and autopilots.

use super::carry::{reopening, silence};
use super::{PortEnds, ToPort, read};
use std::io;
use std::net::SocketAddr;
use std::time::Duration;
use tokio::net::UdpSocket;
use tokio::time::Instant;

/// Maximum length of a datagram, bytes.
const MAX_DATAGRAM_BYTES: usize = 2048;
/// A sender that is silent for this time gives way to another one.
const SILENCE_TIMEOUT: Duration = Duration::from_secs(10);
/// Pause after an error of the system.
const RETRY_INTERVAL: Duration = Duration::from_millis(200);

/// A socket at `own`, or anywhere if that is empty, and the address of `remote`, if it is not.
pub(super) async fn open(own: &str, remote: &str) -> io::Result<(UdpSocket, Option<SocketAddr>)> {
    let remote = match remote {
        "" => None,
        text => {
            let none = || io::Error::new(io::ErrorKind::NotFound, format!("{text} is no address"));
            let wrong = |e: io::Error| io::Error::new(e.kind(), format!("{text}: {e}"));
            Some(tokio::net::lookup_host(text).await.map_err(wrong)?.next().ok_or_else(none)?)
        }
    };
    let any = if remote.is_some_and(|r| r.is_ipv6()) { "[::]:0" } else { "0.0.0.0:0" };
    let own = if own.is_empty() { any } else { own };
    let wrong = |e: io::Error| io::Error::new(e.kind(), format!("cannot receive at {own}: {e}"));
    Ok((UdpSocket::bind(own).await.map_err(wrong)?, remote))
}

/// The other side of a socket: datagrams go to it, and those of others are dropped.
#[derive(Debug)]
struct UdpPeer {
    /// Whether the address is configured. Then datagrams come from any port of it.
    is_fixed: bool,
    address: Option<SocketAddr>,
    last_read: Instant,
}

impl UdpPeer {
    fn new(fixed: Option<SocketAddr>, now: Instant) -> Self {
        Self { is_fixed: fixed.is_some(), address: fixed, last_read: now }
    }

    /// Whether a datagram is taken. Without a configured address, the first sender is the peer until it is silent.
    fn takes(&mut self, from: SocketAddr, now: Instant) -> bool {
        let is_taken = match self.address {
            Some(address) if self.is_fixed => address.ip().to_canonical() == from.ip().to_canonical(),
            Some(address) => address == from || now >= self.last_read + SILENCE_TIMEOUT,
            None => true,
        };
        if is_taken {
            self.last_read = now;
            if !self.is_fixed {
                self.address = Some(from);
            }
        }
        is_taken
    }
}

/// Carries datagrams to `fixed`, or else to the sender that is listened to. A socket has no
/// connection, so it is always open.
pub(super) async fn carry(
    socket: UdpSocket,
    fixed: Option<SocketAddr>,
    quiet: Option<Duration>,
    ends: &mut PortEnds,
) -> io::Result<()> {
    if !ends.report_open().await {
        return Ok(());
    }
    let mut peer = UdpPeer::new(fixed, Instant::now());
    let mut buffer = [0; MAX_DATAGRAM_BYTES];
    loop {
        tokio::select! {
            order = ends.to.recv() => match (order, peer.address) {
                (None, _) => return Ok(()),
                (Some(ToPort::Reopen), _) => return Err(reopening()),
                (Some(ToPort::Bytes(bytes)), Some(peer)) => {
                    // A peer that is not running yet refuses datagrams; it may start later.
                    if let Err(e) = socket.send_to(&bytes, peer).await {
                        tracing::debug!("{peer}: {e}");
                    }
                }
                (Some(ToPort::Bytes(_)), None) => {}
            },
            received = socket.recv_from(&mut buffer) => match received {
                Ok((n, from)) => {
                    if peer.takes(from, Instant::now()) && !ends.report(read(&buffer, n)).await {
                        return Ok(());
                    }
                }
                // The refusal of a peer that is not running yet is returned as an error of this call.
                Err(_) => tokio::time::sleep(RETRY_INTERVAL).await,
            },
            e = silence(peer.last_read, quiet) => return Err(e),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{FromPort, Port};
    use super::*;

    async fn socket() -> (UdpSocket, SocketAddr) {
        let socket = UdpSocket::bind("127.0.0.1:0").await.unwrap();
        let address = socket.local_addr().unwrap();
        (socket, address)
    }

    async fn carried(fixed: Option<SocketAddr>) -> (Port, SocketAddr) {
        let (own, address) = socket().await;
        let (mut port, mut ends) = Port::pair();
        tokio::spawn(async move { carry(own, fixed, None, &mut ends).await });
        assert_eq!(port.next().await, FromPort::Open);
        (port, address)
    }

    #[tokio::test]
    async fn the_first_sender_is_the_only_one_until_it_is_silent() {
        let (mut port, to) = carried(None).await;
        let ((first, _), (second, _)) = (socket().await, socket().await);
        first.send_to(&[1], to).await.unwrap();
        assert_eq!(port.next().await, FromPort::Bytes(vec![1].into()));
        second.send_to(&[2], to).await.unwrap();
        first.send_to(&[3], to).await.unwrap();
        assert_eq!(port.next().await, FromPort::Bytes(vec![3].into()), "the datagram of the other was dropped");
        assert!(port.write(vec![4]));
        let mut buffer = [0; 8];
        assert_eq!(first.recv(&mut buffer).await.unwrap(), 1);
        tokio::time::pause();
        tokio::time::advance(SILENCE_TIMEOUT).await;
        second.send_to(&[5], to).await.unwrap();
        assert_eq!(port.next().await, FromPort::Bytes(vec![5].into()));
        first.send_to(&[6], to).await.unwrap();
        second.send_to(&[7], to).await.unwrap();
        assert_eq!(port.next().await, FromPort::Bytes(vec![7].into()));
    }

    #[test]
    fn a_configured_address_is_listened_to_at_any_of_its_ports() {
        let now = Instant::now();
        let address = |text: &str| text.parse::<SocketAddr>().unwrap();
        let mut peer = UdpPeer::new(Some(address("192.0.2.1:4001")), now);
        assert!(peer.takes(address("192.0.2.1:9"), now));
        assert!(!peer.takes(address("192.0.2.2:4001"), now + 9 * SILENCE_TIMEOUT));
        assert_eq!(peer.address, Some(address("192.0.2.1:4001")), "datagrams go to the configured port");
    }
}
