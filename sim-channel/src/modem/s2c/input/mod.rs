//! Cuts the bytes of a host into commands, messages and data. A payload is counted, never searched.

mod send_command;

pub(crate) use send_command::{HeaderErrorKind, InstantFlag, SendCommand, SendService};

use send_command::{HeaderError, HeaderParse, parse_header};
use std::time::Duration;

/// Longest command line without payload; the reply to a longer one is `ERROR WRONG FORMAT`.
const MAX_LINE_BYTES: usize = 512;
/// Silence before and after `+++` that makes it an escape.
const GUARD_TIME: Duration = Duration::from_secs(1);
const ESCAPE: &[u8] = b"+++";
const TIES: &[u8] = b"+++AT";

#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) enum HostInput {
    /// A command, without `AT` and terminator.
    Command(String),
    /// A message to send, with its payload complete and terminated, or the error in it.
    Send(Result<SendCommand, HeaderError>),
    /// A line that is not a command.
    WrongFormat,
    /// Raw burst data, in data mode.
    Data(Vec<u8>),
    /// `+++` with a silence before and behind it.
    Escape,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum ReadMode {
    /// Raw data with `+++AT` commands in it.
    Data,
    Commands,
}

/// Keeps incomplete input, at most the longest message.
#[derive(Debug, Default)]
pub(crate) struct InputParser {
    buffer: Vec<u8>,
    after_cr: bool,
    skip_line: bool,
    last_byte: Option<Duration>,
    guard_before: bool,
}

impl InputParser {
    /// Takes bytes that came at `now`.
    pub(crate) fn push(&mut self, bytes: &[u8], now: Duration) {
        let silent = self.last_byte.is_none_or(|last| now.saturating_sub(last) >= GUARD_TIME);
        if self.buffer.is_empty() {
            self.guard_before = silent;
        }
        self.last_byte = Some(now);
        self.buffer.extend_from_slice(bytes);
    }

    /// Time at which silence gives the incomplete input another meaning.
    pub(crate) fn timeout(&self, mode: ReadMode) -> Option<Duration> {
        let waits = mode == ReadMode::Data && !self.buffer.is_empty() && TIES.starts_with(&self.buffer);
        self.last_byte.filter(|_| waits).map(|last| last + GUARD_TIME)
    }

    /// A silence has passed: a lone `+++` is an escape, a part of it is data.
    pub(crate) fn handle_timeout(&mut self, now: Duration, mode: ReadMode) -> Option<HostInput> {
        self.timeout(mode).filter(|at| *at <= now)?;
        let kept = std::mem::take(&mut self.buffer);
        Some(if kept == ESCAPE && self.guard_before { HostInput::Escape } else { HostInput::Data(kept) })
    }

    /// The next complete input; `mode` may change between calls.
    pub(crate) fn next(&mut self, mode: ReadMode) -> Option<HostInput> {
        loop {
            let first = *self.buffer.first()?;
            if std::mem::take(&mut self.after_cr) && first == b'\n' {
                self.buffer.remove(0);
                continue;
            }
            if self.skip_line {
                self.take_line()?;
                self.skip_line = false;
                continue;
            }
            return match mode {
                ReadMode::Data => self.next_in_data(),
                ReadMode::Commands => match self.next_command(0)? {
                    Some(input) => Some(input),
                    None => continue,
                },
            };
        }
    }

    fn next_in_data(&mut self) -> Option<HostInput> {
        let start = escape_start(&self.buffer);
        if start > 0 {
            return Some(HostInput::Data(self.buffer.drain(..start).collect()));
        }
        if self.buffer.len() < TIES.len() {
            return None;
        }
        self.next_command(ESCAPE.len()).map(|input| input.unwrap_or(HostInput::WrongFormat))
    }

    /// A command after `prefix` bytes of escape: `None` if incomplete, `Some(None)` for an empty line.
    fn next_command(&mut self, prefix: usize) -> Option<Option<HostInput>> {
        let text = self.buffer.get(prefix..).unwrap_or_default();
        match parse_header(text) {
            HeaderParse::Incomplete if text.len() <= MAX_LINE_BYTES => None,
            HeaderParse::Message(command, header_bytes) => self.take_message(command, prefix + header_bytes).map(Some),
            HeaderParse::Wrong(error) => {
                self.skip_line = self.take_line().is_none();
                Some(Some(HostInput::Send(Err(error))))
            }
            HeaderParse::Incomplete | HeaderParse::NoSend => self.take_plain(prefix),
        }
    }

    /// Takes the payload by its length, then the terminator.
    fn take_message(&mut self, mut command: SendCommand, header_bytes: usize) -> Option<HostInput> {
        let end = header_bytes + command.length;
        let terminator = *self.buffer.get(end)?;
        command.data = self.buffer.get(header_bytes..end).unwrap_or_default().to_vec();
        if matches!(terminator, b'\r' | b'\n') {
            self.after_cr = terminator == b'\r';
            self.buffer.drain(..=end);
            return Some(HostInput::Send(command.check_length()));
        }
        self.buffer.drain(..end);
        self.skip_line = self.take_line().is_none();
        Some(HostInput::Send(Err(HeaderError { name: command.service.name(), kind: HeaderErrorKind::Format })))
    }

    fn take_plain(&mut self, prefix: usize) -> Option<Option<HostInput>> {
        let too_long = self.buffer.len() > MAX_LINE_BYTES;
        let Some(line) = self.take_line() else { return too_long.then_some(Some(HostInput::WrongFormat)) };
        let text = line.get(prefix..).unwrap_or_default();
        if line.is_empty() {
            return Some(None);
        }
        let command =
            text.strip_prefix(b"AT").filter(|command| command.iter().all(|byte| (b' '..=b'~').contains(byte)));
        Some(Some(match command {
            Some(command) => HostInput::Command(command.iter().map(|byte| char::from(*byte)).collect()),
            None => HostInput::WrongFormat,
        }))
    }

    /// Takes the bytes up to the next terminator, which is dropped. A skipped line without end is not kept.
    fn take_line(&mut self) -> Option<Vec<u8>> {
        let Some(end) = self.buffer.iter().position(|byte| matches!(byte, b'\r' | b'\n')) else {
            if self.skip_line || self.buffer.len() > MAX_LINE_BYTES {
                self.buffer.clear();
                self.skip_line = true;
            }
            return None;
        };
        self.after_cr = self.buffer.get(end) == Some(&b'\r');
        let line = self.buffer.drain(..=end).take(end).collect();
        Some(line)
    }
}

/// Index of `+++AT` or of a beginning of it at the end of `bytes`; the length if there is neither.
fn escape_start(bytes: &[u8]) -> usize {
    (0..bytes.len())
        .find(|start| {
            let rest = bytes.get(*start..).unwrap_or_default();
            rest.starts_with(TIES) || TIES.starts_with(rest)
        })
        .unwrap_or(bytes.len())
}

#[cfg(test)]
#[path = "parser_tests.rs"]
mod tests;
