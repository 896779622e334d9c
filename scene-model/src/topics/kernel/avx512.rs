//! The Gibbs step in AVX-512: the same arithmetic as the portable one, one block of 16 slots in a register.
//!
//! With one or two blocks, the label counts of each active cell stay in registers. The steps of several cells are
//! interleaved, so that the processor works on one cell while it waits for the results of another.

use std::arch::x86_64::*;

use super::active_cell::ActiveCell;
use super::gibbs::choose_block;
use crate::random::unit_f32;
use crate::topics::labels::{
    Counts, LANES, LabelChange, LabelChanges, Labels, Lanes, UNLABELLED, label_of, pack, word_of,
};

/// Has the contract of the portable `advance`.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,popcnt,bmi1,bmi2")]
pub(super) fn advance(labels: &Labels, active_cells: &mut [ActiveCell], steps: usize, changes: &mut LabelChanges) {
    match labels.blocks {
        1 => advance_few_blocks::<1>(labels, active_cells, steps, changes),
        2 => advance_few_blocks::<2>(labels, active_cells, steps, changes),
        _ => {
            for _ in 0..steps {
                for active in active_cells.iter_mut() {
                    step(labels, active, changes);
                }
            }
        }
    }
}

#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,popcnt,bmi1,bmi2")]
fn advance_few_blocks<const B: usize>(
    labels: &Labels,
    active_cells: &mut [ActiveCell],
    steps: usize,
    changes: &mut LabelChanges,
) {
    if let Ok(active_cells) = <&mut [ActiveCell; 4]>::try_from(&mut *active_cells) {
        return advance_in_registers::<B, 4>(labels, active_cells, steps, changes);
    }
    for active in active_cells {
        advance_in_registers::<B, 1>(labels, std::array::from_mut(active), steps, changes);
    }
}

/// `B` blocks and `N` active cells, few enough that their label counts stay in registers.
#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,popcnt,bmi1,bmi2")]
fn advance_in_registers<const B: usize, const N: usize>(
    labels: &Labels,
    active_cells: &mut [ActiveCell; N],
    steps: usize,
    changes: &mut LabelChanges,
) {
    let one = _mm512_set1_ps(1.0);
    let birth = labels.birth_slot().unwrap_or(UNLABELLED);
    let weigher = Weigher::new(labels);
    let (prior, rate, gain) = (&labels.prior[..B], &labels.rate[..B], &labels.rate_gain[..B]);
    let mut near: [[__m512; B]; N] = std::array::from_fn(|n| std::array::from_fn(|b| load(&active_cells[n].near[b])));
    for _ in 0..steps {
        for (active, near) in active_cells.iter_mut().zip(&mut near) {
            let unit = unit_f32(active.key, active.count());
            let packed = active.words[active.at];
            let (word, old) = (word_of(packed), label_of(packed));
            let row = &labels.rows[word as usize * B..][..B];
            let mut sums = [_mm512_setzero_ps(); B];
            for b in 0..B {
                let own = slot_mask(old.wrapping_sub((b * LANES) as u32));
                near[b] = _mm512_mask_sub_ps(near[b], own, near[b], one);
                let here = _mm512_add_ps(near[b], load(&prior[b]));
                let weights = weigher.weigh(here, &row[b], &rate[b], &gain[b], own);
                sums[b] = if b == 0 { weights } else { _mm512_add_ps(sums[b - 1], weights) };
            }
            let new = choose(&sums, unit);
            let counted = if new == birth { UNLABELLED } else { new };
            active.births += u16::from(new == birth);
            for (b, near) in near.iter_mut().enumerate() {
                let arrived = slot_mask(counted.wrapping_sub((b * LANES) as u32));
                *near = _mm512_mask_add_ps(*near, arrived, *near, one);
            }
            active.words[active.at] = pack(word, new);
            active.at += 1;
            changes.record(LabelChange { word, old: old as u16, new: new as u16 });
        }
    }
    for (active, near) in active_cells.iter_mut().zip(near) {
        active.near.iter_mut().zip(near).for_each(|(kept, near)| store(kept, near));
    }
}

/// As the portable `choose`, from the running sums over blocks.
#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,popcnt,bmi1,bmi2")]
fn choose<const B: usize>(sums: &[__m512; B], unit: f32) -> u32 {
    let (scanned, aim) = scan(sums[B - 1], unit);
    let passed = passed(scanned, aim);
    let lane = lane_of(passed);
    if B == 1 {
        return lane;
    }
    let start = if passed == 0 { 0.0 } else { pick(scanned, lane_of(passed - 1)) };
    let mut stored = [Lanes([0.0; LANES]); B];
    stored.iter_mut().zip(sums).for_each(|(stored, sums)| store(stored, *sums));
    let block = choose_block(&stored, lane as usize, _mm512_cvtss_f32(aim) - start);
    block as u32 * LANES as u32 + lane
}

