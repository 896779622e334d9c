//! Lessons for the prior: changes like those of a mission, over procedural maps.

use crate::{Flips, MapRng, MapScene, Survey, sampler_noise};
use scenecast_protocol::map::{Cell, Rect};
use scenecast_protocol::map_codec::LabelRaster;

/// A change of a part of a map.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Lesson {
    /// The map that both ends hold.
    pub base: LabelRaster,
    /// The map after the change; equal to the base outside `rect`.
    pub target: LabelRaster,
    /// The patch that the coder codes.
    pub rect: Rect,
}

/// Lessons of one scene: its stills, or a survey over it.
pub fn lessons(seed: u64) -> Vec<Lesson> {
    let mut rng = MapRng::new(seed);
    let (width, height) = (rng.within(48, 224), rng.within(48, 224));
    let labels = rng.pick(&[2, 3, 4, 6, 8, 8, 10, 12, 16, 16, 24]);
    let scene = rng.pick(&[
        MapScene::SpatialCrp,
        MapScene::Potts,
        MapScene::Potts,
        MapScene::Fractal,
        MapScene::Colonies,
        MapScene::Colonies,
    ]);
    let mut raster = scene.draw(&mut rng, width, height, labels);
    let (border, anywhere) = (rng.pick(&[0, 0, 20_000, 100_000]), rng.pick(&[0, 0, 1000, 10_000]));
    sampler_noise(&mut rng, &mut raster, border, anywhere);
    if rng.happens(300_000) { stills(&mut rng, &raster) } else { surveys(&mut rng, raster) }
}

/// Parts of a scene on an unexplored base.
fn stills(rng: &mut MapRng, raster: &LabelRaster) -> Vec<Lesson> {
    let mut target = raster.clone();
    if rng.happens(400_000) {
        let mut survey = Survey::new(0, target, STEADY, 20);
        (0..rng.within(3, 20)).for_each(|_| survey.advance());
        target = survey.map().clone();
    }
    if rng.happens(200_000) {
        let ground = rng.pick(&target.labels);
        target.labels.iter_mut().filter(|label| **label == ground).for_each(|label| *label = 0);
    }
    let base = LabelRaster::uniform(target.width, target.height, 0);
    (0..3).filter_map(|_| part(rng, &base, &target)).collect()
}

const STEADY: Flips = Flips { border: 0, anywhere: 0, settling: 0 };

/// One step or several steps of a survey.
fn surveys(rng: &mut MapRng, raster: LabelRaster) -> Vec<Lesson> {
    let flips = Flips {
        border: rng.pick(&[0, 1000, 5000, 5000, 10_000, 30_000, 30_000, 60_000]),
        anywhere: rng.pick(&[0, 0, 0, 300, 2000, 10_000, 10_000]),
        settling: rng.pick(&[0, 0, 0, 5000, 50_000]),
    };
    let steps = rng.pick(&[10, 20, 40, 80]);
    let mut survey = Survey::new(rng.below(1 << 30) as u64, raster, flips, steps);
    let mut lessons = Vec::new();
    let mut base = survey.map().clone();
    let mut due = 0;
    for _ in 0..steps + steps / 4 {
        survey.advance();
        if due > 0 {
            due -= 1;
            continue;
        }
        if rng.happens(400_000) {
            lessons.extend(part(rng, &base, survey.map()));
        }
        base = survey.map().clone();
        due = rng.pick(&[0, 0, 0, 0, 1, 3, 7]);
    }
    lessons
}

/// A patch of random size around some change, cut down to its changes.
fn part(rng: &mut MapRng, base: &LabelRaster, target: &LabelRaster) -> Option<Lesson> {
    let changed: Vec<usize> = (0..base.labels.len()).filter(|&i| base.labels[i] != target.labels[i]).collect();
    if changed.is_empty() {
        return None;
    }
    let middle = rng.pick(&changed);
    let side = rng.pick(&[24, 32, 48, 64, 96, 128, 224]);
    let (width, height) = (rng.within(side / 2, side + 1), rng.within(side / 2, side + 1));
    let near = |i: usize| {
        (i % base.width).abs_diff(middle % base.width) <= width / 2
            && (i / base.width).abs_diff(middle / base.width) <= height / 2
    };
    let inside: Vec<usize> = changed.into_iter().filter(|&i| near(i)).collect();
    let cell = |i: usize| Cell::new((i % base.width) as i32, (i / base.width) as i32);
    let rect = Rect::around(inside.iter().map(|&i| cell(i)))?;
    let mut part = base.clone();
    inside.into_iter().for_each(|i| part.labels[i] = target.labels[i]);
    Some(Lesson { base: base.clone(), target: part, rect })
}
