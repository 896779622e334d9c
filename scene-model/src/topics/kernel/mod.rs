//! The inner loops, compiled for the vector units that the machine has.
//!
//! There is one source for each loop. It is compiled for the baseline of the target and again for AVX2 and AVX-512;
//! the compiler may not reorder or fuse floating-point operations, so all of them give the same labels bit for bit.

#![allow(unsafe_code, reason = "calling code that is compiled for vector units found at run time")]

#[cfg(target_arch = "x86_64")]
mod avx512;
mod gibbs;
mod seat;
mod votes;

use super::labels::Labels;
pub(crate) use seat::{Job, Moves, Seat};
pub(crate) use votes::Ballot;

/// A word that changed its label.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Move {
    pub(crate) word: u32,
    pub(crate) old: u16,
    pub(crate) new: u16,
}

/// Vector units that the inner loops are compiled for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kernel {
    /// What every machine of the target has: SSE2, NEON.
    Portable,
    /// 256-bit vectors.
    Avx2,
    /// 512-bit vectors.
    Avx512,
}

impl Kernel {
    /// The widest that this machine has.
    pub fn detect() -> Self {
        [Self::Avx512, Self::Avx2].into_iter().find(|kernel| kernel.is_available()).unwrap_or(Self::Portable)
    }

    /// Whether this machine has it.
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

    /// Short name for reports.
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
    /// See [`gibbs::advance`].
    pub(crate) fn advance(self, labels: &Labels, seats: &mut [Seat], steps: usize, moves: &mut Moves) {
        match self {
            // SAFETY: a model takes a kernel only if `is_available`, so the machine has these instructions.
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => unsafe { avx512::advance(labels, seats, steps, moves) },
            // SAFETY: as above.
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => unsafe { advance_avx2(labels, seats, steps, moves) },
            _ => advance(labels, seats, steps, moves),
        }
    }

    /// See [`votes::vote`].
    pub(crate) fn vote(self, ballot: &Ballot<'_>, words: &[u32], votes: &mut [u32]) -> f64 {
        match self {
            // SAFETY: as above.
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => unsafe { vote_avx512(ballot, words, votes) },
            // SAFETY: as above.
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => unsafe { vote_avx2(ballot, words, votes) },
            _ => vote(ballot, words, votes),
        }
    }
}

#[inline(always)]
fn advance(labels: &Labels, seats: &mut [Seat], steps: usize, moves: &mut Moves) {
    match labels.blocks {
        1 => gibbs::advance::<1>(labels, seats, steps, moves),
        2 => gibbs::advance::<2>(labels, seats, steps, moves),
        7 => gibbs::advance::<7>(labels, seats, steps, moves),
        _ => gibbs::advance::<0>(labels, seats, steps, moves),
    }
}

#[inline(always)]
fn vote(ballot: &Ballot<'_>, words: &[u32], votes: &mut [u32]) -> f64 {
    match ballot.labels.blocks {
        1 => votes::vote::<1>(ballot, words, votes),
        2 => votes::vote::<2>(ballot, words, votes),
        7 => votes::vote::<7>(ballot, words, votes),
        _ => votes::vote::<0>(ballot, words, votes),
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,popcnt,bmi1,bmi2")]
fn advance_avx2(labels: &Labels, seats: &mut [Seat], steps: usize, moves: &mut Moves) {
    advance(labels, seats, steps, moves);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,popcnt,bmi1,bmi2")]
fn vote_avx2(ballot: &Ballot<'_>, words: &[u32], votes: &mut [u32]) -> f64 {
    vote(ballot, words, votes)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,popcnt,bmi1,bmi2")]
fn vote_avx512(ballot: &Ballot<'_>, words: &[u32], votes: &mut [u32]) -> f64 {
    vote(ballot, words, votes)
}
