//! Progress of long work, on a terminal only.

use std::io::{IsTerminal, Write};

/// A line on the standard error output that shows how far the work is.
pub struct Progress {
    what: &'static str,
    shown: Option<u32>,
}

impl Progress {
    pub fn new(what: &'static str) -> Self {
        Self { what, shown: None }
    }

    /// Shows a share of the work, 0..=1.
    pub fn show(&mut self, share: f64) {
        let percent = (share * 100.0) as u32;
        if std::io::stderr().is_terminal() && self.shown.replace(percent) != Some(percent) {
            eprint!("\r{} {percent:3} %", self.what);
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
