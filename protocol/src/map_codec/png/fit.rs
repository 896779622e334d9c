//! The largest `png` chunk that fits.

use super::deflate::Deflater;
use super::{DeflateEffort, head, write};
use crate::map_codec::MapChunk;
use crate::map_codec::chunk::chunk;
use crate::map_codec::grow::Growth;
use crate::map_codec::lattice::Lattice;
use crate::map_codec::window::Patch;

/// The chunk of at most `room` bytes with the most changes along `growth`; `None` if not even its seed fits.
pub(in crate::map_codec) fn best_chunk(base: Lattice<'_>, growth: &Growth, room: usize) -> Option<MapChunk> {
    let mut fitter = Fitter { base, room, deflater: Deflater::new() };
    let patch_of = |i: usize| growth.window.patch(*growth.areas.get(i)?).trimmed();
    let mut best = patch_of(0)?;
    let (mut fitting, mut too_large, mut step) = (0, growth.areas.len(), 1);
    // Doubling steps, then bisection, because most rooms hold few changes.
    while fitting + 1 < too_large {
        let i = (fitting + step).min((fitting + too_large) / 2).max(fitting + 1);
        let patch = patch_of(i)?;
        if fitter.fits(&patch) {
            (best, fitting, step) = (patch, i, step * 2);
        } else {
            too_large = i;
        }
    }
    if too_large < growth.areas.len() {
        best = fitter.fill(best, &patch_of(too_large)?)?;
    }
    let bytes = write(&mut fitter.deflater, &head(base, best.rect), &best, DeflateEffort::Full);
    (bytes.len() <= room).then(|| chunk(&best, bytes))
}

/// The `png` chunk with the content of `chunk`, if it is shorter.
pub(in crate::map_codec) fn smaller(base: Lattice<'_>, other: &MapChunk) -> Option<MapChunk> {
    let patch = Patch::of(base, &other.changes)?;
    let bytes = write(&mut Deflater::new(), &head(base, patch.rect), &patch, DeflateEffort::Quick);
    (bytes.len() < other.bytes.len()).then(|| chunk(&patch, bytes))
}

struct Fitter<'a> {
    base: Lattice<'a>,
    room: usize,
    deflater: Deflater,
}

impl Fitter<'_> {
    fn fits(&mut self, patch: &Patch) -> bool {
        write(&mut self.deflater, &head(self.base, patch.rect), patch, DeflateEffort::Quick).len() <= self.room
    }

    /// `inner` with as many further changes of `outer` as fit.
    fn fill(&mut self, inner: Patch, outer: &Patch) -> Option<Patch> {
        let (mut fitting, mut too_many) = (0, outer.changes().len().saturating_sub(inner.changes().len()));
        let mut best = inner.clone();
        while fitting + 1 < too_many {
            let count = (fitting + too_many) / 2;
            let patch = outer.first_changes_beyond(&inner.rect, count).trimmed()?;
            if self.fits(&patch) {
                (best, fitting) = (patch, count);
            } else {
                too_many = count;
            }
        }
        Some(best)
    }
}
