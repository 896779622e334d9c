//! One kind of decision: its contexts, their mixing and a final adaptive probability map (APM, also SSE; Shkarin 2002), in
//! integers, so that every CPU computes the same.

use std::collections::BTreeMap;
use std::sync::LazyLock;

pub(super) const MAX_DIRECT: usize = 10;
pub(super) const MAX_KEYED: usize = 5;
/// Inputs of the mixer: every context and a constant; inputs without a context stay zero.
pub(super) const INPUTS: usize = MAX_DIRECT + MAX_KEYED + 1;
/// The number of labels that a keyed context distinguishes at a time.
const KEYED_PLACES: usize = 2048;
/// Parallel mixers, each with its own selection of weights.
pub(super) const SETS: usize = 3;
/// Points of an adaptive probability map.
const APM_POINTS: usize = 33;
const APM_STEP: i32 = 256;
/// A weight of 1; weights are in 1/65536.
const ONE: i32 = 1 << 16;

/// The number of values of each context of a kind of decision.
#[derive(Debug)]
pub(super) struct StageLayout {
    /// The name in a trace.
    pub(super) name: &'static str,
    /// For each direct context, the number of its values.
    pub(super) direct: &'static [usize],
    /// For each keyed context, the number of its start values.
    pub(super) keyed: &'static [usize],
    /// For each mixer, the number of its sets of weights.
    pub(super) sets: [usize; SETS],
    /// The number of adaptive probability maps.
    pub(super) apms: usize,
}

impl StageLayout {
    pub(super) fn inputs(&self) -> usize {
        self.direct.len() + self.keyed.len() + 1
    }

    /// The number of estimates in a prior.
    pub(super) fn slots(&self) -> usize {
        self.direct.iter().chain(self.keyed).sum()
    }

    /// Sets of weights of all mixers.
    pub(super) fn rows(&self) -> usize {
        self.sets.iter().sum()
    }

    /// Points of all adaptive probability maps.
    pub(super) fn apm_points(&self) -> usize {
        self.apms * APM_POINTS
    }

    /// A prior without knowledge: every probability is one half.
    pub(super) fn blank(&self) -> StagePrior {
        let apm = (0..APM_POINTS as i32).map(|i| probability((i - 16) * APM_STEP) << 16);
        StagePrior {
            slots: vec![BitEstimate::BLANK; self.slots()],
            weights: vec![[ONE * 3 / 10; INPUTS]; self.rows()],
            second: vec![[ONE / 3; SETS]; self.apms],
            apms: apm.cycle().take(self.apm_points()).collect(),
        }
    }
}

/// The contexts of one decision.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Contexts {
    pub(super) direct: [usize; MAX_DIRECT],
    /// The key, and the context whose estimate is the start value.
    pub(super) keyed: [(u32, usize); MAX_KEYED],
    pub(super) sets: [usize; SETS],
    pub(super) apm: usize,
}

/// The adaptive state of one kind of decision; prediction and update alternate.
#[derive(Debug, Clone)]
pub(super) struct Stage {
    pub(super) layout: &'static StageLayout,
    prior: &'static StagePrior,
    slots: Vec<BitEstimate>,
    keyed: Vec<Vec<(u32, BitEstimate)>>,
    weights: Vec<[i32; INPUTS]>,
    second: Vec<[i32; SETS]>,
    apms: Vec<u32>,
    last: Last,
    /// How fast weights follow, in 1/2^20 of logit times error.
    pub(super) weight_rate: i32,
    pub(super) counts: Option<Box<VisitCounts>>,
}

/// Counts of decisions in each context within one chunk: all of them, and those that were `true`.
#[derive(Debug, Clone, Default)]
pub struct VisitCounts {
    direct: Vec<(u32, u32)>,
    /// By the context whose estimate a keyed one starts from, and by key.
    keyed: BTreeMap<(usize, u32), (u32, u32)>,
}

