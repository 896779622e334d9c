//! Hold and abort.

use crate::bytes::{Reader, Truncated};

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
