//! The slots that set how a vehicle behaves.

use crate::schedule::Shares;
use crate::wire::{Reader, Truncated};

/// Where and how the vehicle may move.
///
/// ```text
/// byte 0: bit 7 hold; the rest reserved, 0
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Constraints {
    /// Stay where you are.
    pub hold: bool,
}

impl Constraints {
    pub(super) fn encode(&self, out: &mut Vec<u8>) {
        out.push(u8::from(self.hold) << 7);
    }

    pub(super) fn decode(r: &mut Reader<'_>) -> Result<Self, Truncated> {
        Ok(Self { hold: r.u8()? & 0x80 != 0 })
    }
}

/// How the vehicle builds its map.
///
/// ```text
/// bytes 0-3: word refinements a second of mission time, 0 = as configured on the vehicle
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Settings {
    /// Words resampled a second of mission time.
    pub refine_words_per_s: u32,
}

impl Settings {
    pub(super) fn encode(&self, out: &mut Vec<u8>) {
        out.extend_from_slice(&self.refine_words_per_s.to_be_bytes());
    }

    pub(super) fn decode(r: &mut Reader<'_>) -> Result<Self, Truncated> {
        Ok(Self { refine_words_per_s: r.u32()? })
    }
}

/// Bits that the vehicle may put on air, and on what.
///
/// ```text
/// bytes 0-2: budget in bits a second, 1..=16 777 215
/// bytes 3-7: least shares in percent of directive, status, fix, map, exemplar; together at most 100
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Budget {
    /// Bits a second over the vehicle's budget window.
    pub bits_per_s: u32,
    /// Least share of each class while it has something to send.
    pub shares: Shares,
}

impl Budget {
    pub(super) fn encode(&self, out: &mut Vec<u8>) {
        out.extend_from_slice(self.bits_per_s.min(0xFF_FFFF).to_be_bytes().get(1..).unwrap_or_default());
        out.extend_from_slice(&self.shares.0);
    }

    pub(super) fn decode(r: &mut Reader<'_>) -> Result<Self, Truncated> {
        let bits_per_s = r.u24()?;
        let mut shares = [0; 5];
        for share in &mut shares {
            *share = r.u8()?;
        }
        Ok(Self { bits_per_s, shares: Shares(shares) })
    }
}

/// Labels whose representative images the operator still wants.
///
/// ```text
/// byte 0: label epoch; then pairs: label 1..=254, serial number of the request for it (a new number asks for another image)
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Requests {
    /// Epoch of the label ids.
    pub epoch: u8,
    /// Label and serial number of the request.
    pub wanted: Vec<(u8, u8)>,
}

impl Requests {
    pub(super) fn encode(&self, out: &mut Vec<u8>) {
        out.push(self.epoch);
        out.extend(self.wanted.iter().flat_map(|&(label, serial)| [label, serial]));
    }

    pub(super) fn decode(r: &mut Reader<'_>) -> Result<Self, Truncated> {
        let mut requests = Self { epoch: r.u8()?, wanted: Vec::new() };
        while !r.rest().is_empty() {
            requests.wanted.push((r.u8()?, r.u8()?));
        }
        Ok(requests)
    }
}
