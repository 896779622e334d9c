//! TCP ports that wait for the other side to connect.

use super::carry::carry;
use super::{FromPort, PortEnds};
use std::io;
use std::time::Duration;
use tokio::net::{TcpListener, TcpStream};

/// Pause after the system refused to accept a connection.
const RETRY_INTERVAL: Duration = Duration::from_millis(200);

/// Serves one connection at a time until the host is gone. A new connection replaces the old one, whose peer
/// may have lost its power.
pub(super) async fn accept(
    name: &'static str,
    listener: TcpListener,
    quiet: Option<Duration>,
    ends: &mut PortEnds,
) -> io::Result<()> {
    let mut next = None;
    loop {
        let accepted = match next.take() {
            Some(accepted) => accepted,
            None => tokio::select! {
                accepted = listener.accept() => accepted,
                () = ends.from.closed() => return Ok(()),
            },
        };
        let (stream, peer) = match accepted {
            Ok(accepted) => accepted,
            Err(e) => {
                tracing::warn!("{name}: {e}");
                tokio::time::sleep(RETRY_INTERVAL).await;
                continue;
            }
        };
        tracing::info!("{name}: {peer} connected");
        tokio::select! {
            is_host_gone = serve(name, stream, quiet, ends) => if is_host_gone { return Ok(()) },
            accepted = listener.accept() => next = Some(accepted),
        }
    }
}

/// Carries bytes over one connection; returns whether the host is gone.
async fn serve(name: &'static str, stream: TcpStream, quiet: Option<Duration>, ends: &mut PortEnds) -> bool {
    let _ = stream.set_nodelay(true);
    match carry(stream, quiet, ends).await {
        Ok(()) => true,
        Err(e) => {
            tracing::warn!("{name}: the connection ended: {e}");
            !ends.report(FromPort::Closed).await
        }
    }
}
