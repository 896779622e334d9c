//! The messages between the basin and the tasks at its ports, and the pace of a line.

use std::time::Duration;
use tokio::net::TcpStream;
use tokio::sync::mpsc;
use tokio::task::AbortHandle;

/// Pieces that wait for the task at a port; further ones are lost, as on a line without a reader.
const WAITING_PIECES: usize = 1024;

/// A message of a client or of a port. `modem` counts from 0 in the order of the scenario; `line` is the number that
/// the port gave to the client, 0 for a serial line.
#[derive(Debug)]
pub enum FromHost {
    Bytes {
        modem: usize,
        line: u32,
        bytes: Vec<u8>,
    },
    /// A TCP client connected to the port.
    Joined {
        modem: usize,
        stream: TcpStream,
    },
    /// A TCP client closed its connection.
    Left {
        modem: usize,
        line: u32,
    },
}

/// The output to one client; its task is aborted when this is dropped.
#[derive(Debug)]
pub struct PortLine {
    to_client: mpsc::Sender<Vec<u8>>,
    task: AbortHandle,
}

impl PortLine {
    /// Starts a task that receives the bytes for the client.
    pub fn start<F: Future<Output = ()> + Send + 'static>(task: impl FnOnce(mpsc::Receiver<Vec<u8>>) -> F) -> Self {
        let (to_client, output) = mpsc::channel(WAITING_PIECES);
        Self { to_client, task: tokio::spawn(task(output)).abort_handle() }
    }

    /// Sends bytes to the client; they are lost if [`WAITING_PIECES`] pieces wait already.
    pub fn send(&self, bytes: Vec<u8>) {
        let _ = self.to_client.try_send(bytes);
    }
}

impl Drop for PortLine {
    fn drop(&mut self) {
        self.task.abort();
    }
}

/// The pace of a line in wall time.
#[derive(Debug, Clone, Copy)]
pub struct Speed {
    /// Bytes a second of wall time; `None` without pacing.
    pub bytes_per_s: Option<f64>,
}

impl Speed {
    /// Maximum number of bytes to read at a time: those of five milliseconds.
    pub fn piece(&self) -> usize {
        self.bytes_per_s.map_or(4096, |rate| ((rate * 0.005) as usize).clamp(16, 4096))
    }

    /// Wall time for which that many bytes occupy the line.
    pub fn time_of(&self, bytes: usize) -> Duration {
        self.bytes_per_s.map_or(Duration::ZERO, |rate| Duration::from_secs_f64(bytes as f64 / rate))
    }
}
