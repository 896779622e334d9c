//! The images that the operator wants.

use crate::bytes::{Reader, Truncated};

/// A request for an image of a label.
///
/// ```text
/// byte 0: label, 1..=254
/// byte 1: serial number of the request, 1..=255; a label's next request has another one
/// byte 2: bits 7-6 size: an edge of 64 << size pixels; bits 5-0 picture: 0 the best one that the surface has not, or the
///         number of one that it has
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Request {
    /// Label.
    pub label: u8,
    /// Serial number of the request.
    pub serial: u8,
    /// Largest edge, 64 << `size` pixels; 0..=3.
    pub size: u8,
    /// Which picture; 0: the best one that the surface has not; at most [`Request::MOST_PICTURE`].
    pub picture: u8,
}

impl Request {
    /// The highest number of a picture.
    pub const MOST_PICTURE: u8 = 63;
}

/// The images that the operator still wants; what is not named any more is not sent to its end.
///
/// ```text
/// byte 0: label epoch; then each request, 3 bytes
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Requests {
    /// Epoch of the label ids.
    pub epoch: u8,
    /// What is wanted.
    pub wanted: Vec<Request>,
}

impl Requests {
    pub(super) fn encode(&self, out: &mut Vec<u8>) {
        out.push(self.epoch);
        let bytes = |r: &Request| [r.label, r.serial, r.size << 6 | r.picture & Request::MOST_PICTURE];
        out.extend(self.wanted.iter().flat_map(bytes));
    }

    pub(super) fn decode(r: &mut Reader<'_>) -> Result<Self, Truncated> {
        let mut requests = Self { epoch: r.u8()?, wanted: Vec::new() };
        while !r.rest().is_empty() {
            let (label, serial, what) = (r.u8()?, r.u8()?, r.u8()?);
            requests.wanted.push(Request { label, serial, size: what >> 6, picture: what & Request::MOST_PICTURE });
        }
        Ok(requests)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn golden_bytes_of_requests() {
        let first = Request { label: 3, serial: 2, ..Request::default() };
        let larger = Request { label: 5, serial: 1, size: 1, picture: 9 };
        let requests = Requests { epoch: 1, wanted: vec![first, larger] };
        let mut bytes = Vec::new();
        requests.encode(&mut bytes);
        assert_eq!(bytes, [1, 3, 2, 0x00, 5, 1, 0x49]);
        assert_eq!(Requests::decode(&mut Reader::new(&bytes)), Ok(requests));
        assert!(Requests::decode(&mut Reader::new(&bytes[..3])).is_err(), "half a request");
    }
}
