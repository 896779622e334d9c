//! A pseudo-terminal as the port of a modem; clients may open and close it at any time.

use super::line::{FromHost, Speed};
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use nix::pty::openpty;
use nix::sys::termios::{FlushArg, SetArg, cfmakeraw, tcflush, tcgetattr, tcsetattr};
use std::fs::OpenOptions;
use std::io;
use std::os::fd::{AsFd, OwnedFd};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;
use tokio::io::Interest;
use tokio::io::unix::AsyncFd;
use tokio::sync::mpsc;
use tokio::time::Instant;

/// Interval at which an unopened device is polled for a client.
const POLL_INTERVAL: Duration = Duration::from_millis(25);
/// Bytes that wait for a client that does not read; further ones are lost.
const WAITING_BYTES: usize = 256 * 1024;

/// A pseudo-terminal in raw mode.
#[derive(Debug)]
pub struct Pty {
    master: Arc<OwnedFd>,
    device: PathBuf,
}

impl Pty {
    pub fn open() -> io::Result<Self> {
        let pair = openpty(None, None)?;
        let device = nix::unistd::ttyname(&pair.slave)?;
        let flags = nix::fcntl::OFlag::O_NONBLOCK;
        nix::fcntl::fcntl(&pair.master, nix::fcntl::FcntlArg::F_SETFL(flags))?;
        make_raw(&pair.slave)?;
        Ok(Self { master: Arc::new(pair.master), device })
    }

    pub fn device(&self) -> &Path {
        &self.device
    }

    /// Moves bytes between the device and the emulation until the emulation drops `output`.
    pub async fn serve(
        self,
        modem: usize,
        speed: Speed,
        to_emulation: mpsc::Sender<FromHost>,
        mut output: mpsc::Receiver<Vec<u8>>,
    ) {
        loop {
            self.clean();
            while self.is_closed() {
                tokio::select! {
                    () = tokio::time::sleep(POLL_INTERVAL) => {}
                    // Bytes are lost while no client has the device open.
                    lost = output.recv() => if lost.is_none() { return },
                }
            }
            if self.attend(modem, speed, &to_emulation, &mut output).await.is_none() {
                return;
            }
        }
    }

    /// Discards the unread bytes and the line settings of the last client.
    fn clean(&self) {
        const O_NOCTTY: i32 = nix::fcntl::OFlag::O_NOCTTY.bits();
        let device = OpenOptions::new().read(true).write(true).custom_flags(O_NOCTTY).open(&self.device);
        if let Ok(device) = device {
            let _ = tcflush(&device, FlushArg::TCIFLUSH);
            let _ = make_raw(&device);
        }
    }

    /// Whether no client has the device open.
    fn is_closed(&self) -> bool {
        let mut fds = [PollFd::new(self.master.as_fd(), PollFlags::POLLIN)];
        let polled = poll(&mut fds, PollTimeout::ZERO);
        polled.is_ok() && fds[0].revents().is_some_and(|found| found.contains(PollFlags::POLLHUP))
    }

    /// Serves a client until it closes the device; `None` if the emulation drops `output`.
    async fn attend(
        &self,
        modem: usize,
        speed: Speed,
        to_emulation: &mpsc::Sender<FromHost>,
        output: &mut mpsc::Receiver<Vec<u8>>,
    ) -> Option<()> {
        #[allow(deprecated, reason = "its successor is unsafe code; an OwnedFd does keep its descriptor")]
        let fd = AsyncFd::new(Arc::clone(&self.master)).ok()?;
        let mut piece = vec![0; speed.piece()];
        let mut waiting: Vec<u8> = Vec::new();
        let mut free_at = Instant::now();
        loop {
            let now = Instant::now();
            tokio::select! {
                read = fd.async_io(Interest::READABLE, |fd| Ok(nix::unistd::read(fd, &mut piece)?)), if free_at <= now => {
                    let count = match read {
                        Ok(0) | Err(_) => return Some(()),
                        Ok(count) => count,
                    };
                    free_at = now + speed.time_of(count);
                    to_emulation.send(FromHost::Bytes { modem, line: 0, bytes: piece[..count].to_vec() }).await.ok()?;
                }
                () = tokio::time::sleep_until(free_at), if free_at > now => {}
                more = output.recv() => {
                    let more = more?;
                    let room = WAITING_BYTES - waiting.len();
                    waiting.extend_from_slice(&more[..room.min(more.len())]);
                }
                written = fd.async_io(Interest::WRITABLE, |fd| Ok(nix::unistd::write(fd, &waiting)?)), if !waiting.is_empty() => {
                    match written {
                        Ok(count) => drop(waiting.drain(..count)),
                        Err(_) => return Some(()),
                    }
                }
            }
        }
    }
}

/// Sets raw mode: no echo, no line editing, no signals.
fn make_raw(device: impl AsFd) -> nix::Result<()> {
    let mut settings = tcgetattr(&device)?;
    cfmakeraw(&mut settings);
    tcsetattr(&device, SetArg::TCSANOW, &settings)
}
