//! Messages between the test basin and the tasks at its ports.

use std::time::Duration;
use tokio::net::TcpStream;
use tokio::sync::mpsc;
use tokio::task::AbortHandle;

/// Pieces for a host that wait for its task; more are lost, as on a line that nobody reads.
const WAITING_PIECES: usize = 1024;

/// A message of a host or of a port. `modem` counts from 0 in the order of the scenario; `line` is a number of the
/// port's choosing, 0 for a serial one.
#[derive(Debug)]
pub enum FromHost {
    Bytes {
        modem: usize,
        line: u32,
        bytes: Vec<u8>,
    },
    /// A TCP client has come.
    Joined {
        modem: usize,
        stream: TcpStream,
    },
    /// A TCP client has gone.
    Left {
        modem: usize,
        line: u32,
    },
}

/// The way to one host; its task ends with it.
#[derive(Debug)]
pub struct Line {
    to_host: mpsc::Sender<Vec<u8>>,
    task: AbortHandle,
}

impl Line {
    /// Starts a task that gets the bytes for the host.
    pub fn start<F: Future<Output = ()> + Send + 'static>(task: impl FnOnce(mpsc::Receiver<Vec<u8>>) -> F) -> Self {
        let (to_host, told) = mpsc::channel(WAITING_PIECES);
        Self { to_host, task: tokio::spawn(task(told)).abort_handle() }
    }

    /// Sends bytes to the host, if it keeps up.
    pub fn tell(&self, bytes: Vec<u8>) {
        let _ = self.to_host.try_send(bytes);
    }
}

impl Drop for Line {
    fn drop(&mut self) {
        self.task.abort();
    }
}

/// How fast a line takes bytes, in the world's time.
#[derive(Debug, Clone, Copy)]
pub struct Speed {
    /// Bytes a second of the world; `None` without pacing.
    pub bytes_per_s: Option<f64>,
}

impl Speed {
    /// Most bytes to take at a time: the bytes of five milliseconds.
    pub fn piece(&self) -> usize {
        self.bytes_per_s.map_or(4096, |rate| ((rate * 0.005) as usize).clamp(16, 4096))
    }

    /// How long that many bytes keep the line busy.
    pub fn time_of(&self, bytes: usize) -> Duration {
        self.bytes_per_s.map_or(Duration::ZERO, |rate| Duration::from_secs_f64(bytes as f64 / rate))
    }
}
