//! What the bytes of a port say where the configured modem does not get ready: who speaks there, or at which speed.

use scenecast_config::ModemKind;
use scenecast_protocol::time::Instant;
use std::collections::VecDeque;
use std::mem::Discriminant;
use std::time::Duration;

/// Time from the opening of the port after which it is judged: a modem that is there has answered by then.
const PATIENCE: Duration = Duration::from_secs(8);
/// Time after which the configured modem, which speaks, should be ready: it may have to boot first.
const BOOT_TIME: Duration = Duration::from_secs(30);
/// Fewer bytes of a pipe are not judged.
const FEW_BYTES: usize = 2048;
/// Bytes that are judged at most, the first of an opening.
const MAX_BYTES: usize = 4096;
/// Lines of ours that may come back.
const KEPT_LINES: usize = 16;
/// The longest line that is looked at, bytes.
const MAX_LINE: usize = 160;

/// Who speaks at a port.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Speaker {
    S2c,
    Micromodem,
    /// A receiver of satellite positions.
    Gnss,
    /// A computer that asks for a name and a password.
    Login,
}

impl Speaker {
    /// The make of a modem of this kind; none at the end of a pipe.
    pub fn of(kind: ModemKind) -> Option<Self> {
        match kind {
            ModemKind::S2c => Some(Self::S2c),
            ModemKind::Micromodem => Some(Self::Micromodem),
            ModemKind::Tcp | ModemKind::Udp | ModemKind::Transparent => None,
        }
    }
}

/// What is wrong at a port.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum PortFinding {
    /// Not one byte has come in since the port was opened.
    Silent,
    /// What comes in is no text: the speed of the line is another one, or the line is disturbed.
    NoText,
    /// Another device than the configured one speaks.
    Speaks(Speaker),
    /// What is written comes back.
    Echo,
    /// Text that no known device writes: its first line.
    UnknownText(String),
    /// The configured modem speaks, and does not get ready.
    NotReady,
    /// So many bytes have come through a pipe, and no frame is in them.
    NoFrames(usize),
}

/// Listens at the port of a modem until it is ready.
#[derive(Debug)]
pub struct PortListener {
    kind: ModemKind,
    opened: Option<Instant>,
    /// Time from then after which it is judged.
    patience: Duration,
    text: usize,
    other: usize,
    line: Vec<u8>,
    ours: VecDeque<Vec<u8>>,
    echoes: usize,
    speaker: Option<Speaker>,
    first_line: Option<String>,
    /// Bytes written since the opening.
    written: usize,
    /// Whether this opening was judged.
    is_judged: bool,
    /// The kinds of findings told since the modem was ready last; a pipe is always ready.
    told: Vec<Discriminant<PortFinding>>,
}

impl PortListener {
    /// A listener at the port of a modem of this kind.
    pub fn new(kind: ModemKind) -> Self {
        Self {
            kind,
            opened: None,
            patience: PATIENCE,
            text: 0,
            other: 0,
            line: Vec::new(),
            ours: VecDeque::new(),
            echoes: 0,
            speaker: None,
            first_line: None,
            written: 0,
            is_judged: false,
            told: Vec::new(),
        }
    }

    /// Judges the port from its opening at `now` on; kinds of findings that were reported before are not reported again.
    pub fn handle_open(&mut self, now: Instant) {
        *self = Self { opened: Some(now), told: std::mem::take(&mut self.told), ..Self::new(self.kind) };
    }

    /// The port was closed, or failed: what is not there has nothing wrong about it.
    pub fn handle_closed(&mut self) {
        *self = Self { told: std::mem::take(&mut self.told), ..Self::new(self.kind) };
    }

    /// The modem is ready, so that nothing is wrong. A pipe is ready as soon as it is open. Returns whether something was told before.
    pub fn handle_ready(&mut self) -> bool {
        if self.kind.is_pipe() {
            return false;
        }
        let was_told = !self.told.is_empty();
        *self = Self::new(self.kind);
        was_told
    }

    /// Bytes were written to the port.
    pub fn handle_written(&mut self, bytes: &[u8]) {
        self.written += bytes.len();
        let line = bytes.trim_ascii();
        if self.opened.is_some() && line.len() > 3 {
            self.ours.push_back(line.iter().copied().take(MAX_LINE).collect());
            self.ours.drain(..self.ours.len().saturating_sub(KEPT_LINES));
        }
    }

