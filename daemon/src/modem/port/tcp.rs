//! A TCP connection, to a modem or to the other end.

use super::carry::carry;
use super::{Ends, FIRST_PAUSE, back_off};
use crate::problem::Problem;
use std::time::Duration;
use tokio::net::{TcpListener, TcpStream};

/// Longest wait for a connection: an address that nobody answers at must not take minutes.
const CONNECT_LIMIT: Duration = Duration::from_secs(5);

/// Listens, and goes on doing so whenever the connection ends.
pub(super) async fn listen(address: &str, ends: Ends) -> Result<(), Problem> {
    let problem = |e| Problem::Input(format!("modem.listen: cannot listen on {address}: {e}"));
    let listener = TcpListener::bind(address).await.map_err(problem)?;
    tokio::spawn(accept(listener, ends));
    Ok(())
}

/// Connects, and goes on doing so whenever the connection ends.
pub(super) fn connect(address: String, ends: Ends) {
    tokio::spawn(reconnect(address, ends));
}

/// Serves one connection at a time. A new one replaces the old, which may be the remains of a peer that lost power.
async fn accept(listener: TcpListener, mut ends: Ends) {
    let mut next = None;
    loop {
        let accepted = match next.take() {
            Some(accepted) => accepted,
            None => listener.accept().await,
        };
        let (stream, peer) = match accepted {
            Ok(accepted) => accepted,
            Err(e) => {
                tracing::warn!("modem: {e}");
                tokio::time::sleep(FIRST_PAUSE).await;
                continue;
            }
        };
        tracing::info!("modem: {peer} connected");
        tokio::select! {
            host_is_gone = serve(stream, &mut ends) => if host_is_gone { return },
            accepted = listener.accept() => next = Some(accepted),
        }
    }
}

async fn reconnect(address: String, mut ends: Ends) {
    let mut pause = FIRST_PAUSE;
    loop {
        match tokio::time::timeout(CONNECT_LIMIT, TcpStream::connect(&address)).await {
            Ok(Ok(stream)) => {
                tracing::info!("modem: connected to {address}");
                pause = FIRST_PAUSE;
                if serve(stream, &mut ends).await {
                    return;
                }
            }
            Ok(Err(e)) => tracing::debug!("modem: {address}: {e}"),
            Err(_) => tracing::debug!("modem: {address}: no answer"),
        }
        if ends.from.is_closed() {
            return;
        }
        tokio::time::sleep(pause).await;
        pause = back_off(pause);
    }
}

/// Carries bytes over one connection; says whether the host is gone.
async fn serve(stream: TcpStream, ends: &mut Ends) -> bool {
    let _ = stream.set_nodelay(true);
    match carry(stream, ends).await {
        Ok(()) => true,
        Err(e) => {
            tracing::warn!("modem: the connection ended: {e}");
            false
        }
    }
}
