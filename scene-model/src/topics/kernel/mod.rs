//! The inner loops of the sampler, compiled for several widths of vectors.
//!
//! Each loop has one portable source, which is compiled for the baseline of the target and for AVX2; `avx512.rs` has
//! the Gibbs step in intrinsics. The compiler may not reorder or fuse floating-point operations, so all versions give
//! the same labels bit for bit.

#![allow(unsafe_code, reason = "calling code that is compiled for vector units found at run time")]

mod active_cell;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod gibbs;
mod votes;

use super::labels::{LabelChanges, Labels};
pub(crate) use active_cell::{ActiveCell, Job};
pub(crate) use votes::LabelVotes;

/// The vector instructions that the inner loops use.
///
/// Every kernel gives the same labels bit for bit, so the choice affects the speed alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Kernel {
    /// The baseline of the target: SSE2 on x86-64, NEON on aarch64.
    Portable,
    /// 256-bit vectors of x86-64 (AVX2, POPCNT and BMI).
    Avx2,
    /// 512-bit vectors of x86-64 (the subsets F, BW, DQ and VL).
    Avx512,
}

impl Kernel {
    /// Returns the widest kernel that this machine can run.
    #[must_use]
    pub fn detect() -> Self {
        [Self::Avx512, Self::Avx2].into_iter().find(|kernel| kernel.is_available()).unwrap_or(Self::Portable)
    }

    /// Whether this machine has the instructions.
    #[must_use]
    pub fn is_available(self) -> bool {
        match self {
            Self::Portable => true,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => has_avx2(),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => has_avx512(),
            #[cfg(not(target_arch = "x86_64"))]
            _ => false,
        }
    }

    /// The name in reports: `portable`, `avx2` or `avx512`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Portable => "portable",
            Self::Avx2 => "avx2",
            Self::Avx512 => "avx512",
        }
    }
}

#[cfg(target_arch = "x86_64")]
fn has_avx2() -> bool {
    use std::arch::is_x86_feature_detected as has;
    has!("avx2") && has!("popcnt") && has!("bmi1") && has!("bmi2")
}

#[cfg(target_arch = "x86_64")]
fn has_avx512() -> bool {
    use std::arch::is_x86_feature_detected as has;
    has_avx2() && has!("avx512f") && has!("avx512bw") && has!("avx512dq") && has!("avx512vl")
}

impl Kernel {
    /// Resamples the next `steps` words of each active cell: see [`gibbs::advance`].
    pub(crate) fn advance(
        self,
        labels: &Labels,
        active_cells: &mut [ActiveCell],
        steps: usize,
        changes: &mut LabelChanges,
    ) {
        match self {
            // SAFETY: a model takes a kernel only if `is_available`, so the machine has these instructions.
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => unsafe { avx512::advance(labels, active_cells, steps, changes) },
            // SAFETY: as above.
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => unsafe { advance_avx2(labels, active_cells, steps, changes) },
            _ => advance(labels, active_cells, steps, changes),
        }
    }

    /// Counts the MAP labels of a cell's words: see [`votes::map_labels`].
    pub(crate) fn map_labels(self, votes: &LabelVotes<'_>, words: &[u32], tally: &mut [u32]) -> f64 {
        match self {
            // SAFETY: as above.
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => unsafe { map_labels_avx512(votes, words, tally) },
            // SAFETY: as above.
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => unsafe { map_labels_avx2(votes, words, tally) },
            _ => map_labels(votes, words, tally),
        }
    }
}

#[inline(always)]
fn advance(labels: &Labels, active_cells: &mut [ActiveCell], steps: usize, changes: &mut LabelChanges) {
    match labels.blocks {
        1 => gibbs::advance::<1>(labels, active_cells, steps, changes),
        2 => gibbs::advance::<2>(labels, active_cells, steps, changes),
        7 => gibbs::advance::<7>(labels, active_cells, steps, changes),
        _ => gibbs::advance::<0>(labels, active_cells, steps, changes),
    }
}

#[inline(always)]
fn map_labels(votes: &LabelVotes<'_>, words: &[u32], tally: &mut [u32]) -> f64 {
    match votes.labels.blocks {
        1 => votes::map_labels::<1>(votes, words, tally),
        2 => votes::map_labels::<2>(votes, words, tally),
        7 => votes::map_labels::<7>(votes, words, tally),
        _ => votes::map_labels::<0>(votes, words, tally),
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,popcnt,bmi1,bmi2")]
fn advance_avx2(labels: &Labels, active_cells: &mut [ActiveCell], steps: usize, changes: &mut LabelChanges) {
    advance(labels, active_cells, steps, changes);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,popcnt,bmi1,bmi2")]
fn map_labels_avx2(votes: &LabelVotes<'_>, words: &[u32], tally: &mut [u32]) -> f64 {
    map_labels(votes, words, tally)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,popcnt,bmi1,bmi2")]
fn map_labels_avx512(votes: &LabelVotes<'_>, words: &[u32], tally: &mut [u32]) -> f64 {
    map_labels(votes, words, tally)
}