    /// Takes bytes that came in while the port is open; those after the first `MAX_BYTES` of an opening are passed over.
    pub fn handle_bytes(&mut self, bytes: &[u8]) {
        if self.opened.is_none() {
            return;
        }
        for &byte in bytes.iter().take(MAX_BYTES.saturating_sub(self.text + self.other)) {
            let is_text = byte.is_ascii_graphic() || byte.is_ascii_whitespace();
            *(if is_text { &mut self.text } else { &mut self.other }) += 1;
            if matches!(byte, b'\r' | b'\n') {
                self.end_line();
            } else if self.line.len() < MAX_LINE {
                self.line.push(byte);
            }
        }
    }

    fn end_line(&mut self) {
        let line = std::mem::take(&mut self.line);
        let line = line.trim_ascii();
        if line.is_empty() {
            return;
        }
        if self.ours.iter().any(|ours| ours == line) {
            self.echoes += 1;
            return;
        }
        self.speaker = self.speaker.or_else(|| speaker(line));
        if self.first_line.is_none() && line.iter().all(|byte| byte.is_ascii_graphic() || *byte == b' ') {
            self.first_line = Some(String::from_utf8_lossy(line).into_owned());
        }
    }

    /// When [`Self::poll`] may have something to say.
    pub fn poll_timeout(&self) -> Option<Instant> {
        let opened = self.opened.filter(|_| !self.is_judged)?;
        Some(opened + self.patience)
    }

    /// What is wrong: once, and again when it is something else. Either the modem has not got ready since the port was opened; or the
    /// bytes of a pipe, which is ready at once, have no frame, where `has_frames` does not say that one was heard.
    pub fn poll(&mut self, has_frames: bool, now: Instant) -> Option<PortFinding> {
        self.poll_timeout().filter(|due| now >= *due)?;
        if self.kind.is_pipe() && self.text + self.other < FEW_BYTES && self.speaker.is_none() {
            // Nothing comes through a pipe before the other end speaks.
            self.opened = Some(now);
            return None;
        }
        self.end_line();
        let finding = self.finding();
        if finding == PortFinding::NotReady && self.opened.is_some_and(|opened| now < opened + BOOT_TIME) {
            self.patience = BOOT_TIME;
            return None;
        }
        self.is_judged = true;
        if has_frames && self.kind.is_pipe() {
            return None;
        }
        let kind = std::mem::discriminant(&finding);
        let is_new = !self.told.contains(&kind);
        self.told.extend(is_new.then_some(kind));
        is_new.then_some(finding)
    }

    /// Who speaks, as far as whole lines tell it.
    pub fn speaker(&self) -> Option<Speaker> {
        self.speaker
    }

    /// Whether as much has come in as was written, so that it is probably the same.
    fn is_about_written(&self) -> bool {
        let heard = self.text + self.other;
        heard.abs_diff(self.written.min(MAX_BYTES)) <= heard / 10
    }

    /// What is wrong by what has come in so far, if the modem is not ready.
    pub fn finding(&self) -> PortFinding {
        let own = Speaker::of(self.kind);
        match self.speaker {
            _ if self.text + self.other == 0 => PortFinding::Silent,
            Some(speaker) if Some(speaker) != own => PortFinding::Speaks(speaker),
            Some(_) => PortFinding::NotReady,
            None if own.is_none() && self.is_about_written() => PortFinding::Echo,
            None if own.is_none() => PortFinding::NoFrames(self.text + self.other),
            None if self.other * 4 > self.text => PortFinding::NoText,
            None if self.echoes > 0 => PortFinding::Echo,
            None => PortFinding::UnknownText(self.first_line.clone().unwrap_or_default()),
        }
    }
}

