//! The Gibbs step of one word: the inner loop of the sampler.
//!
//! The arithmetic is fixed so that every implementation gives the same labels bit for bit: f32 without fused
//! operations, slots in blocks of 16 lanes, block sums added in order, and the scan over lanes as a 4 x 4 tree (below)
//! whose partial sums never fall.
#![allow(clippy::needless_range_loop, reason = "the compiler vectorises lane loops over several arrays")]

use super::active_cell::ActiveCell;
use crate::random::unit_f32;
use crate::topics::labels::{LANES, LabelChange, LabelChanges, Labels, Lanes, label_of, pack, word_of};

/// Draws a new label for the next `steps` words of each active cell, given frozen global counts.
///
/// The current label of the word is removed exactly: one from its cell, one from its word, one from its label's total.
/// Words that took the birth slot do not make that slot more likely before the end of the phase. `BLOCKS` is the number
/// of blocks if it is known at compile time, else 0. The cells are not neighbours, so their steps are independent; they
/// are interleaved to hide latency.
#[inline(always)]
pub(super) fn advance<const BLOCKS: usize>(
    labels: &Labels,
    active_cells: &mut [ActiveCell],
    steps: usize,
    changes: &mut LabelChanges,
) {
    for _ in 0..steps {
        for active in active_cells.iter_mut() {
            step::<BLOCKS>(labels, active, changes);
        }
    }
}

#[inline(always)]
fn step<const BLOCKS: usize>(labels: &Labels, active: &mut ActiveCell, changes: &mut LabelChanges) {
    let blocks = if BLOCKS == 0 { labels.blocks } else { BLOCKS };
    let unit = unit_f32(active.key, active.count());
    let packed = active.words[active.at];
    let (word, old) = (word_of(packed), label_of(packed));
    active.leave(labels, old);
    let row = &labels.rows[word as usize * blocks..][..blocks];
    let (rate, gain) = (&labels.rate[..blocks], &labels.rate_gain[..blocks]);
    let (here, sums) = (&active.here[..blocks], &mut active.sums[..blocks]);
    let mut sum = [0.0f32; LANES];
    for block in 0..blocks {
        let own = old.wrapping_sub((block * LANES) as u32);
        let (row, rate, gain, here) = (row[block].0, rate[block].0, gain[block].0, here[block].0);
        let mut weights = [0.0f32; LANES];
        for lane in 0..LANES {
            let is_own = -i32::from(own == lane as u32);
            let seen = (row[lane] + is_own) as f32 + labels.beta;
            let rate = rate[lane] + f32::from_bits(gain[lane].to_bits() & is_own as u32);
            weights[lane] = here[lane] * seen * rate;
        }
        for lane in 0..LANES {
            sum[lane] += weights[lane];
        }
        sums[block].0 = sum;
    }
    let new = choose(&sum, sums, unit, blocks);
    active.join(labels, new);
    active.words[active.at] = pack(word, new);
    active.at += 1;
    changes.record(LabelChange { word, old: old as u16, new: new as u16 });
}

/// The slot at which the running sum of the weights passes `unit` x total: a draw in proportion to the weights.
///
/// The 16 lanes form four rows of four. The sum at row r, column c covers the rows 0..=r of column c and all columns
/// before c, so the order is by column, then by row. Within a lane it is by block.
#[inline(always)]
fn choose(lane_sums: &[f32; LANES], block_sums: &[Lanes], unit: f32, blocks: usize) -> u32 {
    let q = lane_sums;
    let mut sums = [[0.0f32; 4]; 4];
    for c in 0..4 {
        sums[0][c] = q[c];
        sums[1][c] = q[c] + q[4 + c];
        sums[2][c] = sums[1][c] + q[8 + c];
        sums[3][c] = sums[1][c] + (q[8 + c] + q[12 + c]);
    }
    let [a, b, c, _] = sums[3];
    let before = [0.0, a, a + b, (a + b) + c];
    for row in &mut sums {
        for column in 0..4 {
            row[column] += before[column];
        }
    }
    let aim = unit * sums[3][3];
    let mut passed = 0u32;
    for row in &sums {
        for value in row {
            passed += u32::from(*value <= aim);
        }
    }
    let passed = passed.min(15) as usize;
    let (row, column) = (passed & 3, passed >> 2);
    let lane = row * 4 + column;
    if blocks == 1 {
        return lane as u32;
    }
    let start = if passed == 0 { 0.0 } else { sums[(passed - 1) & 3][(passed - 1) >> 2] };
    let block = choose_block(&block_sums[..blocks], lane, aim - start);
    (block * LANES + lane) as u32
}

/// The first block whose running sum in `lane` passes `aim`. If rounding has put `aim` at the end, the last block
/// with a weight above 0.
#[inline(always)]
pub(super) fn choose_block(block_sums: &[Lanes], lane: usize, aim: f32) -> usize {
    let all = block_sums[block_sums.len() - 1].0[lane];
    if aim < all {
        block_sums.iter().map(|sums| usize::from(sums.0[lane] <= aim)).sum()
    } else {
        block_sums.iter().map(|sums| usize::from(sums.0[lane] < all)).sum()
    }
}
