//! A process of `scenecast` that is measured.

use scenecast_core::UserError;
use std::net::TcpListener;
use std::process::{Child, ChildStdin, Command};
use std::time::{Duration, Instant};

/// A process that ends with the measurement.
pub(crate) struct Process(Child);

impl Process {
    pub(crate) fn start(command: &mut Command) -> Result<Self, UserError> {
        let spawned = command.spawn();
        spawned.map(Self).map_err(|e| UserError::file(command.get_program().as_ref(), format!("does not start: {e}")))
    }

    /// Its standard input, once, if that is a pipe.
    pub(crate) fn take_input(&mut self) -> Option<ChildStdin> {
        self.0.stdin.take()
    }

    /// Ends it as a person would, and waits for it.
    pub(crate) fn interrupt(&mut self) {
        let _ = Command::new("kill").args(["-INT", &self.0.id().to_string()]).status();
        let until = Instant::now() + Duration::from_secs(20);
        while matches!(self.0.try_wait(), Ok(None)) && Instant::now() < until {
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    /// Processor time so far, seconds; `None` where the system does not tell.
    pub(crate) fn cpu_s(&self) -> Option<f64> {
        let stat = self.proc_file("stat")?;
        let fields: Vec<&str> = stat.rsplit(')').next()?.split_whitespace().collect();
        // Fields 14 and 15 of proc(5), in hundredths of a second.
        let ticks: u64 = fields.get(11..13)?.iter().filter_map(|field| field.parse::<u64>().ok()).sum();
        Some(ticks as f64 / 100.0)
    }

    /// The largest memory that it has held, MB.
    pub(crate) fn peak_memory_mb(&self) -> Option<f64> {
        let status = self.proc_file("status")?;
        let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
        Some(line.trim().trim_end_matches("kB").trim().parse::<f64>().ok()? / 1024.0)
    }

    fn proc_file(&self, name: &str) -> Option<String> {
        std::fs::read_to_string(format!("/proc/{}/{name}", self.0.id())).ok()
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A port of this machine that nobody listens on.
pub(crate) fn free_port() -> Result<u16, UserError> {
    let address = TcpListener::bind("127.0.0.1:0").and_then(|listener| listener.local_addr());
    address.map(|address| address.port()).map_err(|e| UserError::Failed(format!("no free port: {e}")))
}
