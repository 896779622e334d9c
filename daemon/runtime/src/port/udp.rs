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

/// Carries datagrams to `fixed`, or else to the sender of the last one. A socket has no connection,
/// so it is always open.
pub(super) async fn carry(
    socket: UdpSocket,
    fixed: Option<SocketAddr>,
    quiet: Option<Duration>,
    ends: &mut PortEnds,
) -> io::Result<()> {
    if !ends.report_open().await {
        return Ok(());
    }
    let mut peer = fixed;
    let mut buffer = [0; MAX_DATAGRAM_BYTES];
    let mut last_read = Instant::now();
    loop {
        tokio::select! {
            order = ends.to.recv() => match (order, peer) {
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
                    (peer, last_read) = (fixed.or(Some(from)), Instant::now());
                    if !ends.report(read(&buffer, n)).await {
                        return Ok(());
                    }
                }
                // The refusal of a peer that is not running yet is returned as an error of this call.
                Err(_) => tokio::time::sleep(RETRY_INTERVAL).await,
            },
            e = silence(last_read, quiet) => return Err(e),
        }
    }
}
