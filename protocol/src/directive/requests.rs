//! Requests for exemplars.

use crate::bytes::{Reader, Truncated};

/// A request for an exemplar of a label.
///
/// ```text
/// byte 0: label, 1..=254
/// byte 1: serial number of the request, 1..=255; a label's next request has another one
/// byte 2: bits 7-6 size: an edge of 64 << size pixels; bits 5-0 picture: 0 the best one that the surface does not have, or
///         the number of one that it has
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ExemplarRequest {
    /// The label that the exemplar should show, 1..=254.
    pub label: u8,
    /// Serial number of the request, 1..=255.
    pub serial: u8,
    /// The largest edge is 64 << `size` pixels; 0..=3.
    pub size: u8,
    /// The number of the exemplar, at most [`ExemplarRequest::MAX_PICTURE`]; 0 is the best one that
    /// the surface does not have.
    pub picture: u8,
}

impl ExemplarRequest {
    /// The highest number of an exemplar.
    pub const MAX_PICTURE: u8 = 63;
}

/// The exemplars that the operator still requests. The vehicle stops sending the others.
///
/// ```text
/// byte 0: label epoch; then each request, 3 bytes
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ExemplarRequests {
    /// The epoch of the label ids.
    pub epoch: u8,
    /// The requests, in the order in which they are served.
    pub wanted: Vec<ExemplarRequest>,
}

impl ExemplarRequests {
    pub(super) fn encode(&self, out: &mut Vec<u8>) {
        out.push(self.epoch);
        let bytes = |r: &ExemplarRequest| [r.label, r.serial, r.size << 6 | r.picture & ExemplarRequest::MAX_PICTURE];
        out.extend(self.wanted.iter().flat_map(bytes));
    }

    pub(super) fn decode(r: &mut Reader<'_>) -> Result<Self, Truncated> {
        let mut requests = Self { epoch: r.u8()?, wanted: Vec::new() };
        while !r.rest().is_empty() {
            let (label, serial, what) = (r.u8()?, r.u8()?, r.u8()?);
            requests.wanted.push(ExemplarRequest {
                label,
                serial,
                size: what >> 6,
                picture: what & ExemplarRequest::MAX_PICTURE,
            });
        }
        Ok(requests)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn golden_bytes_of_requests() {
        let first = ExemplarRequest { label: 3, serial: 2, ..ExemplarRequest::default() };
        let larger = ExemplarRequest { label: 5, serial: 1, size: 1, picture: 9 };
        let requests = ExemplarRequests { epoch: 1, wanted: vec![first, larger] };
        let mut bytes = Vec::new();
        requests.encode(&mut bytes);
        assert_eq!(bytes, [1, 3, 2, 0x00, 5, 1, 0x49]);
        assert_eq!(ExemplarRequests::decode(&mut Reader::new(&bytes)), Ok(requests));
        assert!(ExemplarRequests::decode(&mut Reader::new(&bytes[..3])).is_err(), "half a request");
    }
}
