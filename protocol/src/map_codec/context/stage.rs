//! One kind of decision: its contexts, their mixing and a last correction.

use super::logistic::{MAX_ODDS, odds, probability};
use super::prior::StagePrior;
use super::slot::BitEstimate;
use std::collections::BTreeMap;

/// Most contexts of one kind of decision.
pub(super) const MOST_DIRECT: usize = 10;
/// Most contexts that go by label.
pub(super) const MOST_KEYED: usize = 5;
/// Inputs of the mixer: every context and a constant; those without a context stay zero.
pub(super) const INPUTS: usize = MOST_DIRECT + MOST_KEYED + 1;
/// Labels that a keyed context keeps apart at a time.
const KEYED_PLACES: usize = 2048;
/// Mixers side by side, each with its own choice of weights.
pub(super) const SETS: usize = 3;
/// Steps of the correction curve.
const CURVE: usize = 33;
const CURVE_STEP: i32 = 256;
/// Weight of one; weights are in 1/65536.
const ONE: i32 = 1 << 16;

/// How many values each context of a kind of decision has.
#[derive(Debug)]
pub(super) struct Layout {
    /// Contexts that are numbers below this.
    pub(super) direct: &'static [usize],
    /// Contexts that go by a key too: what they start from has this many values.
    pub(super) keyed: &'static [usize],
    /// Choices of weights.
    pub(super) sets: [usize; SETS],
    /// Choices of correction curve.
    pub(super) curves: usize,
}

impl Layout {
    /// Mixer inputs in use.
    pub(super) fn inputs(&self) -> usize {
        self.direct.len() + self.keyed.len() + 1
    }

    /// Slots that a prior gives.
    pub(super) fn slots(&self) -> usize {
        self.direct.iter().chain(self.keyed).sum()
    }

    /// Choices of weights of all mixers.
    pub(super) fn rows(&self) -> usize {
        self.sets.iter().sum()
    }

    /// Points of all correction curves.
    pub(super) fn curve_points(&self) -> usize {
        self.curves * CURVE
    }

    /// A prior that knows nothing.
    pub(super) fn blank(&self) -> StagePrior {
        let curve = (0..CURVE as i32).map(|i| probability((i - 16) * CURVE_STEP) << 16);
        StagePrior {
            slots: vec![BitEstimate::BLANK; self.slots()],
            weights: vec![[ONE * 3 / 10; INPUTS]; self.rows()],
            second: vec![[ONE / 3; SETS]; self.curves],
            curves: curve.cycle().take(self.curve_points()).collect(),
        }
    }
}

/// The contexts of one decision.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Contexts {
    pub(super) direct: [usize; MOST_DIRECT],
    /// Key, and what it starts from.
    pub(super) keyed: [(u32, usize); MOST_KEYED],
    pub(super) sets: [usize; SETS],
    pub(super) curve: usize,
}

/// Adaptive state of one kind of decision; predict, then update, in turn.
#[derive(Debug, Clone)]
pub(super) struct Stage {
    layout: &'static Layout,
    prior: &'static StagePrior,
    slots: Vec<BitEstimate>,
    keyed: Vec<Vec<(u32, BitEstimate)>>,
    weights: Vec<[i32; INPUTS]>,
    second: Vec<[i32; SETS]>,
    curves: Vec<u32>,
    last: Last,
    /// How fast weights follow, in 1/2^20 of odds times error.
    pub(super) weight_rate: i32,
    /// Decisions counted for training.
    pub(super) counts: Option<Box<VisitCounts>>,
}

/// Counts of decisions in each context within one chunk: all of them, and those that were `true`.
#[derive(Debug, Clone, Default)]
pub struct VisitCounts {
    /// By context.
    direct: Vec<(u32, u32)>,
    /// By the context whose estimate a keyed one starts from, and by key.
    keyed: BTreeMap<(usize, u32), (u32, u32)>,
}

/// What the last prediction was made of.
#[derive(Debug, Clone, Copy, Default)]
struct Last {
    places: [usize; MOST_DIRECT],
    keyed: [usize; MOST_KEYED],
    /// BitEstimate of the prior that each keyed context started from.
    starts: [usize; MOST_KEYED],
    odds: [i32; INPUTS],
    sets: [usize; SETS],
    mixed: [u32; SETS],
    mixed_odds: [i32; SETS],
    second: usize,
    both: u32,
    curve: usize,
}

/// No key: labels and their pairs stay below.
const NO_KEY: u32 = u32::MAX;
/// How fast weights follow while coding.
const WEIGHT_RATE: i32 = 3;
/// How fast correction curves follow: 1/2^n of the error.
const CURVE_SHIFT: u32 = 7;