/// Who writes such a line.
fn speaker(line: &[u8]) -> Option<Speaker> {
    let begins = |starts: &[&str]| starts.iter().any(|start| line.starts_with(start.as_bytes()));
    let talker = line.strip_prefix(b"$").and_then(|rest| rest.get(..2));
    match talker {
        Some(b"CA" | b"SN") => return Some(Speaker::Micromodem),
        Some(b"GP" | b"GN" | b"GL" | b"GA" | b"GB") => return Some(Speaker::Gnss),
        _ => {}
    }
    let answers =
        ["OK", "ERROR ", "BUSY ", "RECV", "DELIVERED", "FAILED", "INITIALIZED", "USBL", "SENDSTART", "SENDEND"];
    if begins(&["+++AT:", "[*]"]) || begins(&answers) {
        return Some(Speaker::S2c);
    }
    let text = String::from_utf8_lossy(line).to_ascii_lowercase();
    (text.ends_with("login:") || text.ends_with("password:")).then_some(Speaker::Login)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn heard(kind: ModemKind, written: &str, bytes: &[u8]) -> Option<PortFinding> {
        let mut listener = PortListener::new(kind);
        listener.handle_open(Instant::ZERO);
        listener.handle_written(written.as_bytes());
        bytes.chunks(7).for_each(|part| listener.handle_bytes(part));
        assert_eq!(listener.poll(false, Instant::ZERO + PATIENCE / 2), None, "the modem still has time");
        let found = listener.poll(false, Instant::ZERO + PATIENCE);
        found.or_else(|| listener.poll(false, Instant::ZERO + BOOT_TIME))
    }

    #[test]
    fn each_thing_at_the_port_is_told_apart() {
        use ModemKind::{Micromodem, S2c};
        let found = |kind, bytes: &[u8]| heard(kind, "AT?S\r\n", bytes).unwrap();
        assert_eq!(found(S2c, b""), PortFinding::Silent);
        assert_eq!(found(S2c, &[0xF8, 0, 0xE0, 0x80, b'A', 0xFE]), PortFinding::NoText);
        assert_eq!(found(S2c, b"$CAREV,160801,AUV,0.93.0.30*11\r\n"), PortFinding::Speaks(Speaker::Micromodem));
        assert_eq!(found(Micromodem, b"ERROR WRONG COMMAND\r\n"), PortFinding::Speaks(Speaker::S2c));
        assert_eq!(found(Micromodem, b"$GNGGA,120000,,,,,0,,,,,,,,*5E\r\n"), PortFinding::Speaks(Speaker::Gnss));
        assert_eq!(found(S2c, b"\r\nauv login:"), PortFinding::Speaks(Speaker::Login));
        assert_eq!(found(S2c, b"AT?S\r\nAT?S\r\n"), PortFinding::Echo);
        assert_eq!(found(S2c, b"hello\r\n"), PortFinding::UnknownText("hello".to_owned()));
        assert_eq!(found(S2c, b"OK\r\n"), PortFinding::NotReady);
    }

    #[test]
    fn a_pipe_is_judged_by_bytes_without_a_frame() {
        assert_eq!(heard(ModemKind::Transparent, "", &[7; FEW_BYTES - 1]), None);
        assert_eq!(heard(ModemKind::Transparent, "", &[7; FEW_BYTES]), Some(PortFinding::NoFrames(FEW_BYTES)));
        let gnss = b"$GPRMC,120000,V,,,,,,,,,,N*5A\r\n";
        assert_eq!(heard(ModemKind::Tcp, "", gnss), Some(PortFinding::Speaks(Speaker::Gnss)), "few bytes are enough");
        let mut listener = PortListener::new(ModemKind::Transparent);
        listener.handle_open(Instant::ZERO);
        listener.handle_bytes(&[7; FEW_BYTES]);
        assert_eq!(listener.poll(true, Instant::ZERO + PATIENCE), None, "frames are heard");
        listener.handle_open(Instant::ZERO);
        listener.handle_written(&[7; FEW_BYTES]);
        listener.handle_bytes(&[7; FEW_BYTES]);
        assert_eq!(listener.poll(false, Instant::ZERO + PATIENCE), Some(PortFinding::Echo));
        listener.handle_closed();
        assert_eq!(listener.poll_timeout(), None, "a closed port");
    }

    #[test]
    fn a_finding_is_told_once_until_the_modem_was_ready() {
        let mut listener = PortListener::new(ModemKind::S2c);
        let mut opened = |at_s: u64, bytes: &[u8], is_ready: bool| {
            let at = Instant::ZERO + Duration::from_secs(at_s);
            listener.handle_open(at);
            listener.handle_bytes(bytes);
            if is_ready {
                assert!(listener.handle_ready());
            }
            listener.poll(false, at + PATIENCE)
        };
        assert_eq!(opened(0, b"", false), Some(PortFinding::Silent));
        assert_eq!(opened(10, b"", false), None);
        assert_eq!(opened(20, &[0xFF; 9], false), Some(PortFinding::NoText));
        assert_eq!(opened(30, b"", false), None, "it was told before");
        assert_eq!(opened(40, b"a 1\r\n", false), Some(PortFinding::UnknownText("a 1".to_owned())));
        assert_eq!(opened(50, b"a 2\r\n", false), None);
        assert_eq!(opened(60, b"OK\r\n", true), None);
        assert_eq!(opened(70, b"", false), Some(PortFinding::Silent));
    }
}
