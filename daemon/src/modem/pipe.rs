//! Moving bytes between a stream and the host.

use super::framing::{Deframer, encode};
use bytes::Bytes;
use std::io;
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};
use tokio::sync::mpsc;

/// Longest a write may take before the stream counts as dead.
const WRITE_LIMIT: Duration = Duration::from_secs(60);

/// Carries frames both ways until the stream ends or fails, or the host is gone (`Ok`).
pub(super) async fn carry(
    stream: impl AsyncRead + AsyncWrite + Unpin,
    most: usize,
    to_modem: &mut mpsc::Receiver<Bytes>,
    from_modem: &mpsc::Sender<Bytes>,
) -> io::Result<()> {
    let (mut reader, mut writer) = tokio::io::split(stream);
    let mut deframer = Deframer::new(most);
    let mut buffer = [0; 2048];
    loop {
        tokio::select! {
            frame = to_modem.recv() => {
                let Some(frame) = frame else { return Ok(()) };
                let write = async {
                    writer.write_all(&encode(&frame)).await?;
                    writer.flush().await
                };
                tokio::time::timeout(WRITE_LIMIT, write).await.map_err(|_| io::Error::from(io::ErrorKind::TimedOut))??;
            }
            n = reader.read(&mut buffer) => {
                let n = n?;
                if n == 0 {
                    return Err(io::ErrorKind::UnexpectedEof.into());
                }
                let mut frames = Vec::new();
                deframer.push(&buffer[..n], |f| frames.push(f));
                for frame in frames {
                    if from_modem.send(frame.into()).await.is_err() {
                        return Ok(());
                    }
                }
            }
        }
    }
}

/// What waited while nothing was connected is stale.
pub(super) fn forget(to_modem: &mut mpsc::Receiver<Bytes>) {
    while to_modem.try_recv().is_ok() {}
}

/// The pause before the next try: doubles up to five seconds.
pub(super) fn back_off(pause: Duration) -> Duration {
    (pause * 2).min(Duration::from_secs(5))
}

/// The first pause.
pub(super) const FIRST_PAUSE: Duration = Duration::from_millis(200);
