//! NMEA sentences: `$` + five letters + comma fields + `*` + two upper-case hex digits + CR LF.

/// Longest sentence that is kept: the largest frame in hex, and a margin.
const MAX_LINE_BYTES: usize = 6 * 1024;

/// A sentence from the host without `$`, checksum and line end.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct NmeaSentence {
    pub name: String,
    pub fields: Vec<String>,
}

#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) enum HostLine {
    Sentence(NmeaSentence),
    BadChecksum,
    NotUnderstood,
}

impl NmeaSentence {
    /// The field at `index` as a number; `None` if it is missing or not a number.
    pub(super) fn number<N: std::str::FromStr>(&self, index: usize) -> Option<N> {
        self.fields.get(index)?.parse().ok()
    }

    pub(super) fn text(&self, index: usize) -> &str {
        self.fields.get(index).map_or("", String::as_str)
    }

    /// The sentence as the modem repeats it, with `CA` for `CC`.
    pub(super) fn echo(&self) -> String {
        let name = self.name.strip_prefix("CC").unwrap_or(&self.name);
        std::iter::once(format!("CA{name}")).chain(self.fields.iter().cloned()).collect::<Vec<_>>().join(",")
    }
}

/// XOR of all bytes between `$` and `*`.
pub(super) fn checksum(body: &[u8]) -> u8 {
    body.iter().fold(0, |sum, byte| sum ^ byte)
}

/// The complete line for a body such as `CATXF,192`.
pub(super) fn line(body: &str) -> String {
    format!("${body}*{:02X}\r\n", checksum(body.as_bytes()))
}

/// Collects bytes to lines, in bounded memory.
#[derive(Debug, Default)]
pub(super) struct LineCollector {
    buffer: Vec<u8>,
}

impl LineCollector {
    pub(super) fn push(&mut self, bytes: &[u8]) {
        self.buffer.extend_from_slice(bytes);
    }

    /// The next complete line that is not empty; every `$` starts a new sentence.
    pub(super) fn next(&mut self) -> Option<HostLine> {
        loop {
            let Some(end) = self.buffer.iter().position(|byte| matches!(byte, b'\r' | b'\n')) else {
                if self.buffer.len() > MAX_LINE_BYTES {
                    self.buffer.clear();
                }
                return None;
            };
            let raw: Vec<u8> = self.buffer.drain(..=end).take(end).collect();
            let start = raw.iter().rposition(|byte| *byte == b'$');
            if let Some(text) = start.and_then(|start| raw.get(start + 1..)) {
                return Some(parse(text));
            }
            if !raw.is_empty() {
                return Some(HostLine::NotUnderstood);
            }
        }
    }
}

/// Reads the text between `$` and the line end; the checksum may be missing.
fn parse(text: &[u8]) -> HostLine {
    let Ok(text) = std::str::from_utf8(text) else { return HostLine::NotUnderstood };
    if text.bytes().any(|byte| byte.is_ascii_control()) || text.len() > MAX_LINE_BYTES {
        return HostLine::NotUnderstood;
    }
    let body = match text.rsplit_once('*') {
        Some((body, sum)) if u8::from_str_radix(sum.trim(), 16) == Ok(checksum(body.as_bytes())) => body,
        Some(_) => return HostLine::BadChecksum,
        None => text,
    };
    let mut fields = body.split(',').map(str::to_string);
    match fields.next() {
        Some(name) if name.len() == 5 && name.bytes().all(|byte| byte.is_ascii_uppercase()) => {
            HostLine::Sentence(NmeaSentence { name, fields: fields.collect() })
        }
        _ => HostLine::NotUnderstood,
    }
}

/// Bytes from hex digits in either case; `None` for an odd number of digits and for other characters.
pub(super) fn from_hex(text: &str) -> Option<Vec<u8>> {
    let digits: Option<Vec<u8>> = text.chars().map(|c| c.to_digit(16).and_then(|d| u8::try_from(d).ok())).collect();
    let digits = digits.filter(|digits| digits.len() % 2 == 0)?;
    Some(digits.chunks_exact(2).map(|pair| pair.iter().fold(0, |byte, digit| byte << 4 | digit)).collect())
}

/// Upper-case hex digits, as the modem writes them.
pub(super) fn to_hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02X}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn read(bytes: &[u8]) -> Vec<HostLine> {
        let mut collector = LineCollector::default();
        collector.push(bytes);
        std::iter::from_fn(|| collector.next()).collect()
    }

    fn sentence(text: &str) -> HostLine {
        let mut fields = text.split(',').map(str::to_string);
        HostLine::Sentence(NmeaSentence { name: fields.next().expect("name"), fields: fields.collect() })
    }

    #[test]
    fn checksums_match_lines_of_real_modems() {
        for real in [
            "$CAREV,181807,AUV,2.0.27087*12",
            "$CACFG,SRC,1*33",
            "$CAXST,7,20250606,230103.000935,3,0,200,5000,25000,1,0,1,0,0,1,5,2,25000*53",
            "$CACST,1,153026.0000,0,4105,30,0318,0193,10,00,00,01,01,2,004,004,3,3,3,1,154,09,08,10,-6,000,0.0,4125000,5000*5B",
        ] {
            let body = real.strip_prefix('$').and_then(|rest| rest.rsplit_once('*')).expect("sentence").0;
            assert_eq!(line(body), format!("{real}\r\n"));
        }
    }

    #[test]
    fn a_checksum_may_be_missing_but_not_wrong() {
        assert_eq!(read(b"$CCCFG,SRC,1\r\n"), [sentence("CCCFG,SRC,1")]);
        assert_eq!(read(b"$CCCFG,SRC,1*31\r\n"), [sentence("CCCFG,SRC,1")]);
        assert_eq!(read(b"$CCCFG,SRC,1*32\r\n"), [HostLine::BadChecksum]);
        assert_eq!(read(b"$CCCFG,SRC,1*\r\n"), [HostLine::BadChecksum]);
    }

    #[test]
    fn a_new_start_ends_what_came_before() {
        assert_eq!(read(b"garbage$CCTM$CCTMQ,0\r\n"), [sentence("CCTMQ,0")]);
        assert_eq!(read(b"garbage\r\n\r\n"), [HostLine::NotUnderstood]);
        assert_eq!(read(b"$CC\r\n"), [HostLine::NotUnderstood]);
    }

    #[test]
    fn an_echo_keeps_every_field() {
        let HostLine::Sentence(sentence) = sentence("CCCYC,0,1,2,1,1,3") else { panic!("sentence") };
        assert_eq!(sentence.echo(), "CACYC,0,1,2,1,1,3");
    }

    #[test]
    fn hex_comes_in_either_case_and_whole_bytes() {
        assert_eq!(from_hex("00fFa0"), Some(vec![0, 255, 160]));
        assert_eq!(from_hex(""), Some(vec![]));
        assert_eq!(from_hex("0"), None);
        assert_eq!(from_hex("0g"), None);
        assert_eq!(to_hex(&[0, 255, 160]), "00FFA0");
    }

    proptest! {
        #[test]
        fn any_bytes_are_survived_in_bounded_memory(
            pieces in proptest::collection::vec(proptest::collection::vec(any::<u8>(), 0..300), 0..60),
        ) {
            let mut collector = LineCollector::default();
            for piece in pieces {
                collector.push(&piece);
                while collector.next().is_some() {}
                prop_assert!(collector.buffer.len() <= MAX_LINE_BYTES);
            }
        }
    }
}
