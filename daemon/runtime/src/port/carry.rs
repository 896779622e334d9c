//! Moves bytes between a stream and the host.

use super::{PortEnds, ToPort, read};
use std::io::{self, Write};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};
use tokio::time::Instant;

/// A stream that accepts no byte for this time counts as dead.
const WRITE_TIMEOUT: Duration = Duration::from_secs(30);

/// When a peer last sent a byte.
#[derive(Debug)]
pub(super) struct PortActivity {
    began: Instant,
    /// Microseconds from the beginning to the last received byte, at least 1; 0 before the first.
    last_us: AtomicU64,
}

impl PortActivity {
    pub(super) fn new() -> Self {
        Self { began: Instant::now(), last_us: AtomicU64::new(0) }
    }

    pub(super) fn began(&self) -> Instant {
        self.began
    }

    pub(super) fn has_spoken(&self) -> bool {
        self.last_us.load(Ordering::Relaxed) > 0
    }

    /// Time since the last received byte, or since the beginning.
    pub(super) fn silence(&self) -> Duration {
        let last = Duration::from_micros(self.last_us.load(Ordering::Relaxed));
        self.began.elapsed().saturating_sub(last)
    }

    fn note(&self) {
        let us = u64::try_from(self.began.elapsed().as_micros()).unwrap_or(u64::MAX);
        self.last_us.store(us.max(1), Ordering::Relaxed);
    }
}

/// Carries bytes both ways until the stream ends or fails, or is silent for `quiet`, or until the host is gone (`Ok`).
pub(super) async fn carry(
    stream: impl AsyncRead + AsyncWrite + Unpin,
    quiet: Option<Duration>,
    activity: &PortActivity,
    ends: &mut PortEnds,
) -> io::Result<()> {
    if !ends.report_open().await {
        return Ok(());
    }
    let (mut reader, mut writer) = tokio::io::split(stream);
    let mut buffer = [0; 4096];
    let mut out = bytes::Bytes::new();
    let (mut last_read, mut written) = (Instant::now(), Instant::now());
    loop {
        // A slow write must not delay input from the device. No write waits for the line to drain, which would block
        // the thread.
        tokio::select! {
            n = writer.write(&out), if !out.is_empty() => {
                let n = n?;
                if n == 0 {
                    return Err(io::ErrorKind::WriteZero.into());
                }
                let _ = out.split_to(n);
                written = Instant::now();
            }
            () = tokio::time::sleep_until(written + WRITE_TIMEOUT), if !out.is_empty() => {
                return Err(io::Error::new(io::ErrorKind::TimedOut, "it accepts no bytes"));
            }
            order = ends.to.recv(), if out.is_empty() => match order {
                Some(ToPort::Bytes(bytes)) => (out, written) = (bytes, Instant::now()),
                Some(ToPort::Reopen) => return Err(reopening()),
                // A stream has one peer.
                Some(ToPort::Judged(..)) => {}
                None => return Ok(()),
            },
            n = reader.read(&mut buffer) => {
                let n = n?;
                if n == 0 {
                    return Err(io::ErrorKind::UnexpectedEof.into());
                }
                last_read = Instant::now();
                activity.note();
                if !ends.report(read(&buffer, n)).await {
                    return Ok(());
                }
            }
            e = silence(last_read, quiet) => return Err(e),
        }
    }
}

/// Returns an error after `quiet` without a received byte; without `quiet` it never returns.
pub(super) async fn silence(last_read: Instant, quiet: Option<Duration>) -> io::Error {
    until(quiet.map(|quiet| last_read + quiet)).await;
    io::Error::new(io::ErrorKind::TimedOut, "no bytes arrived for too long")
}

/// Returns at a moment; without one it never returns.
pub(super) async fn until(due: Option<Instant>) {
    match due {
        Some(due) => tokio::time::sleep_until(due).await,
        None => std::future::pending().await,
    }
}

/// The error that makes the keeper open the port again, on the host's request.
pub(super) fn reopening() -> io::Error {
    io::Error::other("it does not answer")
}

/// Appends the bytes that the host writes to a file.
pub(super) async fn append(mut file: std::fs::File, ends: &mut PortEnds) -> io::Result<()> {
    if !ends.report_open().await {
        return Ok(());
    }
    while let Some(order) = ends.to.recv().await {
        match order {
            ToPort::Bytes(bytes) => file.write_all(&bytes)?,
            ToPort::Reopen => return Err(reopening()),
            ToPort::Judged(..) => {}
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::{FromPort, Port};
    use super::*;

    const SECOND: Duration = Duration::from_secs(1);

    /// A carried stream that holds 16 unread bytes: its far side, the port and the task.
    fn carried(quiet: Option<Duration>) -> (tokio::io::DuplexStream, Port, tokio::task::JoinHandle<io::Result<()>>) {
        let (near, far) = tokio::io::duplex(16);
        let (port, mut ends) = Port::pair();
        let task = tokio::spawn(async move { carry(near, quiet, &PortActivity::new(), &mut ends).await });
        (far, port, task)
    }

    #[tokio::test(start_paused = true)]
    async fn a_device_that_accepts_no_bytes_is_read_until_its_timeout() {
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
        assert_eq!(began.elapsed().as_secs(), WRITE_TIMEOUT.as_secs());
    }

    #[tokio::test(start_paused = true)]
    async fn a_slow_device_receives_all_bytes() {
        let (mut far, mut port, task) = carried(None);
        assert_eq!(port.next().await, FromPort::Open);
        assert!(port.write((0..100).collect()));
        let mut received = Vec::new();
        while received.len() < 100 {
            tokio::time::sleep(20 * SECOND).await;
            let mut buffer = [0; 8];
            let n = far.read(&mut buffer).await.unwrap();
            received.extend_from_slice(&buffer[..n]);
        }
        assert_eq!(received, (0..100).collect::<Vec<u8>>());
        drop(port);
        assert!(task.await.unwrap().is_ok(), "the host is gone");
    }

    #[tokio::test(start_paused = true)]
    async fn a_silent_instrument_counts_as_gone_despite_writes_to_it() {
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
