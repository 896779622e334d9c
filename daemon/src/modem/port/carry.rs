//! Moving bytes between a stream and the host.

use super::{Ends, FromPort, ToPort};
use std::io;
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};

/// Longest a write may take before the stream counts as dead.
const WRITE_LIMIT: Duration = Duration::from_secs(30);

/// Carries bytes both ways until the stream ends or fails, or the host is gone (`Ok`).
pub(super) async fn carry(stream: impl AsyncRead + AsyncWrite + Unpin, ends: &mut Ends) -> io::Result<()> {
    forget(ends);
    if ends.from.send(FromPort::Open).await.is_err() {
        return Ok(());
    }
    let result = pump(stream, ends).await;
    let told = ends.from.send(FromPort::Closed).await;
    if told.is_err() { Ok(()) } else { result }
}

async fn pump(stream: impl AsyncRead + AsyncWrite + Unpin, ends: &mut Ends) -> io::Result<()> {
    let (mut reader, mut writer) = tokio::io::split(stream);
    let mut buffer = [0; 4096];
    let mut out = bytes::Bytes::new();
    loop {
        // A write that the device takes slowly must not keep what was read from the host.
        tokio::select! {
            written = tokio::time::timeout(WRITE_LIMIT, writer.write(&out)), if !out.is_empty() => {
                let written = written.map_err(|_| io::Error::from(io::ErrorKind::TimedOut))??;
                if written == 0 {
                    return Err(io::ErrorKind::WriteZero.into());
                }
                let _ = out.split_to(written);
            }
            order = ends.to.recv(), if out.is_empty() => match order {
                Some(ToPort::Bytes(bytes)) => out = bytes,
                Some(ToPort::Reopen) => return Err(io::Error::other("the modem says nothing")),
                None => return Ok(()),
            },
            n = reader.read(&mut buffer) => {
                let n = n?;
                if n == 0 {
                    return Err(io::ErrorKind::UnexpectedEof.into());
                }
                let bytes = bytes::Bytes::copy_from_slice(buffer.get(..n).unwrap_or_default());
                if ends.from.send(FromPort::Bytes(bytes)).await.is_err() {
                    return Ok(());
                }
            }
        }
    }
}

/// What waited while nothing was connected is stale.
fn forget(ends: &mut Ends) {
    while ends.to.try_recv().is_ok() {}
}
