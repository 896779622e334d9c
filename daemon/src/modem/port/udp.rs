//! Datagrams, one a frame: for benches and radio links. Nobody connects, so it is always open.

use super::{Ends, FIRST_PAUSE, FromPort, ToPort};
use crate::problem::Problem;
use bytes::Bytes;
use std::net::SocketAddr;
use tokio::net::UdpSocket;

/// The largest datagram that is read.
const LARGEST: usize = 2048;

/// Receives at `local`, sends to `remote`, or to whoever was heard last if that is empty.
pub(super) async fn open(local: &str, remote: &str, ends: Ends) -> Result<(), Problem> {
    let remote = match remote {
        "" => None,
        text => {
            let problem = |e| Problem::Input(format!("modem.connect: {text}: {e}"));
            let none = || Problem::Input(format!("modem.connect: {text} is no address"));
            Some(tokio::net::lookup_host(text).await.map_err(problem)?.next().ok_or_else(none)?)
        }
    };
    let any = if remote.is_some_and(|r| r.is_ipv6()) { "[::]:0" } else { "0.0.0.0:0" };
    let local = if local.is_empty() { any } else { local };
    let problem = |e| Problem::Input(format!("modem.listen: cannot receive at {local}: {e}"));
    let socket = UdpSocket::bind(local).await.map_err(problem)?;
    tokio::spawn(carry(socket, remote, ends));
    Ok(())
}

async fn carry(socket: UdpSocket, fixed: Option<SocketAddr>, mut ends: Ends) {
    let mut peer = fixed;
    let mut buffer = [0; LARGEST];
    if ends.from.send(FromPort::Open).await.is_err() {
        return;
    }
    loop {
        tokio::select! {
            order = ends.to.recv() => match (order, peer) {
                (None, _) => return,
                (Some(ToPort::Bytes(bytes)), Some(peer)) => {
                    if let Err(e) = socket.send_to(&bytes, peer).await {
                        tracing::debug!("modem: {peer}: {e}");
                    }
                }
                (Some(_), _) => {}
            },
            received = socket.recv_from(&mut buffer) => match received {
                Ok((n, from)) => {
                    peer = fixed.or(Some(from));
                    let bytes = Bytes::copy_from_slice(buffer.get(..n).unwrap_or_default());
                    if ends.from.send(FromPort::Bytes(bytes)).await.is_err() {
                        return;
                    }
                }
                // A peer that is not there yet: the system tells so by an error of the next call.
                Err(_) => tokio::time::sleep(FIRST_PAUSE).await,
            },
        }
    }
}
