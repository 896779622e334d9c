//! The emulators reply as in the transcripts of known clients. `transcripts/README.md` describes the format.

use sim_channel::modem::micromodem::{Micromodem, MicromodemConfig};
use sim_channel::modem::s2c::{Interpreter, S2c, S2cConfig};
use sim_channel::modem::{Basin, Emulator};
use sim_channel::{Channel, ChannelConfig, Duration, NodeId, NodePosition};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Longest time of a reply that is not acoustic.
const REPLY_TIMEOUT: Duration = Duration::from_millis(250);

struct Replay {
    basin: Basin,
    /// Bytes that each host has received and that are not yet compared.
    received: BTreeMap<u8, Vec<u8>>,
    micromodems: bool,
    /// File and line number, for failures.
    location: String,
}

impl Replay {
    fn new() -> Self {
        let basin = Basin::new(Channel::new(ChannelConfig::default(), 1));
        Self { basin, received: BTreeMap::new(), micromodems: false, location: String::new() }
    }

    #[allow(clippy::disallowed_methods, reason = "transcripts are files")]
    fn run(mut self, path: &Path) {
        let text = std::fs::read_to_string(path).expect("transcript");
        for (number, line) in (1..).zip(text.lines().map(str::trim_end)) {
            self.location = format!("{}:{number}", path.display());
            self.step(line);
        }
        self.pass(REPLY_TIMEOUT);
        self.expect_nothing(1);
    }

    fn step(&mut self, line: &str) {
        let (node, line) = line.strip_prefix('2').map_or((1, line), |rest| (2, rest));
        match line.split_once(' ').unwrap_or((line, "")) {
            ("" | "#", _) => {}
            ("modem", words) => self.add(words),
            ("wait", seconds) => self.pass(Duration::from_secs_f64(seconds.parse().expect("seconds"))),
            ("drop", _) => self.received.entry(node).or_default().clear(),
            (">", text) => {
                if node == 1 {
                    self.expect_nothing(1);
                }
                self.write(node, &bytes(text));
                self.pass(REPLY_TIMEOUT);
            }
            ("<", text) => self.expect(node, text),
            ("?", text) => drop(self.take(node, text)),
            _ => panic!("{}: no line of a transcript: {line}", self.location),
        }
    }

    fn add(&mut self, words: &str) {
        let (kind, rest) = words.split_once(' ').unwrap_or((words, ""));
        let keys: BTreeMap<_, _> = rest.split(' ').filter_map(|pair| pair.split_once('=')).collect();
        let number = |key| keys.get(key).map_or(0, |value: &&str| value.parse().expect("number"));
        let modem: Box<dyn Emulator> = if kind == "s2c" {
            let interpreter = if keys["interpreter"] == "AT" { Interpreter::At } else { Interpreter::Net };
            Box::new(S2c::new(S2cConfig { interpreter, remote: number("remote"), ..S2cConfig::new(number("address")) }))
        } else {
            self.micromodems = true;
            Box::new(Micromodem::new(MicromodemConfig {
                baud: Some(115_200),
                ..MicromodemConfig::new(number("address"))
            }))
        };
        let node = NodeId(self.received.len() as u8 + 1);
        let x_m = keys.get("at").map_or(0.0, |metres| metres.parse().expect("metres"));
        self.basin.channel().place(node, NodePosition::new(x_m, 0.0, 0.0));
        self.basin.add(node, modem);
        self.received.insert(node.0, Vec::new());
    }

    /// Writes in small pieces, as a slow line may.
    fn write(&mut self, node: u8, bytes: &[u8]) {
        let whole = self.sentence(bytes);
        for piece in whole.chunks(3) {
            let now = self.basin.now();
            self.basin.handle_host_bytes(NodeId(node), piece, now);
        }
    }

    fn sentence(&self, text: &[u8]) -> Vec<u8> {
        let ending = if self.micromodems { &b"\r\n"[..] } else { b"" };
        [text, ending].concat()
    }

    fn pass(&mut self, length: Duration) {
        let end = self.basin.now() + length;
        while let Some(at) = self.basin.poll_timeout().filter(|at| *at <= end) {
            let now = self.basin.now();
            self.basin.advance(at.max(now));
            self.collect();
        }
        self.basin.advance(end);
        self.collect();
    }

