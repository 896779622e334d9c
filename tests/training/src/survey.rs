//! A survey step by step: a swath of new cells, and the sampler's changes of old ones.

use crate::MapRng;
use crate::scene::{neighbours, sampler_noise};
use scenecast_protocol::map_codec::LabelRaster;

/// The changes of explored cells in each step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Flips {
    /// Border cells in a million that take a neighbour's label.
    pub border: usize,
    /// Explored cells in a million that take any label.
    pub anywhere: usize,
    /// Explored cells in a million that take the label of most of their neighbours.
    pub settling: usize,
}

/// A lawnmower survey over a scene.
#[derive(Debug, Clone)]
pub struct Survey {
    scene: LabelRaster,
    seen: LabelRaster,
    rng: MapRng,
    flips: Flips,
    /// Height of a leg and length of a step in cells.
    swath: usize,
    stride: usize,
    step: usize,
}

impl Survey {
    /// A survey with an unexplored map, which is complete after about `steps` steps.
    pub fn new(seed: u64, scene: LabelRaster, flips: Flips, steps: usize) -> Self {
        let (width, height) = (scene.width, scene.height);
        let legs = (1..=steps).min_by_key(|&legs| {
            let (swath, stride) = (height.div_ceil(legs), width.div_ceil((steps / legs).max(1)));
            swath.abs_diff(stride)
        });
        let legs = legs.unwrap_or(1);
        let (swath, stride) = (height.div_ceil(legs), width.div_ceil((steps / legs).max(1)));
        let seen = LabelRaster::uniform(width, height, 0);
        Self { scene, seen, rng: MapRng::new(seed), flips, swath, stride, step: 0 }
    }

    /// The map as the vehicle sees it.
    pub fn map(&self) -> &LabelRaster {
        &self.seen
    }

    /// Advances the survey by one step.
    pub fn advance(&mut self) {
        sampler_noise(&mut self.rng, &mut self.seen, self.flips.border, self.flips.anywhere);
        settle(&mut self.rng, &mut self.seen, self.flips.settling);
        let steps_a_leg = self.scene.width.div_ceil(self.stride);
        let (leg, along) = (self.step / steps_a_leg, self.step % steps_a_leg);
        let along = if leg % 2 == 0 { along } else { steps_a_leg - 1 - along };
        let rows = (leg * self.swath).min(self.scene.height)..((leg + 1) * self.swath).min(self.scene.height);
        let columns = along * self.stride..((along + 1) * self.stride).min(self.scene.width);
        for row in rows {
            for column in columns.clone() {
                self.seen.set(column, row, self.scene.get(column, row));
            }
        }
        self.step += 1;
    }
}

fn settle(rng: &mut MapRng, raster: &mut LabelRaster, settling: usize) {
    for i in (0..raster.labels.len()).filter(|_| settling > 0) {
        if raster.labels[i] == 0 || !rng.happens(settling) {
            continue;
        }
        let mut votes = [0u8; 256];
        neighbours(raster, i).filter(|&label| label != 0).for_each(|label| votes[usize::from(label)] += 1);
        let most = votes.iter().copied().max().unwrap_or(0);
        if votes[usize::from(raster.labels[i])] < most {
            raster.labels[i] = votes.iter().position(|&v| v == most).map_or(raster.labels[i], |label| label as u8);
        }
    }
}
