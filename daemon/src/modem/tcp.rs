//! Frames over TCP.

use super::pipe::{FIRST_PAUSE, back_off, carry, forget};
use crate::problem::Problem;
use bytes::Bytes;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::mpsc;

/// Listens or connects, and goes on doing so whenever the connection ends.
pub(super) async fn open(
    listen: &str,
    connect: &str,
    most: usize,
    to_modem: mpsc::Receiver<Bytes>,
    from_modem: mpsc::Sender<Bytes>,
) -> Result<(), Problem> {
    match (listen, connect) {
        ("", "") => Err(Problem::Input("modem kind tcp needs modem.listen or modem.connect".to_owned())),
        (listen, "") => {
            let problem = |e| Problem::Input(format!("modem.listen: cannot listen on {listen}: {e}"));
            let listener = TcpListener::bind(listen).await.map_err(problem)?;
            tokio::spawn(accept(listener, most, to_modem, from_modem));
            Ok(())
        }
        ("", address) => {
            tokio::spawn(reconnect(address.to_owned(), most, to_modem, from_modem));
            Ok(())
        }
        _ => Err(Problem::Input("modem kind tcp takes modem.listen or modem.connect, not both".to_owned())),
    }
}

/// Serves one connection at a time. A new one replaces the old, which may be the remains of a peer that lost power.
async fn accept(
    listener: TcpListener,
    most: usize,
    mut to_modem: mpsc::Receiver<Bytes>,
    from_modem: mpsc::Sender<Bytes>,
) {
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
            host_is_gone = serve(stream, most, &mut to_modem, &from_modem) => if host_is_gone { return },
            accepted = listener.accept() => next = Some(accepted),
        }
    }
}

async fn reconnect(address: String, most: usize, mut to_modem: mpsc::Receiver<Bytes>, from_modem: mpsc::Sender<Bytes>) {
    let mut pause = FIRST_PAUSE;
    loop {
        match TcpStream::connect(&address).await {
            Ok(stream) => {
                tracing::info!("modem: connected to {address}");
                pause = FIRST_PAUSE;
                if serve(stream, most, &mut to_modem, &from_modem).await {
                    return;
                }
            }
            Err(e) => tracing::debug!("modem: {address}: {e}"),
        }
        tokio::time::sleep(pause).await;
        pause = back_off(pause);
    }
}

/// Carries frames over one connection; says whether the host is gone.
async fn serve(
    stream: TcpStream,
    most: usize,
    to_modem: &mut mpsc::Receiver<Bytes>,
    from_modem: &mpsc::Sender<Bytes>,
) -> bool {
    let _ = stream.set_nodelay(true);
    forget(to_modem);
    match carry(stream, most, to_modem, from_modem).await {
        Ok(()) => true,
        Err(e) => {
            tracing::warn!("modem: the connection ended: {e}");
            false
        }
    }
}
