//! Items on a stream of bytes: a header line, then the picture.

use crate::header::Header;
use crate::{Item, MAX_HEADER_BYTES, Refusal};

/// Takes the bytes of a connection and yields its items.
///
/// Each item is a JSON object on one line, and after its line feed exactly as many bytes of a picture as its member `bytes`
/// names. Empty lines are skipped. A header that cannot be read leaves no way to know where the next item begins, so
/// the stream ends with it; a picture that is refused does not.
#[derive(Debug, Default)]
pub struct Stream {
    /// Bytes of the header, or of the picture after it.
    bytes: Vec<u8>,
    header: Option<(Header, usize)>,
    is_over: bool,
}

impl Stream {
    /// Whether a header was refused, so that no further byte is read.
    pub fn is_over(&self) -> bool {
        self.is_over
    }

    /// Takes bytes; calls `each` for every item that is complete with them, or for its refusal.
    pub fn push(&mut self, mut bytes: &[u8], mut each: impl FnMut(Result<Item, Refusal>)) {
        while !self.is_over && !bytes.is_empty() {
            let done = match &self.header {
                None => self.take_header(&mut bytes),
                Some((_, length)) => {
                    let missing = length - self.bytes.len();
                    let (now, rest) = bytes.split_at(missing.min(bytes.len()));
                    self.bytes.extend_from_slice(now);
                    bytes = rest;
                    Ok(now.len() == missing)
                }
            };
            match done {
                Ok(false) => {}
                Ok(true) => {
                    let picture = std::mem::take(&mut self.bytes);
                    if let Some((header, _)) = self.header.take() {
                        each(header.into_item(&picture));
                    }
                }
                Err(why) => {
                    self.is_over = true;
                    each(Err(why));
                }
            }
        }
    }

    /// The connection has ended; the refusal of an item that is not complete.
    pub fn finish(self) -> Option<Refusal> {
        let length = match &self.header {
            _ if self.is_over => return None,
            Some((_, length)) => *length,
            None => self.bytes.len(),
        };
        let is_cut = self.header.is_some() || !self.bytes.trim_ascii().is_empty();
        is_cut.then_some(Refusal::CutOff(self.bytes.len(), length))
    }

    /// Takes bytes up to the end of the header's line; returns whether the item is complete with it.
    fn take_header(&mut self, bytes: &mut &[u8]) -> Result<bool, Refusal> {
        let end = bytes.iter().position(|&b| b == b'\n');
        let (line, rest) = bytes.split_at(end.unwrap_or(bytes.len()));
        if self.bytes.len() + line.len() > MAX_HEADER_BYTES {
            return Err(Refusal::LongHeader);
        }
        self.bytes.extend_from_slice(line);
        *bytes = rest.get(1..).unwrap_or(&[]);
        if end.is_none() {
            return Ok(false);
        }
        let line = std::mem::take(&mut self.bytes);
        if line.trim_ascii().is_empty() {
            return Ok(false);
        }
        let header = Header::read(line.trim_ascii())?;
        let length = header.picture_bytes()?;
        self.header = Some((header, length));
        Ok(length == 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Content;
    use proptest::prelude::*;

    const GRID: &str =
        r#"{"kind":"grid","west_m":0,"south_m":0,"cell_m":1,"encoding":"raw","width":3,"height":1,"bytes":3}"#;

    fn sent() -> Vec<u8> {
        let mut bytes = b"\n{\"kind\":\"classes\",\"classes\":[{\"class\":1,\"name\":\"rock\"}]}\r\n".to_vec();
        for value in [b'\n', 254, 7] {
            bytes.extend_from_slice(GRID.as_bytes());
            bytes.extend_from_slice(&[b'\n', value, 1, b'{']);
        }
        bytes
    }

    #[test]
    fn a_bad_header_ends_the_stream_and_is_named() {
        let mut stream = Stream::default();
        let mut found = Vec::new();
        stream.push(b"hello\n", |item| found.push(item));
        stream.push(&sent(), |item| found.push(item));
        assert!(stream.is_over() && found.len() == 1);
        assert!(found[0].as_ref().unwrap_err().to_string().starts_with("the header: expected value"));
        let mut long = Stream::default();
        long.push(&vec![b' '; MAX_HEADER_BYTES], |_| panic!("it may still end"));
        long.push(b" ", |item| found.push(item));
        assert_eq!(found[1], Err(Refusal::LongHeader));
        let mut claims = Stream::default();
        claims.push(br#"{"kind":"grid","bytes":99999999999}"#, |_| panic!("no line feed yet"));
        claims.push(b"\n", |item| found.push(item));
        assert_eq!(found[2], Err(Refusal::PictureBytes(99_999_999_999)));
    }

    #[test]
    fn a_connection_that_ends_inside_of_an_item_is_named() {
        let bytes = sent();
        let cut = |length: usize| {
            let mut stream = Stream::default();
            stream.push(&bytes[..length], |_| {});
            stream.finish()
        };
        assert_eq!((cut(bytes.len()), cut(bytes.len() - 1)), (None, Some(Refusal::CutOff(2, 3))));
        assert_eq!((cut(0), cut(1), cut(2)), (None, None, Some(Refusal::CutOff(1, 1))));
    }

    proptest! {
        #[test]
        fn items_come_back_from_pieces_of_any_size(pieces in proptest::collection::vec(1usize..50, 1..200)) {
            let bytes = sent();
            let (mut stream, mut found, mut at) = (Stream::default(), Vec::new(), 0);
            for piece in pieces.into_iter().chain([bytes.len()]) {
                let end = (at + piece).min(bytes.len());
                stream.push(&bytes[at..end], |item| found.push(item));
                at = end;
            }
            prop_assert_eq!(found.len(), 4);
            let is_named = matches!(found[0], Ok(Item { content: Content::Classes, .. }));
            prop_assert!(is_named);
            prop_assert_eq!(found[2].clone(), Err(Refusal::Class(254)));
            prop_assert!(found[1].is_ok() && found[3].is_ok());
        }

        #[test]
        fn any_bytes_are_accepted(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
            let mut stream = Stream::default();
            stream.push(&bytes, |_| {});
            let _ = stream.finish();
        }
    }
}
