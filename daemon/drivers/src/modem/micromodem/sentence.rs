//! NMEA sentences of a Micromodem.

const LIMIT: usize = 6 * 1024;

/// A sentence of the modem, checksum verified.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Sentence {
    /// Talker and type, as in `CARXD`.
    pub name: String,
    pub fields: Vec<String>,
}

impl Sentence {
    /// A field as a number.
    pub fn number<N: std::str::FromStr>(&self, index: usize) -> Option<N> {
        self.fields.get(index)?.trim().parse().ok()
    }

    /// A field; empty if there is none.
    pub fn text(&self, index: usize) -> &str {
        self.fields.get(index).map_or("", String::as_str)
    }
}

fn checksum(body: &[u8]) -> u8 {
    body.iter().fold(0, |sum, byte| sum ^ byte)
}

/// A sentence for the modem.
pub fn format_sentence(body: &str) -> Vec<u8> {
    format!("${body}*{:02X}\r\n", checksum(body.as_bytes())).into_bytes()
}

pub fn to_hex(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 16] = b"0123456789ABCDEF";
    let digit = |n: u8| char::from(DIGITS[usize::from(n & 15)]);
    bytes.iter().flat_map(|&byte| [digit(byte >> 4), digit(byte)]).collect()
}

/// Bytes of hex digits in either case.
pub fn from_hex(text: &str) -> Option<Vec<u8>> {
    let digit = |byte: u8| char::from(byte).to_digit(16);
    let pairs = text.as_bytes().chunks(2);
    pairs
        .map(|pair| match *pair {
            [high, low] => Some((digit(high)? << 4 | digit(low)?) as u8),
            _ => None,
        })
        .collect()
}

/// Finds sentences in a stream of bytes: a new one begins at each `$`.
#[derive(Debug, Default)]
pub struct SentenceParser {
    collected: Vec<u8>,
    is_open: bool,
}

impl SentenceParser {
    pub fn kept(&self) -> usize {
        self.collected.len()
    }

    /// Takes bytes; calls `found` for each whole sentence with a right checksum, which the modem always sends.
    pub fn push(&mut self, bytes: &[u8], mut found: impl FnMut(Sentence)) {
        for &byte in bytes {
            match byte {
                b'$' => {
                    self.collected.clear();
                    self.is_open = true;
                }
                b'\r' | b'\n' => {
                    if std::mem::take(&mut self.is_open)
                        && let Some(sentence) = read(&self.collected)
                    {
                        found(sentence);
                    }
                    self.collected.clear();
                }
                _ if self.is_open && self.collected.len() < LIMIT => self.collected.push(byte),
                _ => self.is_open = false,
            }
        }
    }
}

fn read(bytes: &[u8]) -> Option<Sentence> {
    const NAME: usize = 5;
    let text = std::str::from_utf8(bytes).ok().filter(|text| text.is_ascii())?;
    let (body, sum) = text.rsplit_once('*')?;
    let digits = sum.get(..2).filter(|_| sum.len() == 2)?;
    if u8::from_str_radix(digits, 16).ok()? != checksum(body.as_bytes()) {
        return None;
    }
    let mut fields = body.split(',').map(str::to_owned);
    let name = fields.next().filter(|name| name.len() == NAME)?;
    Some(Sentence { name, fields: fields.collect() })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sentences(bytes: &[u8]) -> Vec<Sentence> {
        let (mut parser, mut found) = (SentenceParser::default(), Vec::new());
        bytes.chunks(3).for_each(|piece| parser.push(piece, |s| found.push(s)));
        found
    }

    #[test]
    fn lines_of_real_modems_are_read_and_written() {
        for real in [
            "$CAREV,181807,AUV,2.0.27087*12",
            "$CACFG,SRC,1*33",
            "$CAXST,7,20250606,230103.000935,3,0,200,5000,25000,1,0,1,0,0,1,5,2,25000*53",
            "$CACST,1,153026.0000,0,4105,30,0318,0193,10,00,00,01,01,2,004,004,3,3,3,1,154,09,08,10,-6,000,0.0,4125000,5000*5B",
        ] {
            let found = sentences(format!("{real}\r\n").as_bytes());
            let [sentence] = found.as_slice() else { panic!("{real}: {found:?}") };
            let body = format!("{},{}", sentence.name, sentence.fields.join(","));
            assert_eq!(format_sentence(&body), format!("{real}\r\n").as_bytes());
        }
    }

    #[test]
    fn a_sentence_without_a_right_checksum_is_none() {
        assert!(sentences(b"$CACFG,SRC,1*32\r\n$CACFG,SRC,1\r\n$CACFG,SRC,1*3\r\n$*00\r\n").is_empty());
    }

    #[test]
    fn the_sentence_after_half_a_line_is_found() {
        let found = sentences(b"CFG,SRC\xFF$CARXD,1,2$CACFG,SRC,1*33\r\n");
        assert_eq!(found.len(), 1);
        assert_eq!((found[0].name.as_str(), found[0].text(0), found[0].number(1)), ("CACFG", "SRC", Some(1u8)));
    }

    #[test]
    fn hex_is_written_and_read_back() {
        let bytes: Vec<u8> = (0..=255).collect();
        assert_eq!(from_hex(&to_hex(&bytes)), Some(bytes));
        assert_eq!(from_hex("0aF"), None);
        assert_eq!(from_hex("0x"), None);
        assert_eq!(from_hex("aFfa"), Some(vec![0xAF, 0xFA]));
    }
}
