//! The parameters of the `context` coder: its start state, trained on procedural maps and shipped with the program.

use super::decisions;
use super::stage::{self, BitEstimate, SETS, StageLayout, StagePrior, stored_logit};
use std::sync::LazyLock;

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Prior {
    pub(super) calm: StagePrior,
    pub(super) flip: StagePrior,
    pub(super) unseen: StagePrior,
    pub(super) label: StagePrior,
}

/// Written by `scenecast-bench train-prior --seed 1 --out prior.bin`. It is part of the wire format:
/// another table makes another coder.
const TABLE: &[u8] = include_bytes!("prior.bin");

static SHIPPED: LazyLock<Prior> = LazyLock::new(|| Prior::from_bytes(TABLE).unwrap_or_else(Prior::blank));

/// Weights are stored in 1/2^12.
const WEIGHT_SHIFT: u32 = 4;

impl Prior {
    /// The prior that both ends share.
    pub(super) fn shipped() -> &'static Self {
        &SHIPPED
    }

    /// A prior without knowledge: every probability is one half.
    pub(super) fn blank() -> Self {
        Self {
            calm: decisions::CALM_LAYOUT.blank(),
            flip: decisions::FLIP_LAYOUT.blank(),
            unseen: decisions::UNSEEN_LAYOUT.blank(),
            label: decisions::LABEL_LAYOUT.blank(),
        }
    }

    /// Reads a table; `None` if it has another layout.
    ///
    /// ```text
    ///      for calm, flip, unseen, label:  estimates x (logit i16, visits u16), weights x i16 / 2^12, maps x logit i16
    /// ```
    /// Little-endian; logits in 1/256 of a factor of two.
    pub(super) fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let mut reader = TableReader(bytes);
        let prior = Self {
            calm: reader.stage(&decisions::CALM_LAYOUT)?,
            flip: reader.stage(&decisions::FLIP_LAYOUT)?,
            unseen: reader.stage(&decisions::UNSEEN_LAYOUT)?,
            label: reader.stage(&decisions::LABEL_LAYOUT)?,
        };
        reader.0.is_empty().then_some(prior)
    }

    /// The table that [`Prior::from_bytes`] reads.
    pub(super) fn to_bytes(&self) -> Vec<u8> {
        let mut out = Vec::new();
        let stages = [&self.calm, &self.flip, &self.unseen, &self.label];
        let layouts =
            [&decisions::CALM_LAYOUT, &decisions::FLIP_LAYOUT, &decisions::UNSEEN_LAYOUT, &decisions::LABEL_LAYOUT];
        for (stage, layout) in stages.into_iter().zip(layouts) {
            for slot in &stage.slots {
                out.extend(stored_logit(slot.p).to_le_bytes());
                out.extend(slot.visits.to_le_bytes());
            }
            let used = stage.weights.iter().flat_map(|row| row.iter().take(layout.inputs()));
            for weight in used.chain(stage.second.iter().flatten()) {
                let weight = (weight >> WEIGHT_SHIFT).clamp(i16::MIN.into(), i16::MAX.into()) as i16;
                out.extend(weight.to_le_bytes());
            }
            for &point in &stage.apms {
                out.extend(stored_logit(point).to_le_bytes());
            }
        }
        out
    }
}

struct TableReader<'a>(&'a [u8]);

impl TableReader<'_> {
    fn stage(&mut self, layout: &StageLayout) -> Option<StagePrior> {
        let slots = (0..layout.slots()).map(|_| Some(BitEstimate { p: self.probability()?, visits: self.visits()? }));
        let slots = slots.collect::<Option<_>>()?;
        let weights = (0..layout.rows()).map(|_| self.row(layout.inputs()));
        let weights = weights.collect::<Option<_>>()?;
        let second = (0..layout.apms).map(|_| self.row(SETS)).collect::<Option<_>>()?;
        let apms = (0..layout.apm_points()).map(|_| self.probability()).collect::<Option<_>>()?;
        Some(StagePrior { slots, weights, second, apms })
    }

    fn row<const N: usize>(&mut self, used: usize) -> Option<[i32; N]> {
        let mut row = [0; N];
        for weight in row.iter_mut().take(used) {
            *weight = i32::from(self.number()?) << WEIGHT_SHIFT;
        }
        Some(row)
    }

    fn probability(&mut self) -> Option<u32> {
        Some(stage::probability(i32::from(self.number()?)) << 16 | 0x8000)
    }

    fn number(&mut self) -> Option<i16> {
        let (number, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(i16::from_le_bytes(*number))
    }

    fn visits(&mut self) -> Option<u16> {
        let (number, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(u16::from_le_bytes(*number).min(BitEstimate::MAX_VISITS))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shipped_table_fits_the_layout() {
        let prior = Prior::from_bytes(TABLE).expect("a table of this layout");
        assert_eq!(prior.to_bytes().len(), TABLE.len());
        assert!(Prior::from_bytes(&TABLE[1..]).is_none());
    }
}