/// The parts of the last prediction, which the update needs.
#[derive(Debug, Clone, Copy, Default)]
struct Last {
    places: [usize; MAX_DIRECT],
    keyed: [usize; MAX_KEYED],
    /// The estimate of the prior from which each keyed context started.
    starts: [usize; MAX_KEYED],
    logit: [i32; INPUTS],
    sets: [usize; SETS],
    mixed: [u32; SETS],
    mixed_logits: [i32; SETS],
    second: usize,
    both: u32,
    apm: usize,
}

/// Not a key: labels and their pairs are below.
const NO_KEY: u32 = u32::MAX;
/// How fast weights follow while coding.
const WEIGHT_RATE: i32 = 3;
/// How fast adaptive probability maps follow: 1/2^n of the error.
const APM_SHIFT: u32 = 7;

impl Stage {
    pub(super) fn new(layout: &'static StageLayout, prior: &'static StagePrior) -> Self {
        Self {
            layout,
            prior,
            slots: prior.slots.clone(),
            keyed: layout.keyed.iter().map(|_| vec![(NO_KEY, BitEstimate::BLANK); KEYED_PLACES]).collect(),
            weights: prior.weights.clone(),
            second: prior.second.clone(),
            apms: prior.apms.clone(),
            last: Last::default(),
            weight_rate: WEIGHT_RATE,
            counts: None,
        }
    }

    /// The probability of `true` in 1/65536, from 1 to 65535.
    pub(super) fn predict(&mut self, contexts: &Contexts) -> u32 {
        let mut first = 0;
        let mut input = 0;
        for (&values, &context) in self.layout.direct.iter().zip(&contexts.direct) {
            debug_assert!(context < values, "context {input} is {context} of {values}");
            self.last.places[input] = first + context;
            self.last.logit[input] = self.slots[first + context].logit();
            first += values;
            input += 1;
        }
        for (i, (&values, &(key, start))) in self.layout.keyed.iter().zip(&contexts.keyed).enumerate() {
            debug_assert!(start < values);
            let place = (key.wrapping_mul(0x9E37_79B1) >> 16) as usize % KEYED_PLACES;
            let held = &mut self.keyed[i][place];
            if held.0 != key {
                *held = (key, self.prior.slots[first + start]);
            }
            self.last.keyed[i] = place;
            self.last.starts[i] = first + start;
            self.last.logit[input] = held.1.logit();
            first += values;
            input += 1;
        }
        self.last.logit[input] = 256;
        self.mix(contexts)
    }

    fn mix(&mut self, contexts: &Contexts) -> u32 {
        let mut first = 0;
        for (i, (&choices, &choice)) in self.layout.sets.iter().zip(&contexts.sets).enumerate() {
            debug_assert!(choice < choices);
            self.last.sets[i] = first + choice;
            let logit = weigh(&self.weights[first + choice], &self.last.logit);
            (self.last.mixed[i], self.last.mixed_logits[i]) = (probability(logit), logit);
            first += choices;
        }
        self.last.second = contexts.apm;
        let logit = weigh(&self.second[contexts.apm], &self.last.mixed_logits);
        self.last.both = probability(logit);
        let along = logit + 16 * APM_STEP;
        let (step, rest) = ((along / APM_STEP) as usize, (along % APM_STEP) as u64);
        let at = contexts.apm * APM_POINTS + step;
        let between = u64::from(self.apms[at]) * (256 - rest) + u64::from(self.apms[at + 1]) * rest;
        self.last.apm = if rest < 128 { at } else { at + 1 };
        let corrected = (between >> 24) as u32;
        (probability(logit) + corrected).div_ceil(2).clamp(1, 65_535)
    }

