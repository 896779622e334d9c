//! Loss models of directed links.
//!
//! A [`LossModel`] is a description. Each directed link runs an instance of its own, which holds the state of the model.

mod bursts;
mod measured;
mod snr;
mod trace;

pub use bursts::{GilbertElliott, ThreeState};
pub use measured::{FitError, FittedLink, RangeTable, RangeTableError};
pub use snr::Snr;
pub use trace::{Replayed, Trace, TraceError};

use crate::random::RandomStream;
use std::fmt::Debug;
use std::time::Duration;

/// A description of loss, of which each directed link runs its own instance.
///
/// ```
/// use sim_channel::loss::{RangeTable, Snr};
/// use sim_channel::{ChannelConfig, LossModel};
///
/// let half = LossModel::Independent { probability: 0.5 };
/// let sonar = LossModel::from(Snr::default());
/// let measured = LossModel::from(RangeTable::from_csv("500 0.95\n2000 0.4").unwrap());
/// let config = ChannelConfig { loss: measured, ..ChannelConfig::default() };
/// assert!(half != sonar && config.loss != half);
/// ```
#[derive(Clone, PartialEq, Debug, Default)]
#[non_exhaustive]
pub enum LossModel {
    /// Every frame that is in range is received.
    #[default]
    None,
    /// Each frame is lost independently of the others.
    Independent {
        /// Probability 0..=1 that a frame is lost.
        probability: f64,
    },
    /// Loss in bursts: a good and a bad state.
    GilbertElliott(GilbertElliott),
    /// Loss in bursts: a good, a medium and a bad state.
    ThreeState(ThreeState),
    /// Loss from the signal-to-noise ratio at the receiver.
    Snr(Snr),
    /// Loss from a table of delivery ratios against range.
    Range(RangeTable),
    /// Loss replayed from a record.
    Trace(Trace),
    /// The frames of a real link, lost again.
    Replayed(Replayed),
}

impl LossModel {
    /// A new instance for one link; draws its first state from `rng`.
    pub(crate) fn instance(&self, rng: &mut RandomStream) -> Box<dyn LinkLoss> {
        match self {
            LossModel::None => Box::new(bursts::Independent::new(0.0)),
            LossModel::Independent { probability } => Box::new(bursts::Independent::new(*probability)),
            LossModel::GilbertElliott(model) => model.instance(rng),
            LossModel::ThreeState(model) => model.instance(rng),
            LossModel::Snr(model) => model.instance(),
            LossModel::Range(table) => table.instance(),
            LossModel::Trace(trace) => trace.instance(),
            LossModel::Replayed(link) => link.instance(),
        }
    }
}

impl From<GilbertElliott> for LossModel {
    fn from(model: GilbertElliott) -> Self {
        Self::GilbertElliott(model)
    }
}

impl From<ThreeState> for LossModel {
    fn from(model: ThreeState) -> Self {
        Self::ThreeState(model)
    }
}

impl From<Snr> for LossModel {
    fn from(model: Snr) -> Self {
        Self::Snr(model)
    }
}

impl From<RangeTable> for LossModel {
    fn from(table: RangeTable) -> Self {
        Self::Range(table)
    }
}

impl From<Trace> for LossModel {
    fn from(trace: Trace) -> Self {
        Self::Trace(trace)
    }
}

impl From<Replayed> for LossModel {
    fn from(link: Replayed) -> Self {
        Self::Replayed(link)
    }
}

/// The properties of a frame that a loss model may use.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FrameContext {
    /// When the signal begins to arrive.
    pub at: Duration,
    pub airtime: Duration,
    pub bytes: usize,
    pub range_m: f64,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum FrameFate {
    Received,
    Lost,
    /// Too faint to be received or to disturb others.
    OutOfRange,
}

impl FrameFate {
    pub(crate) fn lost_if(lost: bool) -> Self {
        if lost { Self::Lost } else { Self::Received }
    }
}

/// An instance of a loss model on one directed link; frames come in order of time.
pub(crate) trait LinkLoss: Debug + Send {
    fn draw_fate(&mut self, frame: &FrameContext, rng: &mut RandomStream) -> FrameFate;
}

#[cfg(test)]
mod tests {
    use super::*;

    /// For each of `frames` frames, `spacing` apart, whether a new instance loses it.
    pub(super) fn losses(model: &LossModel, spacing: Duration, frames: u32) -> Vec<bool> {
        let mut rng = RandomStream::new(11, &[]);
        let mut instance = model.instance(&mut rng);
        let frame = |n| FrameContext { at: spacing * n, airtime: spacing / 2, bytes: 64, range_m: 1000.0 };
        (0..frames).map(|n| instance.draw_fate(&frame(n), &mut rng) != FrameFate::Received).collect()
    }

    pub(super) fn share(lost: &[bool]) -> f64 {
        lost.iter().filter(|lost| **lost).count() as f64 / lost.len() as f64
    }

    #[test]
    fn no_loss_delivers_all_and_certain_loss_none() {
        assert_eq!(share(&losses(&LossModel::None, Duration::from_secs(1), 1000)), 0.0);
        assert_eq!(share(&losses(&LossModel::Independent { probability: 1.0 }, Duration::from_secs(1), 1000)), 1.0);
    }
}
