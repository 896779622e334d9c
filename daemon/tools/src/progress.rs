//! Progress of long work, shown on a terminal only.

use std::io::{IsTerminal, Write};

/// A line on the standard error output with the share of the work that is done.
pub struct Progress {
    task: &'static str,
    shown: Option<u32>,
}

impl Progress {
    pub fn new(task: &'static str) -> Self {
        Self { task, shown: None }
    }

    /// Shows a share of the work, 0..=1.
    pub fn show(&mut self, share: f64) {
        let percent = (share * 100.0) as u32;
        if std::io::stderr().is_terminal() && self.shown.replace(percent) != Some(percent) {
            eprint!("\r{} {percent:3} %", self.task);
            let _ = std::io::stderr().flush();
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if self.shown.is_some() {
            eprintln!();
        }
    }
}
