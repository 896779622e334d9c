//! Training the prior on procedural maps.

use super::arith::BitCoder;
use super::canvas::Canvas;
use super::model::Model;
use super::prior::{Prior, StagePrior};
use super::slot::Slot;
use super::stage::{Stage, Tally};
use super::{LastRow, order};
use crate::map_codec::lattice::Lattice;
use crate::map_codec::procedural::{Lesson, lessons};

/// Procedural scenes that the shipped prior is trained on, with seed 1.
pub const PRIOR_SCENES: u64 = 1500;

/// The prior's table, trained on the lessons of `scenes` procedural scenes; the same seed gives the same table.
///
/// `progress` hears in a thousandth how far it is. Floating point is used here and only here, for sums and quotients.
pub fn train_prior(seed: u64, scenes: u64, progress: &mut dyn FnMut(u64)) -> Vec<u8> {
    let mut prior = Prior::blank();
    let mut pass = 0;
    let mut each = |prior: &Prior, lesson: &mut dyn FnMut(Model, &Lesson) -> Model| {
        // The model borrows its prior for the length of the program: a handful of small tables.
        let prior: &'static Prior = Box::leak(Box::new(prior.clone()));
        let mut carried: Option<Model> = None;
        for scene in 0..scenes {
            for one in lessons(seed.wrapping_mul(1_000_003).wrapping_add(scene)) {
                let mut model = Model::new(prior);
                if let Some(before) = &carried {
                    model.carry_weights(before);
                }
                carried = Some(lesson(model, &one));
            }
            progress((pass * scenes + scene) * 1000 / (PASSES * scenes));
        }
        pass += 1;
        carried.unwrap_or_else(|| Model::new(prior))
    };
    for refined in [false, true] {
        let mut sums = Sums::of(&prior, refined);
        each(&prior, &mut |mut model, lesson| {
            for stage in model.stages() {
                stage.tally = Some(Box::default());
            }
            run(&mut model, lesson);
            sums.add(&mut model);
            model
        });
        sums.settle(&mut prior);
    }
    for rate in [6, 2] {
        let mut last = each(&prior, &mut |mut model, lesson| {
            for stage in model.stages() {
                stage.weight_rate = rate;
            }
            run(&mut model, lesson);
            model
        });
        for (stage, prior) in last.stages().into_iter().zip(prior.stages()) {
            stage.teach(prior);
        }
    }
    prior.to_bytes()
}

const PASSES: u64 = 4;

struct Nowhere;

impl BitCoder for Nowhere {
    fn code(&mut self, bit: bool, _: u32) -> bool {
        bit
    }
}

fn run(model: &mut Model, lesson: &Lesson) {
    let rect = lesson.rect;
    let base = lesson.base.to_grid();
    let mut canvas = Canvas::new(Lattice::whole(&base), rect);
    let (width, height) = (rect.width as usize, rect.height as usize);
    for (column, row) in order(width, height, LastRow(width)) {
        let wanted = lesson.target.get(column + rect.x as usize, row + rect.y as usize);
        let coded = model.code_cell(&mut Nowhere, &mut canvas, (column, row), wanted);
        debug_assert!(coded.is_some());
    }
}

/// What the lessons tell about one slot.
#[derive(Debug, Clone, Copy, Default)]
struct SlotSums {
    /// Worth of a visit beyond the first of the same chunk: 1 = all chunks alike, 0 = every chunk its own.
    alike: f64,
    visits: f64,
    ones: f64,
    ones_squared: f64,
    ones_visits: f64,
    visits_squared: f64,
    weight: f64,
    share: f64,
}

impl SlotSums {
    fn add(&mut self, (visits, ones): (u32, u32)) {
        if visits == 0 {
            return;
        }
        let (n, k) = (f64::from(visits), f64::from(ones));
        self.visits += n;
        self.ones += k;
        self.ones_squared += k * k;
        self.ones_visits += k * n;
        self.visits_squared += n * n;
        let weight = n / (1.0 + (n - 1.0) * (1.0 - self.alike));
        self.weight += weight;
        self.share += weight * k / n;
    }

    /// Beta-binomial by moments: the mean, and how many visits it is worth in a new chunk.
    fn settle(&self) -> Slot {
        if self.visits == 0.0 {
            return Slot::BLANK;
        }
        let p = (self.share + 0.02) / (self.weight + 0.04);
        let spread = self.ones_squared - 2.0 * p * self.ones_visits + p * p * self.visits_squared;
        let pairs = self.visits_squared - self.visits;
        let unlike = if pairs > 0.0 { (spread / (p * (1.0 - p)) - self.visits) / pairs } else { 1.0 };
        let worth =
            (1.0 / unlike.clamp(0.0005, 1.0) - 1.0).min(self.visits / 2.0).clamp(0.0, f64::from(Slot::MOST_VISITS));
        Slot { p: (p * 4_294_967_295.0) as u32, visits: worth as u16 }
    }
}

struct Sums([Vec<SlotSums>; 4]);

impl Sums {
    /// `refined`: weigh chunks by what `prior` says about how alike they are.
    fn of(prior: &Prior, refined: bool) -> Self {
        let alike = |slot: &Slot| if refined { 1.0 - 1.0 / (f64::from(slot.visits) + 1.0) } else { 1.0 };
        let sums = |stage: &StagePrior| {
            stage.slots.iter().map(|slot| SlotSums { alike: alike(slot), ..SlotSums::default() }).collect()
        };
        Self([sums(&prior.calm), sums(&prior.flip), sums(&prior.unseen), sums(&prior.label)])
    }

    fn add(&mut self, model: &mut Model) {
        for (sums, stage) in self.0.iter_mut().zip(model.stages()) {
            let Tally { direct, keyed } = *stage.tally.take().unwrap_or_default();
            sums.iter_mut().zip(direct).for_each(|(sum, tally)| sum.add(tally));
            keyed.into_iter().for_each(|((start, _), tally)| sums[start].add(tally));
        }
    }

    fn settle(&self, prior: &mut Prior) {
        for (sums, stage) in self.0.iter().zip(prior.stages()) {
            stage.slots = sums.iter().map(SlotSums::settle).collect();
        }
    }
}

impl Prior {
    fn stages(&mut self) -> [&mut StagePrior; 4] {
        [&mut self.calm, &mut self.flip, &mut self.unseen, &mut self.label]
    }
}

impl Model {
    fn stages(&mut self) -> [&mut Stage; 4] {
        [&mut self.calm, &mut self.flip, &mut self.unseen, &mut self.label]
    }

    fn carry_weights(&mut self, before: &Self) {
        self.calm.carry(&before.calm);
        self.flip.carry(&before.flip);
        self.unseen.carry(&before.unseen);
        self.label.carry(&before.label);
    }
}
