//! The lines of an S2C modem: replies, notifications, and raw data between them.
//!
//! Payload is counted, never searched. Memory is bounded, and after invalid bytes the parser resumes with the next
//! valid line.

use super::notice::{Notice, parse_notice, payload_length};

/// A line of the modem.
#[derive(Debug, Clone, PartialEq)]
pub enum Line {
    /// The answer to a command: the command's name where the modem repeats it, and the text.
    Reply(Option<String>, String),
    /// Something that was not asked for.
    Notice(Notice),
    /// Burst data of a port of the AT interpreter.
    Raw(Vec<u8>),
}

/// The longest line, payload included.
const LIMIT: usize = 4096;
/// The longest line without payload.
const TEXT_LIMIT: usize = 512;
const TIES: &[u8] = b"+++AT";

#[derive(Debug, Default)]
pub struct LineParser {
    buffer: Vec<u8>,
    /// Whether the port passes raw data: lines then begin with `+++AT`.
    ties: bool,
}

impl LineParser {
    /// Whether lines come wrapped, between raw data.
    pub fn set_ties(&mut self, ties: bool) {
        self.ties = ties;
    }

    pub fn clear(&mut self) {
        self.buffer.clear();
    }

    pub fn kept(&self) -> usize {
        self.buffer.len()
    }

    /// Takes bytes of the port.
    pub fn push(&mut self, bytes: &[u8]) {
        self.buffer.extend_from_slice(bytes);
    }

    pub fn next_line(&mut self) -> Option<Line> {
        if self.ties { self.next_wrapped() } else { self.next_plain() }
    }

    fn next_plain(&mut self) -> Option<Line> {
        loop {
            let blank = self.buffer.iter().take_while(|b| matches!(b, b'\r' | b'\n')).count();
            self.buffer.drain(..blank);
            if self.buffer.is_empty() {
                return None;
            }
            match plain_line(&self.buffer) {
                Found::Line(line, used) => {
                    self.buffer.drain(..used);
                    return Some(line);
                }
                Found::Nonsense(used) => drop(self.buffer.drain(..used)),
                Found::Incomplete if self.buffer.len() > LIMIT => self.buffer.clear(),
                Found::Incomplete => return None,
            }
        }
    }

    fn next_wrapped(&mut self) -> Option<Line> {
        let start = ties_start(&self.buffer);
        if start > 0 {
            return Some(Line::Raw(self.buffer.drain(..start).collect()));
        }
        if self.buffer.starts_with(b"ERROR WRONG FORMAT") {
            // A port that knows no `+++AT` says so without wrapping.
            self.ties = false;
            return self.next_plain();
        }
        match wrapped_line(&self.buffer)? {
            Ok((line, used)) => {
                self.buffer.drain(..used);
                Some(line)
            }
            Err(used) => Some(Line::Raw(self.buffer.drain(..used).collect())),
        }
    }
}

enum Found {
    Line(Line, usize),
    /// Skips bytes that belong to no line.
    Nonsense(usize),
    Incomplete,
}

/// A line at the beginning of `bytes`, which do not begin with a line end.
fn plain_line(bytes: &[u8]) -> Found {
    let end = bytes.iter().position(|b| *b == b'\n');
    if let Some((head, length)) = payload_length(bytes) {
        let whole = head + length;
        match bytes.get(whole..) {
            Some([b'\r', b'\n', ..]) => {
                let notice = bytes.get(..whole).and_then(parse_notice);
                return notice.map_or(Found::Nonsense(whole), |notice| Found::Line(Line::Notice(notice), whole + 2));
            }
            Some([] | [b'\r']) | None => return Found::Incomplete,
            // The length was not what follows: the next line begins behind the line end.
            Some(_) => return Found::Nonsense(end.map_or(bytes.len(), |end| end + 1)),
        }
    }
    match end {
        Some(end) => match bytes.get(..end).map(text) {
            Some(Some(text)) => Found::Line(classify(text), end + 1),
            _ => Found::Nonsense(end + 1),
        },
        None if bytes.len() > TEXT_LIMIT && !bytes.starts_with(b"RECV") => Found::Nonsense(bytes.len()),
        None => Found::Incomplete,
    }
}

/// A line without its end, if it is text.
fn text(line: &[u8]) -> Option<&str> {
    let line = line.strip_suffix(b"\r").unwrap_or(line);
    let is_text = line.len() <= TEXT_LIMIT && line.iter().all(|b| (b' '..=b'~').contains(b));
    std::str::from_utf8(line).ok().filter(|_| is_text)
}

fn classify(text: &str) -> Line {
    match parse_notice(text.as_bytes()) {
        Some(notice) => Line::Notice(notice),
        None => Line::Reply(None, text.to_owned()),
    }
}

/// The start of `+++AT` or of a prefix of it at the end; the length if there is none.
fn ties_start(bytes: &[u8]) -> usize {
    let error = b"ERROR WRONG FORMAT";
    (0..bytes.len())
        .find(|&start| {
            let rest = bytes.get(start..).unwrap_or_default();
            rest.starts_with(TIES) || TIES.starts_with(rest) || rest.starts_with(error) || error.starts_with(rest)
        })
        .unwrap_or(bytes.len())
}

/// `+++AT<name>:<length>:<text>` and a line end: `None` if incomplete, so many bytes of something else, or a line.
fn wrapped_line(bytes: &[u8]) -> Option<Result<(Line, usize), usize>> {
    const NAME_LIMIT: usize = 16;
    let body = bytes.get(TIES.len()..)?;
    let Some(colon) = body.iter().take(NAME_LIMIT).position(|b| *b == b':') else {
        return (body.len() >= NAME_LIMIT).then_some(Err(TIES.len()));
    };
    let rest = body.get(colon + 1..)?;
    let Some(second) = rest.iter().take(5).position(|b| *b == b':') else {
        return (rest.len() >= 5).then_some(Err(TIES.len()));
    };
    let name = body.get(..colon).and_then(text);
    let length = rest.get(..second).and_then(text).and_then(|digits| digits.parse::<usize>().ok());
    let (Some(name), Some(length)) = (name, length.filter(|&n| n <= LIMIT)) else { return Some(Err(TIES.len())) };
    let begin = TIES.len() + colon + 1 + second + 1;
    let whole = begin + length;
    match bytes.get(whole..) {
        Some([b'\r', b'\n', ..]) => {}
        Some([] | [b'\r']) | None => return None,
        Some(_) => return Some(Err(TIES.len())),
    }
    let content = bytes.get(begin..whole).unwrap_or_default();
    let line = match (name, parse_notice(content)) {
        ("", Some(notice)) => Line::Notice(notice),
        ("", None) => Line::Notice(Notice::Other),
        _ => Line::Reply(Some(name.to_owned()), String::from_utf8_lossy(content).into_owned()),
    };
    Some(Ok((line, whole + 2)))
}

#[cfg(test)]
#[path = "line_tests.rs"]
mod tests;
