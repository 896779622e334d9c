//! One direction between two nodes: its instance of the loss model and its own random streams.

use super::ChannelConfig;
use crate::loss::{FrameContext, FrameFate, LinkLoss, LossModel};
use crate::nodes::NodeId;
use crate::random::RandomStream;

/// The random draws for one transmission on one link, before collisions are known.
#[derive(Clone, Debug)]
pub(super) struct FrameDraws {
    pub fate: FrameFate,
    pub corrupted: bool,
    pub duplicated: bool,
    /// Whether the frame itself and its duplicate are handed over late.
    pub late: [bool; 2],
    /// The stream that chooses the bits to flip.
    pub flips: RandomStream,
}

#[derive(Debug)]
pub(super) struct DirectedLink {
    loss: Box<dyn LinkLoss>,
    loss_rng: RandomStream,
    fault_rng: RandomStream,
    flip_path: [u64; 3],
    seed: u64,
    frames: u64,
}

impl DirectedLink {
    pub(super) fn new(seed: u64, from: NodeId, to: NodeId, model: &LossModel) -> Self {
        let path = |purpose: u64| [u64::from(from.0), u64::from(to.0), purpose];
        let mut loss_rng = RandomStream::new(seed, &path(0));
        Self {
            loss: model.instance(&mut loss_rng),
            loss_rng,
            fault_rng: RandomStream::new(seed, &path(1)),
            flip_path: path(2),
            seed,
            frames: 0,
        }
    }

    /// Starts a new instance of `model`; the random streams of the link continue.
    pub(super) fn set_model(&mut self, model: &LossModel) {
        self.loss = model.instance(&mut self.loss_rng);
    }

    /// Draws the fate of one frame. The number of fault draws never depends on a probability, so that a changed
    /// probability does not shift later draws.
    pub(super) fn draw(&mut self, frame: &FrameContext, config: &ChannelConfig) -> FrameDraws {
        let [from, to, purpose] = self.flip_path;
        let flips = RandomStream::new(self.seed, &[from, to, purpose, self.frames]);
        self.frames += 1;
        FrameDraws {
            fate: self.loss.draw_fate(frame, &mut self.loss_rng),
            corrupted: self.fault_rng.bernoulli(config.corruption),
            duplicated: self.fault_rng.bernoulli(config.duplication),
            late: [self.fault_rng.bernoulli(config.reordering), self.fault_rng.bernoulli(config.reordering)],
            flips,
        }
    }
}

/// Flips one to eight bits at random places; false if `bytes` is empty.
pub(super) fn flip_bits(bytes: &mut [u8], rng: &mut RandomStream) -> bool {
    let flips = 1 + rng.below(8);
    let mut flipped = std::collections::BTreeSet::new();
    for _ in 0..flips {
        let bit = rng.below(bytes.len() * 8);
        if let Some(byte) = bytes.get_mut(bit / 8).filter(|_| flipped.insert(bit)) {
            *byte ^= 1 << (bit % 8);
        }
    }
    !flipped.is_empty()
}
