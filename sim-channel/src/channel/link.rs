//! One direction between two nodes, with its loss model and random streams; nodes that only disturb.

use super::ChannelConfig;
use crate::loss::{FrameContext, FrameFate, LinkLoss, LossModel};
use crate::nodes::NodeId;
use crate::random::RandomStream;
use std::time::Duration;

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

/// A node with Poisson traffic of random bytes, which other modems receive as noise.
///
/// ```
/// use sim_channel::{Channel, ChannelConfig, Duration, Interferer, NodeId, NodePosition};
///
/// let mut channel = Channel::new(ChannelConfig::default(), 1);
/// channel.place(NodeId(99), NodePosition::new(0.0, 500.0, 0.0));
/// let mut noise = Interferer::new(NodeId(99), 16, Duration::from_millis(200), Duration::from_secs(60), 1);
/// let at = noise.poll_timeout().unwrap();
/// let (bytes, airtime) = noise.poll_transmit(at).unwrap();
/// channel.transmit(noise.node(), bytes, airtime, at);
/// assert!(noise.poll_transmit(at).is_none() && noise.poll_timeout() > Some(at + airtime));
/// ```
///
/// [`Basin`](crate::modem::Basin) drives it. Without a basin, place its node and put its frames on air:
#[derive(Debug)]
pub struct Interferer {
    node: NodeId,
    bytes: usize,
    airtime: Duration,
    mean_gap: Duration,
    next: Duration,
    rng: RandomStream,
}

impl Interferer {
    /// An interferer at `node` whose frames of `bytes` random bytes take `airtime`, with `mean_gap` between them on average.
    #[must_use]
    pub fn new(node: NodeId, bytes: usize, airtime: Duration, mean_gap: Duration, seed: u64) -> Self {
        const PURPOSE: u64 = 0x7a1c;
        let rng = RandomStream::new(seed, &[PURPOSE, u64::from(node.0)]);
        let mut interferer = Self { node, bytes, airtime, mean_gap, next: Duration::ZERO, rng };
        interferer.schedule(Duration::ZERO);
        interferer
    }

    /// The node whose position it transmits from.
    #[must_use]
    pub fn node(&self) -> NodeId {
        self.node
    }

    /// Time of its next transmission; never `None`.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Duration> {
        Some(self.next)
    }

    /// Bytes and airtime of the transmission that is due by `now`; `None` before its time.
    #[must_use]
    pub fn poll_transmit(&mut self, now: Duration) -> Option<(Vec<u8>, Duration)> {
        if now < self.next {
            return None;
        }
        self.schedule(now.saturating_add(self.airtime));
        Some(((0..self.bytes).map(|_| self.rng.below(256) as u8).collect(), self.airtime))
    }

    fn schedule(&mut self, free: Duration) {
        let gap = self.rng.exponential(self.mean_gap.as_secs_f64());
        self.next = free.saturating_add(Duration::try_from_secs_f64(gap).unwrap_or(Duration::MAX));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn transmits_at_its_mean_rate_without_overlap() {
        let airtime = Duration::from_millis(500);
        let mut interferer = Interferer::new(NodeId(9), 16, airtime, Duration::from_secs(10), 1);
        let hour = Duration::from_secs(36_000);
        let mut times = Vec::new();
        while let Some(at) = interferer.poll_timeout().filter(|at| *at < hour) {
            let (bytes, _) = interferer.poll_transmit(at).expect("due");
            assert_eq!(bytes.len(), 16);
            times.push(at);
        }
        assert!(times.windows(2).all(|w| w[1] - w[0] >= airtime));
        let expected = 36_000.0 / 10.5;
        assert!((times.len() as f64 / expected - 1.0).abs() < 0.05, "{}", times.len());
    }
}
