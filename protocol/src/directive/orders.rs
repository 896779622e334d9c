//! The bodies of the small orders: hold and abort, destination, fix, utility, bit budget, requests for exemplars.

use crate::bytes::{Reader, Truncated, decimetres, put24};
use crate::coordinates::{DecimetrePoint, WorldPoint};
use crate::schedule::{BackgroundOrder, Shares};
use std::collections::BTreeMap;

/// Orders that take effect at once. Their slot is one byte long, so it never waits behind a longer one.
///
/// ```text
/// byte 0: bit 7 hold, bit 6 abort; the rest reserved, 0, not read
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Constraints {
    /// Holds the position until a later version has `false` here.
    pub hold: bool,
    /// Stops the survey and starts the reaction of [`super::Limits::on_abort`]; overrides `hold`.
    pub abort: bool,
}

impl Constraints {
    /// Whether it stops the vehicle: a hold or an abort. Otherwise it only lifts one.
    pub fn stops(self) -> bool {
        self.hold || self.abort
    }

    pub(super) fn encode(&self, out: &mut Vec<u8>) {
        out.push(u8::from(self.hold) << 7 | u8::from(self.abort) << 6);
    }

    pub(super) fn decode(r: &mut Reader<'_>) -> Result<Self, Truncated> {
        let flags = r.u8()?;
        Ok(Self { hold: flags & 0x80 != 0, abort: flags & 0x40 != 0 })
    }
}

/// A place of the world frame to which the vehicle goes at once. There it resumes its survey. A hold, an abort, the
/// fence and the limits come before it.
///
/// ```text
/// byte  bits  field   unit, range
///  0-2  24    x east  decimetres, two's complement, within 838 860.7 m
///  3-5  24    y north decimetres, two's complement
/// ```
/// Without bytes, the order withdraws the destination.
///
/// Source: surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Destination {
    /// The place; `None` withdraws it.
    pub place: Option<DecimetrePoint>,
}

impl Destination {
    pub(super) fn encode(self, out: &mut Vec<u8>) {
        for coordinate in self.place.iter().flat_map(|place| [place.east_dm, place.north_dm]) {
            put24(out, coordinate as u32);
        }
    }

    pub(super) fn decode(r: &mut Reader<'_>) -> Result<Self, Truncated> {
        if r.rest().is_empty() {
            return Ok(Self::default());
        }
        Ok(Self { place: Some(DecimetrePoint::new(r.i24()?, r.i24()?)) })
    }
}

/// A measured position of the vehicle in the world frame, from GPS and USBL at the surface.
///
/// ```text
/// byte  field
///  0-2  x east, decimetres, signed
///  3-5  y north, decimetres, signed
///  6    standard deviation, quarter metres, 255 = 63.75 m or more
///  7-8  age when this frame left the surface, hundredths of a second, 65535 = 655 s or more
/// ```
///
/// The age is written at the moment of transmission, so the clocks of the two ends need not agree.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Fix {
    /// The measured position, in steps of a decimetre.
    pub position: WorldPoint,
    /// Standard deviation in metres, in steps of 0.25 m.
    pub sigma_m: f64,
    /// Age at transmission in seconds.
    pub age_s: f64,
}

impl Fix {
    pub(super) fn encode(&self, out: &mut Vec<u8>) {
        put24(out, decimetres(self.position.east_m) as u32);
        put24(out, decimetres(self.position.north_m) as u32);
        out.push((self.sigma_m * 4.0).round().clamp(0.0, 255.0) as u8);
        out.extend_from_slice(&((self.age_s * 100.0).round().clamp(0.0, 65_535.0) as u16).to_be_bytes());
    }

    pub(super) fn decode(r: &mut Reader<'_>) -> Result<Self, Truncated> {
        Ok(Self {
            position: WorldPoint { east_m: f64::from(r.i24()?) / 10.0, north_m: f64::from(r.i24()?) / 10.0 },
            sigma_m: f64::from(r.u8()?) / 4.0,
            age_s: f64::from(r.u16()?) / 100.0,
        })
    }
}

