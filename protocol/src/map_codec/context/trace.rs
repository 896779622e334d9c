//! The decisions of a chunk, for whoever writes another decoder and looks for the first one that differs.

use super::arith::{BitCoder, Decoder};
use super::stage::{Contexts, StageLayout};
use super::{LastRow, read_cells};
use crate::bytes::BitReader;
use crate::grid::{Cell, Rect};
use crate::map_codec::DecodeError;
use crate::map_codec::lattice::Lattice;

/// One decision of the `context` coder, with the names and the order of `WIRE.md`, appendix A.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Decision {
    /// The cell that it is about, in steps of the chunk's stride.
    pub cell: Cell,
    /// `calm`, `flip`, `unseen`, `label`, `cleared`, `group` or `bit`; the last three have no contexts.
    pub kind: &'static str,
    /// The values of the direct contexts.
    pub direct: Vec<usize>,
    /// The keys and start values of the keyed contexts.
    pub keyed: Vec<(u32, usize)>,
    /// For each mixer, the number of its set of weights; empty without contexts.
    pub sets: Vec<usize>,
    /// The number of the adaptive probability map; 0 without contexts.
    pub curve: usize,
    /// The probability of yes in 1/65536.
    pub one: u32,
    /// Whether the decision is yes.
    pub is_yes: bool,
}

/// The decisions in the body of a chunk for `rect`.
pub(in super::super) fn trace(
    mut bits: BitReader<'_>,
    base: Lattice<'_>,
    rect: Rect,
) -> Result<Vec<Decision>, DecodeError> {
    let last = LastRow::read(rect.width as usize, &mut bits)?;
    let mut coder = Traced { decoder: Decoder::new(bits), origin: rect, next: None, decisions: Vec::new() };
    read_cells(&mut coder, base, rect, last)?;
    Ok(coder.decisions)
}

struct Traced<'a> {
    decoder: Decoder<'a>,
    origin: Rect,
    next: Option<Decision>,
    decisions: Vec<Decision>,
}

impl BitCoder for Traced<'_> {
    fn code(&mut self, bit: bool, one: u32) -> bool {
        let is_yes = self.decoder.code(bit, one);
        let next = self.next.clone();
        self.decisions.extend(next.map(|decision| Decision { one, is_yes, ..decision }));
        is_yes
    }

    fn begin_cell(&mut self, (column, row): (usize, usize)) {
        let cell = Cell::new(self.origin.x + column as i32, self.origin.y + row as i32);
        let (direct, keyed, sets) = (Vec::new(), Vec::new(), Vec::new());
        self.next = Some(Decision { cell, kind: "", direct, keyed, sets, curve: 0, one: 0, is_yes: false });
    }

    fn begin(&mut self, kind: &'static str, contexts: Option<(&StageLayout, &Contexts)>) {
        let Some(next) = &mut self.next else { return };
        next.kind = kind;
        next.direct =
            contexts.map_or_else(Vec::new, |(of, c)| c.direct.iter().copied().take(of.direct.len()).collect());
        next.keyed = contexts.map_or_else(Vec::new, |(of, c)| c.keyed.iter().copied().take(of.keyed.len()).collect());
        next.sets = contexts.map_or_else(Vec::new, |(_, c)| c.sets.to_vec());
        next.curve = contexts.map_or(0, |(_, c)| c.apm);
    }
}
