//! One Gibbs pass over the words of one cell: the inner loop.
//!
//! The arithmetic is fixed so that every implementation gives the same labels bit for bit: f32 without fused
//! operations, slots in blocks of 16 lanes, block sums added in order, and the scan over lanes as a 4 x 4 tree (below)
//! whose partial sums never fall.
#![allow(
    clippy::needless_range_loop,
    reason = "lane loops over several arrays are what the compiler turns into vectors"
)]

use super::labels::{LANES, Labels, Lanes, label_of, pack, word_of};
use crate::random::unit_f32;

/// A word that changed its label.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Move {
    pub(crate) word: u32,
    pub(crate) old: u16,
    pub(crate) new: u16,
}

/// Draws a new label for each word in turn, given global counts that stand still.
///
/// `near` holds the label counts of the cell and its neighbours and follows the changes; `scratch` has as many blocks.
/// Each word's own label is taken out exactly: one from its cell, one from its word, one from its label's total. Words
/// that sit in the birth slot do not make that slot more likely until the counts are settled.
pub(crate) fn visit(
    labels: &Labels,
    near: &mut [Lanes],
    scratch: &mut [Lanes],
    words: &mut [u32],
    key: u64,
    moves: &mut Vec<Move>,
) {
    match labels.blocks {
        1 => visit_blocks::<1>(labels, near, scratch, words, key, moves),
        2 => visit_blocks::<2>(labels, near, scratch, words, key, moves),
        7 => visit_blocks::<7>(labels, near, scratch, words, key, moves),
        _ => visit_blocks::<0>(labels, near, scratch, words, key, moves),
    }
}

/// `BLOCKS` is the number of blocks if it is known at compile time, else 0.
#[inline(always)]
fn visit_blocks<const BLOCKS: usize>(
    labels: &Labels,
    near: &mut [Lanes],
    scratch: &mut [Lanes],
    words: &mut [u32],
    key: u64,
    moves: &mut Vec<Move>,
) {
    let blocks = if BLOCKS == 0 { labels.blocks } else { BLOCKS };
    let (near, scratch) = (&mut near[..blocks], &mut scratch[..blocks]);
    let (prior, rate, gain) = (&labels.prior[..blocks], &labels.rate[..blocks], &labels.rate_gain[..blocks]);
    let birth = labels.birth_slot().unwrap_or(u32::MAX);
    for (index, packed) in words.iter_mut().enumerate() {
        let (word, old) = (word_of(*packed), label_of(*packed));
        let row = &labels.rows[word as usize * blocks..][..blocks];
        let mut sum = [0.0f32; LANES];
        for block in 0..blocks {
            let own = old.wrapping_sub((block * LANES) as u32);
            for lane in 0..LANES {
                let is_own = own == lane as u32;
                let here = near[block].0[lane] - is_own as u32 as i32 as f32 + prior[block].0[lane];
                let seen = (row[block].0[lane] - i32::from(is_own)) as f32 + labels.beta;
                let rate = rate[block].0[lane] + if is_own { gain[block].0[lane] } else { 0.0 };
                sum[lane] += here * seen * rate;
            }
            if blocks > 1 {
                scratch[block].0 = sum;
            }
        }
        let new = choose(&sum, scratch, unit_f32(key, index as u64), blocks);
        *packed = pack(word, new);
        if new != old {
            for block in 0..blocks {
                for lane in 0..LANES {
                    let slot = (block * LANES + lane) as u32;
                    let arrived = slot == new && new != birth;
                    near[block].0[lane] += arrived as u32 as i32 as f32 - (slot == old) as u32 as i32 as f32;
                }
            }
            moves.push(Move { word, old: old as u16, new: new as u16 });
        }
    }
}

/// The slot where the running sum of the weights passes `unit` x total.
///
/// Lanes are taken as four rows of four: the sum at row r, column c is the rows 0..=r of column c plus all columns
/// before c. The order is by column, then row; then, within a lane, by block.
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

/// The first block whose running sum in `lane` passes `aim`; rounding may put `aim` at the end, then the last that adds.
#[inline(always)]
fn choose_block(block_sums: &[Lanes], lane: usize, aim: f32) -> usize {
    let all = block_sums[block_sums.len() - 1].0[lane];
    if aim < all {
        block_sums.iter().map(|sums| usize::from(sums.0[lane] <= aim)).sum()
    } else {
        block_sums.iter().map(|sums| usize::from(sums.0[lane] < all)).sum()
    }
}
