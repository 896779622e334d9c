//! How lines reach the host: plain, or wrapped in TIES while the port is in data mode.

use super::S2c;
use super::config::Interpreter;
use crate::Duration;

/// Whether a port of the `AT` interpreter passes raw data.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Mode {
    Data,
    Command,
}

impl S2c {
    pub(super) fn in_data_mode(&self) -> bool {
        self.config.interpreter == Interpreter::At && self.mode == Mode::Data
    }

    /// Answers the command of that name, given without parameters; only whoever asked hears it.
    pub(super) fn reply(&mut self, name: &str, body: impl AsRef<[u8]>, now: Duration) {
        let line = self.line(name, body.as_ref());
        self.board.tell(self.asking, &line, now);
    }

    /// Tells every host something that was not asked.
    pub(super) fn notify(&mut self, body: impl AsRef<[u8]>, now: Duration) {
        let line = self.line("", body.as_ref());
        self.board.tell_all(&line, now);
    }

    /// Tells it if extended notifications were wanted.
    pub(super) fn notify_extended(&mut self, body: impl AsRef<[u8]>, now: Duration) {
        if self.options.extended {
            self.notify(body, now);
        }
    }

    fn line(&self, name: &str, body: &[u8]) -> Vec<u8> {
        let mut line = Vec::with_capacity(body.len() + 24);
        if self.in_data_mode() {
            line.extend(format!("+++AT{name}:{}:", body.len()).bytes());
        }
        line.extend(body);
        line.extend(b"\r\n");
        line
    }

    /// An answer that is never wrapped: `ERROR WRONG FORMAT` of a port that has no such mode, `OK` of an escape.
    pub(super) fn plain_line(&mut self, body: &str, now: Duration) {
        self.board.tell(self.asking, format!("{body}\r\n").as_bytes(), now);
    }
}
