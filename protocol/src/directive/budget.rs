//! The bit budget of the vehicle, and how its classes share it.

use crate::bytes::{Reader, Truncated, put24};
use crate::schedule::{BackgroundOrder, Shares};

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