#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,popcnt,bmi1,bmi2")]
fn step(labels: &Labels, active: &mut ActiveCell, changes: &mut LabelChanges) {
    let blocks = labels.blocks;
    let unit = unit_f32(active.key, active.count());
    let packed = active.words[active.at];
    let (word, old) = (word_of(packed), label_of(packed));
    active.leave(labels, old);
    let rows = &labels.rows[word as usize * blocks..][..blocks];
    let rates = labels.rate[..blocks].iter().zip(&labels.rate_gain[..blocks]);
    let weigher = Weigher::new(labels);
    let mut sum = _mm512_setzero_ps();
    let parts = active.here.iter().zip(&mut active.sums).zip(rows).zip(rates);
    for (block, (((here, sums), row), (rate, gain))) in parts.enumerate() {
        let own = slot_mask(old.wrapping_sub((block * LANES) as u32));
        sum = _mm512_add_ps(sum, weigher.weigh(load(here), row, rate, gain, own));
        store(sums, sum);
    }
    let (scanned, aim) = scan(sum, unit);
    let passed = passed(scanned, aim);
    let lane = lane_of(passed) as usize;
    let start = if passed == 0 { 0.0 } else { pick(scanned, lane_of(passed - 1)) };
    let block = choose_block(&active.sums[..blocks], lane, _mm512_cvtss_f32(aim) - start);
    let new = (block * LANES + lane) as u32;
    active.join(labels, new);
    active.words[active.at] = pack(word, new);
    active.at += 1;
    changes.record(LabelChange { word, old: old as u16, new: new as u16 });
}

#[derive(Clone, Copy)]
struct Weigher {
    beta: __m512,
    one: __m512i,
}

impl Weigher {
    #[inline]
    #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,popcnt,bmi1,bmi2")]
    fn new(labels: &Labels) -> Self {
        Self { beta: _mm512_set1_ps(labels.beta), one: _mm512_set1_epi32(1) }
    }

    #[inline]
    #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,popcnt,bmi1,bmi2")]
    fn weigh(self, here: __m512, row: &Counts, rate: &Lanes, gain: &Lanes, own: __mmask16) -> __m512 {
        let row = load_counts(row);
        let count = _mm512_mask_sub_epi32(row, own, row, self.one);
        let seen = _mm512_add_ps(_mm512_cvtepi32_ps(count), self.beta);
        let rate = load(rate);
        let rate = _mm512_mask_add_ps(rate, own, rate, load(gain));
        _mm512_mul_ps(_mm512_mul_ps(here, seen), rate)
    }
}

/// Running sums over the lanes by column, then row, and the sum to look for (in every lane). See the portable `choose`.
#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,popcnt,bmi1,bmi2")]
fn scan(sum: __m512, unit: f32) -> (__m512, __m512) {
    const EACH_0022: i32 = 0b10_10_00_00;
    const EACH_1: i32 = 0b01_01_01_01;
    const EACH_2: i32 = 0b10_10_10_10;
    const EACH_3: i32 = 0b11_11_11_11;
    // Rows 1 and 3 take the row before, then rows 2 and 3 take row 1.
    let pairs = _mm512_mask_add_ps(sum, 0xf0f0, sum, _mm512_shuffle_f32x4::<EACH_0022>(sum, sum));
    let columns = _mm512_mask_add_ps(pairs, 0xff00, pairs, _mm512_shuffle_f32x4::<EACH_1>(pairs, pairs));
    // Sums of whole columns, moved up by one: 0, a, b, c; then 0, a, a + b, (a + b) + c.
    let totals = _mm512_shuffle_f32x4::<EACH_3>(columns, columns);
    let before = _mm512_maskz_permute_ps::<0b10_01_00_00>(0xeeee, totals);
    let before = _mm512_mask_add_ps(before, 0x4444, before, _mm512_permute_ps::<EACH_1>(before));
    let before = _mm512_mask_add_ps(before, 0x8888, before, _mm512_permute_ps::<EACH_2>(before));
    let sums = _mm512_add_ps(columns, before);
    let all = _mm512_permutexvar_ps(_mm512_set1_epi32(15), sums);
    (sums, _mm512_mul_ps(_mm512_set1_ps(unit), all))
}

/// How many of the running sums do not pass the aim, at most 15.
#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,popcnt,bmi1,bmi2")]
fn passed(sums: __m512, aim: __m512) -> u32 {
    _mm512_cmp_ps_mask::<_CMP_LE_OQ>(sums, aim).count_ones().min(15)
}

/// The lane at a rank in the order by column, then row.
#[inline(always)]
fn lane_of(rank: u32) -> u32 {
    (rank & 3) * 4 + (rank >> 2)
}

#[inline]
#[target_feature(enable = "avx512f")]
fn pick(values: __m512, lane: u32) -> f32 {
    _mm512_cvtss_f32(_mm512_permutexvar_ps(_mm512_set1_epi32(lane as i32), values))
}

/// The mask of one lane; empty if the lane is outside the block.
#[inline(always)]
fn slot_mask(lane: u32) -> __mmask16 {
    (1u64 << lane.min(63)) as __mmask16
}

#[inline]
#[target_feature(enable = "avx512f")]
fn load(lanes: &Lanes) -> __m512 {
    // SAFETY: `Lanes` is 64 bytes of f32, aligned to 64 bytes.
    unsafe { _mm512_load_ps(lanes.0.as_ptr()) }
}

#[inline]
#[target_feature(enable = "avx512f")]
fn load_counts(counts: &Counts) -> __m512i {
    // SAFETY: `Counts` is 64 bytes of i32, aligned to 64 bytes.
    unsafe { _mm512_load_si512(counts.0.as_ptr().cast()) }
}

#[inline]
#[target_feature(enable = "avx512f")]
fn store(lanes: &mut Lanes, values: __m512) {
    // SAFETY: `Lanes` is 64 bytes of f32, aligned to 64 bytes.
    unsafe { _mm512_store_ps(lanes.0.as_mut_ptr(), values) }
}
