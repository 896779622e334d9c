//! How frames are lost on one direction of a link.
//!
//! A [`LossModel`] describes; each directed link runs its own instance, which holds whatever state the model has.

mod dwell_chain;
mod gilbert_elliott;
mod harbour;
mod independent;
mod range_table;
mod snr;
mod three_state;
mod trace;

pub use gilbert_elliott::GilbertElliott;
pub use harbour::{FitError, FittedLink};
pub use range_table::{RangeTable, RangeTableError};
pub use snr::Snr;
pub use three_state::ThreeState;
pub use trace::{Trace, TraceError};

use crate::random::Stream;
use std::fmt::Debug;
use std::time::Duration;

/// A description of loss, the same for every link that is given it.
#[derive(Clone, PartialEq, Debug, Default)]
pub enum LossModel {
    /// Nothing is lost.
    #[default]
    None,
    /// Each frame is lost by itself.
    Independent {
        /// Probability 0..=1 that a frame is lost.
        probability: f64,
    },
    /// Bursts: a good and a bad state.
    GilbertElliott(GilbertElliott),
    /// Bursts: a good, a medium and a bad state.
    ThreeState(ThreeState),
    /// From the signal to noise ratio at the receiver.
    Snr(Snr),
    /// From delivery measured against range.
    Range(RangeTable),
    /// As recorded.
    Trace(Trace),
}

impl LossModel {
    /// A fresh instance for one link; draws its first state from `chance`.
    pub(crate) fn instance(&self, chance: &mut Stream) -> Box<dyn LinkLoss> {
        match self {
            LossModel::None => Box::new(independent::Independent::new(0.0)),
            LossModel::Independent { probability } => Box::new(independent::Independent::new(*probability)),
            LossModel::GilbertElliott(model) => model.instance(chance),
            LossModel::ThreeState(model) => model.instance(chance),
            LossModel::Snr(model) => model.instance(),
            LossModel::Range(table) => table.instance(),
            LossModel::Trace(trace) => trace.instance(),
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

/// What a loss model may look at.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame {
    /// When the signal begins to arrive.
    pub at: Duration,
    pub airtime: Duration,
    pub bytes: usize,
    pub range_m: f64,
}

/// A model's word on one frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Verdict {
    Heard,
    Lost,
    /// So faint that it neither arrives nor disturbs.
    OutOfRange,
}

impl Verdict {
    pub(crate) fn lost_if(lost: bool) -> Self {
        if lost { Self::Lost } else { Self::Heard }
    }
}

/// A loss model at work on one directed link; frames come in order of time.
pub(crate) trait LinkLoss: Debug + Send {
    fn judge(&mut self, frame: &Frame, chance: &mut Stream) -> Verdict;
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Which of `frames` frames, `spacing` apart, a fresh instance loses.
    pub(super) fn losses(model: &LossModel, spacing: Duration, frames: u32) -> Vec<bool> {
        let mut chance = Stream::new(11, &[]);
        let mut instance = model.instance(&mut chance);
        let frame = |n| Frame { at: spacing * n, airtime: spacing / 2, bytes: 64, range_m: 1000.0 };
        (0..frames).map(|n| instance.judge(&frame(n), &mut chance) != Verdict::Heard).collect()
    }

    pub(super) fn share(lost: &[bool]) -> f64 {
        lost.iter().filter(|lost| **lost).count() as f64 / lost.len() as f64
    }

    #[test]
    fn no_loss_loses_nothing_and_certain_loss_all() {
        assert_eq!(share(&losses(&LossModel::None, Duration::from_secs(1), 1000)), 0.0);
        assert_eq!(share(&losses(&LossModel::Independent { probability: 1.0 }, Duration::from_secs(1), 1000)), 1.0);
    }
}
