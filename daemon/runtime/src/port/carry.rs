//! Moving bytes between a stream and the host.

use super::{PortEnds, ToPort, read};
use std::io::{self, Write};
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};
use tokio::time::Instant;

/// A stream that takes no byte for so long counts as dead.
const WRITE_LIMIT: Duration = Duration::from_secs(30);

/// Carries bytes both ways until the stream ends or fails, or is silent for `quiet`, or the host is gone (`Ok`).
pub(super) async fn carry(
    stream: impl AsyncRead + AsyncWrite + Unpin,
    quiet: Option<Duration>,
    ends: &mut PortEnds,
) -> io::Result<()> {
    if !ends.tell_open().await {
        return Ok(());
    }
    let (mut reader, mut writer) = tokio::io::split(stream);
    let mut buffer = [0; 4096];
    let mut out = bytes::Bytes::new();
    let (mut heard, mut written) = (Instant::now(), Instant::now());
    loop {
        // A write that the device takes slowly must not hold back its input. No write waits for the line to
        // drain: that would hold up the thread.
        tokio::select! {
            n = writer.write(&out), if !out.is_empty() => {
                let n = n?;
                if n == 0 {
                    return Err(io::ErrorKind::WriteZero.into());
                }
                let _ = out.split_to(n);
                written = Instant::now();
            }
            () = tokio::time::sleep_until(written + WRITE_LIMIT), if !out.is_empty() => {
                return Err(io::Error::new(io::ErrorKind::TimedOut, "it takes no bytes"));
            }
            order = ends.to.recv(), if out.is_empty() => match order {
                Some(ToPort::Bytes(bytes)) => (out, written) = (bytes, Instant::now()),
                Some(ToPort::Reopen) => return Err(reopening()),
                None => return Ok(()),
            },
            n = reader.read(&mut buffer) => {
                let n = n?;
                if n == 0 {
                    return Err(io::ErrorKind::UnexpectedEof.into());
                }
                heard = Instant::now();
                if !ends.tell(read(&buffer, n)).await {
                    return Ok(());
                }
            }
            e = silence(heard, quiet) => return Err(e),
        }
    }
}

/// Ends when no byte has come for too long.
pub(super) async fn silence(heard: Instant, quiet: Option<Duration>) -> io::Error {
    match quiet {
        Some(quiet) => tokio::time::sleep_until(heard + quiet).await,
        None => std::future::pending().await,
    }
    io::Error::new(io::ErrorKind::TimedOut, "nothing came for long")
}

/// The host wants it opened again.
pub(super) fn reopening() -> io::Error {
    io::Error::other("it does not answer")
}

/// Appends the bytes that the host writes.
pub(super) async fn append(mut file: std::fs::File, ends: &mut PortEnds) -> io::Result<()> {
    if !ends.tell_open().await {
        return Ok(());
    }
    while let Some(order) = ends.to.recv().await {
        match order {
            ToPort::Bytes(bytes) => file.write_all(&bytes)?,
            ToPort::Reopen => return Err(reopening()),
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::{FromPort, Port};
    use super::*;

    const SECOND: Duration = Duration::from_secs(1);

    /// A stream that takes 16 bytes until somebody reads them, carried; its far side and the port.
    fn carried(quiet: Option<Duration>) -> (tokio::io::DuplexStream, Port, tokio::task::JoinHandle<io::Result<()>>) {
        let (near, far) = tokio::io::duplex(16);
        let (port, mut ends) = Port::pair();
        let task = tokio::spawn(async move { carry(near, quiet, &mut ends).await });
        (far, port, task)
    }

    #[tokio::test(start_paused = true)]
    async fn a_device_that_takes_nothing_is_still_heard_and_counts_as_dead_after_a_while_however_much_it_says() {
        let (mut far, mut port, task) = carried(None);
        assert_eq!(port.next().await, FromPort::Open);
        assert!(port.write(vec![7; 100]));
        let began = Instant::now();
        for i in 0..29 {
            far.write_all(&[i]).await.unwrap();
            assert_eq!(port.next().await, FromPort::Bytes(vec![i].into()));
            tokio::time::sleep(SECOND).await;
        }
        assert!(!task.is_finished());
        assert_eq!(task.await.unwrap().unwrap_err().kind(), io::ErrorKind::TimedOut);
        assert_eq!(began.elapsed().as_secs(), WRITE_LIMIT.as_secs());
    }

    #[tokio::test(start_paused = true)]
    async fn a_device_that_takes_bytes_slowly_gets_them_all() {
        let (mut far, mut port, task) = carried(None);
        assert_eq!(port.next().await, FromPort::Open);
        assert!(port.write((0..100).collect()));
        let mut heard = Vec::new();
        while heard.len() < 100 {
            tokio::time::sleep(20 * SECOND).await;
            let mut buffer = [0; 8];
            let n = far.read(&mut buffer).await.unwrap();
            heard.extend_from_slice(&buffer[..n]);
        }
        assert_eq!(heard, (0..100).collect::<Vec<u8>>());
        drop(port);
        assert!(task.await.unwrap().is_ok(), "the host is gone");
    }

    #[tokio::test(start_paused = true)]
    async fn an_instrument_that_says_nothing_counts_as_gone_though_the_host_writes_to_it() {
        let (mut far, mut port, task) = carried(Some(10 * SECOND));
        assert_eq!(port.next().await, FromPort::Open);
        far.write_all(b"$").await.unwrap();
        let began = Instant::now();
        while !task.is_finished() {
            port.write(vec![1]);
            let _ = far.read(&mut [0; 8]).await;
            tokio::time::sleep(SECOND).await;
        }
        assert_eq!(task.await.unwrap().unwrap_err().kind(), io::ErrorKind::TimedOut);
        assert!((10..=12).contains(&began.elapsed().as_secs()));
    }
}