impl Stage {
    pub(super) fn new(layout: &'static Layout, prior: &'static StagePrior) -> Self {
        Self {
            layout,
            prior,
            slots: prior.slots.clone(),
            keyed: layout.keyed.iter().map(|_| vec![(NO_KEY, BitEstimate::BLANK); KEYED_PLACES]).collect(),
            weights: prior.weights.clone(),
            second: prior.second.clone(),
            curves: prior.curves.clone(),
            last: Last::default(),
            weight_rate: WEIGHT_RATE,
            counts: None,
        }
    }

    /// Probability of `true`, in 1/65536, from 1 to 65535.
    pub(super) fn predict(&mut self, contexts: &Contexts) -> u32 {
        let mut first = 0;
        let mut input = 0;
        for (&values, &context) in self.layout.direct.iter().zip(&contexts.direct) {
            debug_assert!(context < values, "context {input} is {context} of {values}");
            self.last.places[input] = first + context;
            self.last.odds[input] = self.slots[first + context].odds();
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
            self.last.odds[input] = held.1.odds();
            first += values;
            input += 1;
        }
        self.last.odds[input] = 256;
        self.mix(contexts)
    }

    fn mix(&mut self, contexts: &Contexts) -> u32 {
        let mut first = 0;
        for (i, (&choices, &choice)) in self.layout.sets.iter().zip(&contexts.sets).enumerate() {
            debug_assert!(choice < choices);
            self.last.sets[i] = first + choice;
            let odds = weigh(&self.weights[first + choice], &self.last.odds);
            (self.last.mixed[i], self.last.mixed_odds[i]) = (probability(odds), odds);
            first += choices;
        }
        self.last.second = contexts.curve;
        let odds = weigh(&self.second[contexts.curve], &self.last.mixed_odds);
        self.last.both = probability(odds);
        let along = odds + 16 * CURVE_STEP;
        let (step, rest) = ((along / CURVE_STEP) as usize, (along % CURVE_STEP) as u64);
        let at = contexts.curve * CURVE + step;
        let between = u64::from(self.curves[at]) * (256 - rest) + u64::from(self.curves[at + 1]) * rest;
        self.last.curve = if rest < 128 { at } else { at + 1 };
        let corrected = (between >> 24) as u32;
        (probability(odds) + corrected).div_ceil(2).clamp(1, 65_535)
    }

    /// Learns what the decision was.
    pub(super) fn update(&mut self, bit: bool) {
        let goal = if bit { 65_536 } else { 0 };
        for (&mixed, row) in self.last.mixed.iter().zip(self.last.sets) {
            follow(&mut self.weights[row], &self.last.odds, (goal - mixed as i32) * self.weight_rate);
        }
        let error = (goal - self.last.both as i32) * self.weight_rate / 2;
        follow(&mut self.second[self.last.second], &self.last.mixed_odds, error);
        let point = &mut self.curves[self.last.curve];
        let goal = if bit { i64::from(u32::MAX) } else { 0 };
        *point = (i64::from(*point) + ((goal - i64::from(*point)) >> CURVE_SHIFT)) as u32;
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

    /// Takes over weights and curves.
    pub(super) fn carry(&mut self, before: &Self) {
        self.weights.clone_from(&before.weights);
        self.second.clone_from(&before.second);
        self.curves.clone_from(&before.curves);
    }

    /// Puts weights and curves as they are now into a prior.
    pub(super) fn teach(&self, prior: &mut StagePrior) {
        prior.weights.clone_from(&self.weights);
        prior.second.clone_from(&self.second);
        prior.curves.clone_from(&self.curves);
    }
}

/// Largest weight either way; keeps all sums within 32 bits.
const MOST_WEIGHT: i32 = (1 << 19) - 1;

fn weigh<const N: usize>(weights: &[i32; N], odds: &[i32; N]) -> i32 {
    let sum: i32 = weights.iter().zip(odds).map(|(&weight, &odds)| (weight >> 5) * odds).sum();
    (sum >> 11).clamp(-MAX_ODDS, MAX_ODDS)
}

fn follow<const N: usize>(weights: &mut [i32; N], odds: &[i32; N], error: i32) {
    for (weight, &odds) in weights.iter_mut().zip(odds) {
        *weight = (*weight + ((odds * error + (1 << 19)) >> 20)).clamp(-MOST_WEIGHT, MOST_WEIGHT);
    }
}

impl VisitCounts {
    /// Each context with its decisions and those that were `true`; a context that starts several keyed ones comes up once for
    /// each key.
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

/// Log odds as a prior stores them.
pub(super) fn stored_odds(p: u32) -> i16 {
    odds(p) as i16
}
