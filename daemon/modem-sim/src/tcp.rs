//! A TCP port of a modem: several clients at once.

use super::line::{FromHost, Speed};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::tcp::OwnedReadHalf;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::mpsc;

/// Accepts clients until the emulation ends.
pub async fn accept(listener: TcpListener, modem: usize, to_emulation: mpsc::Sender<FromHost>) {
    loop {
        match listener.accept().await {
            Ok((stream, _)) => {
                let _ = stream.set_nodelay(true);
                if to_emulation.send(FromHost::Joined { modem, stream }).await.is_err() {
                    return;
                }
            }
            // No free descriptor, or the client closed the connection: the next attempt may succeed.
            Err(_) => tokio::time::sleep(std::time::Duration::from_millis(100)).await,
        }
    }
}

/// Moves bytes between a client and the emulation until either closes.
pub async fn serve(
    stream: TcpStream,
    (modem, line): (usize, u32),
    speed: Speed,
    to_emulation: mpsc::Sender<FromHost>,
    mut output: mpsc::Receiver<Vec<u8>>,
) {
    let (reading, mut writing) = stream.into_split();
    let read = read(reading, (modem, line), speed, to_emulation.clone());
    let write = async {
        while let Some(bytes) = output.recv().await {
            if writing.write_all(&bytes).await.is_err() {
                return;
            }
        }
    };
    tokio::select! {
        () = read => {}
        () = write => {}
    }
    let _ = to_emulation.send(FromHost::Left { modem, line }).await;
}

async fn read(
    mut reading: OwnedReadHalf,
    (modem, line): (usize, u32),
    speed: Speed,
    to_emulation: mpsc::Sender<FromHost>,
) {
    let mut piece = vec![0; speed.piece()];
    while let Ok(count @ 1..) = reading.read(&mut piece).await {
        let bytes = piece[..count].to_vec();
        if to_emulation.send(FromHost::Bytes { modem, line, bytes }).await.is_err() {
            return;
        }
        tokio::time::sleep(speed.time_of(count)).await;
    }
}
