//! A pseudo-terminal as the port of a modem, which clients may open and close, and a symbolic link as its stable name.

use super::emulation::{FromHost, Speed};
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use nix::pty::openpty;
use nix::sys::termios::{FlushArg, SetArg, cfmakeraw, tcflush, tcgetattr, tcsetattr};
use scenecast_core::UserError;
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

/// A folder of links. Links made by this process are removed at its end.
#[derive(Debug)]
pub struct Links {
    folder: Option<PathBuf>,
    made: Vec<PathBuf>,
}

impl Links {
    /// Creates the folder if it does not exist; with `None` there are no links.
    pub fn new(folder: Option<&Path>) -> Result<Self, UserError> {
        if let Some(folder) = folder {
            std::fs::create_dir_all(folder)
                .map_err(|e| UserError::Input(format!("--link-dir {}: {e}", folder.display())))?;
        }
        Ok(Self { folder: folder.map(Path::to_owned), made: Vec::new() })
    }

    /// Points the link `name` to a device and replaces an existing link atomically. A file that is no link is refused.
    #[cfg(unix)]
    pub fn point(&mut self, name: &str, device: &Path) -> Result<Option<PathBuf>, UserError> {
        let Some(folder) = &self.folder else { return Ok(None) };
        let link = folder.join(name);
        if std::fs::symlink_metadata(&link).is_ok_and(|found| !found.is_symlink()) {
            return Err(UserError::Input(format!("{}: there is a file that is no symbolic link", link.display())));
        }
        let fresh = folder.join(format!(".{name}.new"));
        let _ = std::fs::remove_file(&fresh);
        std::os::unix::fs::symlink(device, &fresh)
            .and_then(|()| std::fs::rename(&fresh, &link))
            .map_err(|e| UserError::Failed(format!("{}: {e}", link.display())))?;
        self.made.push(link.clone());
        Ok(Some(link))
    }

    /// Removes a link if this process made it.
    pub fn remove(&mut self, name: &str) {
        if let Some(index) = self.made.iter().position(|link| link.file_name().is_some_and(|n| n == name)) {
            remove_link(&self.made.swap_remove(index));
        }
    }
}

impl Drop for Links {
    fn drop(&mut self) {
        self.made.iter().for_each(|link| remove_link(link));
    }
}

/// A link that is already gone is no error.
fn remove_link(link: &Path) {
    if std::fs::symlink_metadata(link).is_ok_and(|found| found.is_symlink()) {
        let _ = std::fs::remove_file(link);
    }
}