/// The operator's weights: the value of one more look at a cell of each label.
///
/// ```text
/// byte  field
///  0    label epoch
///  1    weight of unseen cells, hundredths, signed, -100..=100
///  2    weight of perplexity, hundredths, signed, -100..=100
///  3..  pairs: label 1..=254, weight in hundredths, signed, -100..=100; a label not named weighs 0
/// ```
///
/// ```
/// use scenecast_protocol::directive::Utility;
///
/// let utility = Utility { exploration: 20, weights: [(3, 80), (5, -20)].into(), ..Utility::default() };
/// assert_eq!((utility.weight(3), utility.weight(5), utility.weight(9)), (0.8, -0.2, 0.0));
/// assert!(utility.is_in_range());
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Utility {
    /// The epoch of the label ids.
    pub epoch: u8,
    /// Weight of unexplored cells in hundredths, -100..=100.
    pub exploration: i8,
    /// Weight of perplexity in hundredths, -100..=100.
    pub curiosity: i8,
    /// Weights by label in hundredths, -100..=100; a missing label has weight 0.
    pub weights: BTreeMap<u8, i8>,
}

impl Utility {
    /// The weight of a label in -1..=1.
    pub fn weight(&self, label: u8) -> f64 {
        self.weights.get(&label).map_or(0.0, |&w| f64::from(w) / 100.0)
    }

    /// Whether every weight lies in -100..=100 and every label in 1..=254.
    pub fn is_in_range(&self) -> bool {
        let ok = |w: i8| (-100..=100).contains(&w);
        ok(self.exploration)
            && ok(self.curiosity)
            && self.weights.iter().all(|(&l, &w)| (1..=254).contains(&l) && ok(w))
    }

    pub(super) fn encode(&self, out: &mut Vec<u8>) {
        out.extend_from_slice(&[self.epoch, self.exploration as u8, self.curiosity as u8]);
        out.extend(self.weights.iter().flat_map(|(&l, &w)| [l, w as u8]));
    }

    pub(super) fn decode(r: &mut Reader<'_>) -> Result<Self, Truncated> {
        let mut utility = Self { epoch: r.u8()?, exploration: r.i8()?, curiosity: r.i8()?, weights: BTreeMap::new() };
        while !r.rest().is_empty() {
            utility.weights.insert(r.u8()?, r.i8()?);
        }
        Ok(utility)
    }
}

/// The bits that the vehicle may put on air, and their distribution over the classes.
///
/// ```text
/// bytes 0-2: budget in bits a second, 1..=16 777 215
/// bytes 3-7: least shares in percent of directive, status, fix, map, exemplar; together at most 100
/// bytes 8...: order of the background streams, see [`BackgroundOrder`]
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Budget {
    /// Bits a second over the vehicle's budget window.
    pub bits_per_s: u32,
    /// Least share of each class while it has something to send.
    pub shares: Shares,
    /// Order of the background streams.
    pub background: BackgroundOrder,
}

impl Budget {
    pub(super) fn encode(&self, out: &mut Vec<u8>) {
        put24(out, self.bits_per_s.min(0xFF_FFFF));
        out.extend_from_slice(&self.shares.0);
        out.extend(self.background.to_bytes());
    }

    pub(super) fn decode(r: &mut Reader<'_>) -> Result<Self, Truncated> {
        let bits_per_s = r.u24()?;
        let mut shares = [0; 5];
        for share in &mut shares {
            *share = r.u8()?;
        }
        let background = BackgroundOrder::from_bytes(r.take(r.rest().len())?).ok_or(Truncated)?;
        Ok(Self { bits_per_s, shares: Shares(shares), background })
    }
}

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
    use crate::directive::{Slot, SlotId, VersionedSlot};

    #[test]
    fn golden_bytes_of_a_destination() {
        let place = Some(DecimetrePoint::new(-3, 1200));
        for (destination, bytes) in [
            (Destination { place }, &[0x01, 0, 7, 0xFF, 0xFF, 0xFD, 0, 4, 0xB0][..]),
            (Destination::default(), &[0x01, 0, 7]),
        ] {
            let slot = Slot::Destination(destination);
            assert_eq!(VersionedSlot::encode(7, &slot), bytes);
            let back = VersionedSlot { id: SlotId::Destination, version: 7, content: Some(slot) };
            assert_eq!(VersionedSlot::decode(bytes), Ok(back));
        }
        let short = VersionedSlot::decode(&[0x01, 0, 7, 1, 2, 3]).map(|slot| slot.content);
        assert_eq!(short, Ok(None), "refused by its name");
    }

    #[test]
    fn a_fix_takes_nine_bytes_and_comes_back() {
        let fix = Fix { position: WorldPoint::new(-12.3, 400.0), sigma_m: 1.5, age_s: 0.82 };
        let mut bytes = Vec::new();
        fix.encode(&mut bytes);
        assert_eq!(bytes, [0xFF, 0xFF, 0x85, 0, 0x0F, 0xA0, 6, 0, 82]);
        assert_eq!(Fix::decode(&mut Reader::new(&bytes)), Ok(fix));
    }

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