    /// Learns from the decision that was predicted last.
    pub(super) fn update(&mut self, bit: bool) {
        let goal = if bit { 65_536 } else { 0 };
        for (&mixed, row) in self.last.mixed.iter().zip(self.last.sets) {
            follow(&mut self.weights[row], &self.last.logit, (goal - mixed as i32) * self.weight_rate);
        }
        let error = (goal - self.last.both as i32) * self.weight_rate / 2;
        follow(&mut self.second[self.last.second], &self.last.mixed_logits, error);
        let point = &mut self.apms[self.last.apm];
        let goal = if bit { i64::from(u32::MAX) } else { 0 };
        *point = (i64::from(*point) + ((goal - i64::from(*point)) >> APM_SHIFT)) as u32;
        for &place in &self.last.places[..self.layout.direct.len()] {
            self.slots[place].update(bit);
        }
        for (table, &place) in self.keyed.iter_mut().zip(&self.last.keyed) {
            table[place].1.update(bit);
        }
        if let Some(counts) = &mut self.counts {
            let keys = self.keyed.iter().zip(&self.last.keyed).map(|(table, &place)| table[place].0);
            counts.count(
                &self.last.places[..self.layout.direct.len()],
                self.last.starts.iter().copied().zip(keys),
                bit,
            );
        }
    }

    pub(super) fn carry(&mut self, before: &Self) {
        self.weights.clone_from(&before.weights);
        self.second.clone_from(&before.second);
        self.apms.clone_from(&before.apms);
    }

    /// Copies weights and adaptive probability maps into a prior.
    pub(super) fn teach(&self, prior: &mut StagePrior) {
        prior.weights.clone_from(&self.weights);
        prior.second.clone_from(&self.second);
        prior.apms.clone_from(&self.apms);
    }
}

/// The largest weight of either sign; keeps all sums within 32 bits.
const MAX_WEIGHT: i32 = (1 << 19) - 1;

fn weigh<const N: usize>(weights: &[i32; N], logit: &[i32; N]) -> i32 {
    let sum: i32 = weights.iter().zip(logit).map(|(&weight, &logit)| (weight >> 5) * logit).sum();
    (sum >> 11).clamp(-MAX_LOGIT, MAX_LOGIT)
}

fn follow<const N: usize>(weights: &mut [i32; N], logit: &[i32; N], error: i32) {
    for (weight, &logit) in weights.iter_mut().zip(logit) {
        *weight = (*weight + ((logit * error + (1 << 19)) >> 20)).clamp(-MAX_WEIGHT, MAX_WEIGHT);
    }
}

impl VisitCounts {
    /// Each context with its decisions and those that were `true`; a context that starts several keyed ones comes
    /// up once for each key.
    pub fn iter(&self) -> impl Iterator<Item = (usize, u32, u32)> + '_ {
        let direct = self.direct.iter().enumerate().map(|(context, &(visits, ones))| (context, visits, ones));
        direct.chain(self.keyed.iter().map(|(&(start, _), &(visits, ones))| (start, visits, ones)))
    }

    fn count(&mut self, places: &[usize], keyed: impl Iterator<Item = (usize, u32)>, bit: bool) {
        let note = |entry: &mut (u32, u32)| *entry = (entry.0 + 1, entry.1 + u32::from(bit));
        for &place in places {
            if place >= self.direct.len() {
                self.direct.resize(place + 1, (0, 0));
            }
            note(&mut self.direct[place]);
        }
        keyed.for_each(|place| note(self.keyed.entry(place).or_default()));
    }
}

/// A logit as a prior stores it.
pub(super) fn stored_logit(p: u32) -> i16 {
    logit(p) as i16
}

/// Logits are in 1/256 of a binary order of magnitude, and lie between minus and plus this.
pub(super) const MAX_LOGIT: i32 = 4095;

/// log2 of 1 + i/256, in 1/256.
const MANTISSA: [u8; 256] = {
    let mut table = [0u8; 256];
    let mut i = 0;
    while i < 256 {
        // Eight squarings yield eight bits of the logarithm.
        let mut x = (256 + i as u64) << 22;
        let mut bits = 0u16;
        let mut step = 0;
        while step < 9 {
            x = (x * x) >> 30;
            bits <<= 1;
            if x >= 1 << 31 {
                bits |= 1;
                x >>= 1;
            }
            step += 1;
        }
        let rounded = (bits + 1) >> 1;
        table[i] = if rounded > 255 { 255 } else { rounded as u8 };
        i += 1;
    }
    table
};

