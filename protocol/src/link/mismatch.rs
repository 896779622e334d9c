//! Settings in which the other end differs, so that its frames are refused.

use crate::wire::WIRE_VERSION;
use std::collections::BTreeSet;

/// A setting in which the other end differs. It is found in a frame with a valid CRC or tag, apart from [`Self::Tag`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, thiserror::Error)]
pub enum Mismatch {
    /// The other end has this wire version.
    #[error("it has wire version {0}, this end has {WIRE_VERSION}: install the same release at both ends")]
    Version(u8),
    /// Its frames have no tag, and this end has a key.
    #[error("its frames have no tag: set the same link.key_file and link.authenticate at both ends")]
    NoTag,
    /// Its frames have a tag, and this end expects none.
    #[error(
        "its frames have a tag and none is expected: set the same link.key_file and link.authenticate at both ends"
    )]
    Tag,
}

/// Reports each mismatch once, so that no stranger can fill a log with them.
#[derive(Debug, Default)]
pub(super) struct MismatchReport {
    found: Option<Mismatch>,
    /// The last one since a frame was accepted.
    current: Option<Mismatch>,
    reported: BTreeSet<Mismatch>,
    /// Frames with an unexpected tag, which may also be damaged frames, since the last accepted one.
    tagged: u32,
}

impl MismatchReport {
    /// Frames with an unexpected tag after which the other end is taken to write tags.
    const MIN_TAGGED: u32 = 3;

    pub(super) fn note(&mut self, mismatch: Mismatch) {
        self.tagged += u32::from(mismatch == Mismatch::Tag);
        let is_certain = mismatch != Mismatch::Tag || self.tagged >= Self::MIN_TAGGED;
        if is_certain {
            self.current = Some(mismatch);
        }
        if is_certain && self.reported.insert(mismatch) {
            self.found = Some(mismatch);
        }
    }

    pub(super) fn handle_accepted(&mut self) {
        (self.tagged, self.current) = (0, None);
    }

    pub(super) fn current(&self) -> Option<Mismatch> {
        self.current
    }

    pub(super) fn poll(&mut self) -> Option<Mismatch> {
        self.found.take()
    }
}
