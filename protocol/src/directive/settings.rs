//! Short slots that set how a vehicle behaves.

use crate::bytes::{Reader, Truncated};
use crate::schedule::{BackgroundOrder, Shares};

/// Orders that never wait for anything longer.
///
/// ```text
/// byte 0: bit 7 hold, bit 6 abort; the rest reserved, 0, not read
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Constraints {
    /// Stay where you are, until told to go on.
    pub hold: bool,
    /// Stop the survey and do what is set for an abort ([`super::Limits::on_abort`]); goes before `hold`.
    pub abort: bool,
}

impl Constraints {
    pub(super) fn encode(&self, out: &mut Vec<u8>) {
        out.push(u8::from(self.hold) << 7 | u8::from(self.abort) << 6);
    }

    pub(super) fn decode(r: &mut Reader<'_>) -> Result<Self, Truncated> {
        let flags = r.u8()?;
        Ok(Self { hold: flags & 0x80 != 0, abort: flags & 0x40 != 0 })
    }
}

/// How the vehicle chooses its way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlannerKind {
    /// Parallel legs over the whole survey.
    Lawnmower,
    /// The place of the best gain a metre, again and again.
    Greedy,
    /// The best way over all that is left of distance and time.
    Horizon,
}

impl PlannerKind {
    /// Every planner, in wire order.
    pub const ALL: [Self; 3] = [Self::Lawnmower, Self::Greedy, Self::Horizon];

    /// Name in files and in the API.
    pub fn name(self) -> &'static str {
        match self {
            Self::Lawnmower => "lawnmower",
            Self::Greedy => "greedy",
            Self::Horizon => "horizon",
        }
    }

    /// The planner of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|p| p.name() == name)
    }
}

/// Bits that the vehicle may put on air, and on what.
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
        out.extend_from_slice(self.bits_per_s.min(0xFF_FFFF).to_be_bytes().get(1..).unwrap_or_default());
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