/// log2 of `x` in 1/256; `x` must be at least 1.
pub(super) fn log2(x: u32) -> i32 {
    let top = 31 - x.leading_zeros() as i32;
    let fraction = ((u64::from(x) << 8 >> top) & 255) as usize;
    top * 256 + i32::from(MANTISSA[fraction])
}

/// The logit of a probability in 1/2^32.
pub(super) fn logit(p: u32) -> i32 {
    (log2(p.max(1)) - log2((u32::MAX - p).max(1))).clamp(-MAX_LOGIT, MAX_LOGIT)
}

static PROBABILITY: LazyLock<Vec<u16>> = LazyLock::new(|| {
    let of = |p: u32| logit(p << 16 | 0x8000);
    let mut p = 1;
    let table = (-MAX_LOGIT..=MAX_LOGIT).map(|logit| {
        while p < 65_535 && of(p) < logit {
            p += 1;
        }
        p as u16
    });
    table.collect()
});

/// The probability in 1/65536, from 1 to 65535, of a logit.
pub(super) fn probability(logit: i32) -> u32 {
    let at = (logit.clamp(-MAX_LOGIT, MAX_LOGIT) + MAX_LOGIT) as usize;
    PROBABILITY.get(at).map_or(32_768, |&p| u32::from(p))
}

/// 65536 / (visits + 1.6).
const RATE: [u32; 1024] = {
    let mut table = [0; 1024];
    let mut n = 0;
    while n < 1024 {
        table[n] = 655_360 / (10 * n as u32 + 16);
        n += 1;
    }
    table
};

/// The estimated probability of `true` in one context.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BitEstimate {
    /// The probability of `true` in units of 1/2^32.
    pub p: u32,
    /// Decisions that the estimate is worth, at most [`Self::MAX_VISITS`].
    pub visits: u16,
}

impl BitEstimate {
    /// Decisions after which the estimate adapts no more slowly.
    pub const MAX_VISITS: u16 = 1020;

    /// One half, worth no decision.
    pub const BLANK: Self = Self { p: 1 << 31, visits: 0 };

    pub(super) fn logit(self) -> i32 {
        logit(self.p)
    }

    pub(super) fn update(&mut self, bit: bool) {
        let goal = if bit { i64::from(u32::MAX) } else { 0 };
        let step = ((goal - i64::from(self.p)) * i64::from(RATE[usize::from(self.visits)])) >> 16;
        self.p = (i64::from(self.p) + step) as u32;
        if self.visits < Self::MAX_VISITS {
            self.visits += 1;
        }
    }
}

/// The state of one kind of decision at the start of a chunk.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct StagePrior {
    /// Estimates of the direct contexts one after another, then the start values of the keyed ones.
    pub(super) slots: Vec<BitEstimate>,
    /// Weights of the parallel mixers, in 1/65536.
    pub(super) weights: Vec<[i32; INPUTS]>,
    /// Weights of the final mixer, in 1/65536.
    pub(super) second: Vec<[i32; SETS]>,
    /// Points of the adaptive probability maps, in 1/2^32.
    pub(super) apms: Vec<u32>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn logit_and_probability_are_inverse() {
        for p in [1u32, 2, 9, 100, 3000, 32_768, 60_000, 65_500, 65_534] {
            let back = probability(logit(p << 16 | 0x8000));
            assert!(back.abs_diff(p) <= 1 + p.min(65_536 - p) / 100, "{p} came back as {back}");
        }
        assert_eq!(log2(1), 0);
        assert_eq!(log2(1 << 20), 20 * 256);
        assert!((log2(3) - 406).abs() <= 1);
    }
}