    fn collect(&mut self) {
        for (node, received) in &mut self.received {
            received.extend(self.basin.poll_host_bytes(NodeId(*node)));
        }
    }

    fn expect(&mut self, node: u8, text: &str) {
        if self.take(node, text).is_none() {
            let received = self.received[&node].escape_ascii().to_string();
            panic!("{}: host {node} received\n  {received}\ninstead of\n  {text}", self.location);
        }
    }

    fn expect_nothing(&mut self, node: u8) {
        let received = &self.received[&node];
        assert!(received.is_empty(), "{}: host {node} received more: {}", self.location, received.escape_ascii());
    }

    /// Removes the bytes that a pattern matches from the front of the received bytes.
    fn take(&mut self, node: u8, text: &str) -> Option<()> {
        let received = self.received.get_mut(&node)?;
        let length = if self.micromodems {
            let end = received.iter().position(|byte| *byte == b'\n')? + 1;
            let body = received.get(..end)?.strip_suffix(b"\r\n")?;
            let (body, sum) = body.split_at(body.len().checked_sub(3)?);
            let xor = body.iter().skip(1).fold(0, |sum, byte| sum ^ byte);
            (sum == format!("*{xor:02X}").as_bytes() && matched(body, text) == Some(body.len())).then_some(end)?
        } else {
            matched(received, text)?
        };
        received.drain(..length);
        Some(())
    }
}

/// Number of bytes at the front that a pattern matches, as few as possible.
fn matched(received: &[u8], pattern: &str) -> Option<usize> {
    let Some(open) = pattern.find('{') else {
        let literal = bytes(pattern);
        return received.starts_with(&literal).then_some(literal.len());
    };
    let literal = bytes(&pattern[..open]);
    let rest = received.strip_prefix(literal.as_slice())?;
    let (kind, after) = pattern[open + 1..].split_once('}').expect("wildcard");
    let lengths = (0..=rest.len()).filter(|length| fits(&rest[..*length], kind));
    let found = if after.is_empty() {
        lengths.take_while(|length| *length <= rest.len()).last()
    } else {
        lengths.into_iter().find_map(|length| Some(length + matched(&rest[length..], after)?))
    };
    found.map(|length| literal.len() + length)
}

fn fits(bytes: &[u8], kind: &str) -> bool {
    let text = std::str::from_utf8(bytes).unwrap_or("\n");
    match kind {
        "n" => text.strip_prefix('-').unwrap_or(text).bytes().all(|byte| byte.is_ascii_digit()) && !text.is_empty(),
        "f" => text.contains('.') && text.parse::<f64>().is_ok(),
        "h" => !text.is_empty() && text.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'A'..=b'F')),
        "*" => !bytes.iter().any(|byte| matches!(byte, b'\r' | b'\n')),
        _ => panic!("no wildcard {kind}"),
    }
}

/// The bytes of a text with escapes.
fn bytes(text: &str) -> Vec<u8> {
    let mut out = Vec::new();
    let mut rest = text.bytes();
    while let Some(byte) = rest.next() {
        let escaped = if byte == b'\\' { rest.next() } else { None };
        out.push(match escaped {
            None => byte,
            Some(b'r') => b'\r',
            Some(b'n') => b'\n',
            Some(b'x') => {
                let digits: Vec<u8> = rest.by_ref().take(2).collect();
                u8::from_str_radix(std::str::from_utf8(&digits).expect("hex"), 16).expect("hex")
            }
            Some(other) => other,
        });
    }
    out
}

#[test]
fn emulators_match_the_transcripts() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("transcripts");
    let mut files: Vec<PathBuf> =
        std::fs::read_dir(folder).expect("folder").map(|entry| entry.expect("entry").path()).collect();
    files.retain(|path| path.extension().is_some_and(|extension| extension == "txt"));
    files.sort();
    assert!(files.len() >= 9);
    files.iter().for_each(|path| Replay::new().run(path));
}

#[test]
fn transcript_mismatch_is_detected() {
    for wrong in ["< NET\\r\\n", "< AT\\r\\n< more"] {
        let failed = std::panic::catch_unwind(|| {
            let mut replay = Replay::new();
            replay.step("modem s2c interpreter=AT address=1");
            replay.step("> +++AT?MODE\\r");
            replay.step(wrong);
        });
        assert!(failed.is_err(), "{wrong}");
    }
}
