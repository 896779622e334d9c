//! One direction between two nodes: its loss model instance and its own chance.

use super::ChannelConfig;
use crate::loss::LossModel;
use crate::loss::{Frame, LinkLoss, Verdict};
use crate::nodes::NodeId;
use crate::random::Stream;

/// What was drawn for one transmission on one link, before collisions are known.
#[derive(Clone, Debug)]
pub(super) struct Draws {
    pub verdict: Verdict,
    pub corrupted: bool,
    pub duplicated: bool,
    /// Whether the frame itself and its duplicate are handed over late.
    pub late: [bool; 2],
    /// Chooses the bits to flip.
    pub flips: Stream,
}

#[derive(Debug)]
pub(super) struct Link {
    loss: Box<dyn LinkLoss>,
    loss_chance: Stream,
    fault_chance: Stream,
    flip_path: [u64; 3],
    seed: u64,
    frames: u64,
}

impl Link {
    pub(super) fn new(seed: u64, from: NodeId, to: NodeId, model: &LossModel) -> Self {
        let path = |purpose: u64| [u64::from(from.0), u64::from(to.0), purpose];
        let mut loss_chance = Stream::new(seed, &path(0));
        Self {
            loss: model.instance(&mut loss_chance),
            loss_chance,
            fault_chance: Stream::new(seed, &path(1)),
            flip_path: path(2),
            seed,
            frames: 0,
        }
    }

    /// Starts a new instance of `model`; the link's chance runs on.
    pub(super) fn set_model(&mut self, model: &LossModel) {
        self.loss = model.instance(&mut self.loss_chance);
    }

    /// Draws the fate of one frame: always the same number of fault draws, so that a changed probability shifts nothing.
    pub(super) fn draw(&mut self, frame: &Frame, config: &ChannelConfig) -> Draws {
        let [from, to, purpose] = self.flip_path;
        let flips = Stream::new(self.seed, &[from, to, purpose, self.frames]);
        self.frames += 1;
        Draws {
            verdict: self.loss.judge(frame, &mut self.loss_chance),
            corrupted: self.fault_chance.chance(config.corruption),
            duplicated: self.fault_chance.chance(config.duplication),
            late: [self.fault_chance.chance(config.reordering), self.fault_chance.chance(config.reordering)],
            flips,
        }
    }
}

/// Flips one to eight bits at random places; false if there is nothing to flip.
pub(super) fn flip_bits(bytes: &mut [u8], chance: &mut Stream) -> bool {
    let flips = 1 + chance.below(8);
    let mut flipped = std::collections::BTreeSet::new();
    for _ in 0..flips {
        let bit = chance.below(bytes.len() * 8);
        if let Some(byte) = bytes.get_mut(bit / 8).filter(|_| flipped.insert(bit)) {
            *byte ^= 1 << (bit % 8);
        }
    }
    !flipped.is_empty()
}
