//! A virtual camera over a floor, and the map of habitats that it gives.

use super::drift::drift;
use super::site::{CELL_M, CELL_PX, Site};
use crate::cpu_meter::CpuMeter;
use image::RgbImage;
use scene_model::habitats::{Habitats, LabelTree, MeasuredValues, measure};
use scene_model::project::{DownCamera, Pose};
use scenecast_worlds::scoring::TimedCell;
use std::collections::BTreeMap;

/// Columns and rows of a frame, and the pixels between two frames and between two lines.
const FRAME: (u32, u32) = (640, 480);
const STEP: (u32, u32) = (100, 380);
/// Time between two frames, and for the turn between two lines, seconds.
const INTERVAL_S: f64 = 2.0;
const TURN_S: f64 = 60.0;
/// Cells that are seen in so many first frames are seen early.
const EARLY_FRAMES: usize = 48;
/// Frames that are taken in five minutes.
const FIVE_MINUTES: usize = 150;
/// Frames at the end of a flight that show nothing new, so that the map is corrected.
const REST: u32 = 150;
const MAX_LABELS: u32 = 16;

/// The order in which a floor is seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Path {
    /// Line by line from the north-west.
    Along,
    /// The same frames, the last one first.
    Back,
    /// Column by column instead of line by line.
    Across,
}

/// The map at one time.
pub(super) struct Labelled {
    cells: BTreeMap<(i32, i32), u32>,
    tree: LabelTree,
}

/// The map of a flight: when all has been seen, and after a rest.
pub struct Flight {
    pub(super) under_way: Labelled,
    pub(super) rested: Labelled,
    first_seen_s: BTreeMap<(i32, i32), f64>,
    /// What each cell looks like over all its sights, by (y, x).
    appearance: Vec<((i32, i32), MeasuredValues)>,
    /// When the first frames are over.
    early_s: f64,
    pub(super) relabelled: f64,
    pub(super) cpu: f64,
}

impl Flight {
    pub(super) fn over(site: &Site, image: &RgbImage, path: Path) -> Self {
        let pitch = CELL_M / f64::from(CELL_PX);
        let camera = DownCamera { metres_per_pixel: pitch, altitude_m: 4.0 };
        let mut habitats = Habitats::new(MAX_LABELS);
        let mut first_seen_s = BTreeMap::new();
        let (mut maps, mut relabelled) = (Vec::<BTreeMap<(i32, i32), u32>>::new(), Vec::new());
        let size = (FRAME.0.min(image.width()), FRAME.1.min(image.height()));
        let (corners, in_line) = corners(image.dimensions(), size, path);
        let time_of = |index: usize| index as f64 * INTERVAL_S + (index / in_line) as f64 * TURN_S;
        let meter = CpuMeter::start();
        for (index, &(left, top)) in corners.iter().enumerate() {
            let frame = image::imageops::crop_imm(image, left, top, size.0, size.1).to_image();
            let points = measure(&frame, CELL_PX as f32);
            let middle = |from: u32, length: u32| (f64::from(from) + f64::from(length) / 2.0) * pitch;
            let pose = Pose { x: middle(left, size.0), y: -middle(top, size.1), z: 0.0, yaw_rad: 0.0 };
            let places = camera.project(size.0, size.1, &pose, &Habitats::as_words(&points));
            habitats.add(size, &points, &places, CELL_M);
            habitats.update();
            let map = cells(&habitats);
            let time_s = time_of(index);
            for &place in map.keys() {
                first_seen_s.entry(place).or_insert(time_s);
            }
            if let Some(before) = maps.len().checked_sub(FIVE_MINUTES).and_then(|at| maps.get(at)) {
                let changed = before.iter().filter(|(place, label)| map.get(place) != Some(label)).count();
                relabelled.push(changed as f64 / before.len().max(1) as f64);
            }
            maps.push(map);
        }
        let cpu = meter.ms() / 1000.0 / (corners.len() as f64 * INTERVAL_S);
        let under_way = Labelled::of(&habitats, site);
        for _ in 0..REST {
            habitats.add(size, &[], &[], CELL_M);
            habitats.update();
        }
        let late = &relabelled[relabelled.len() / 2..];
        let relabelled = late.iter().fold(0.0, |sum, share| sum + share) / late.len().max(1) as f64;
        let (appearance, early_s) = (habitats.appearance(), time_of(EARLY_FRAMES));
        Self { under_way, rested: Labelled::of(&habitats, site), first_seen_s, appearance, early_s, relabelled, cpu }
    }

    /// The share of cells whose label the rest has corrected.
    pub(super) fn corrected(&self) -> f64 {
        let (before, after) = (&self.under_way.cells, &self.rested.cells);
        after.iter().filter(|(place, label)| before.get(place) != Some(label)).count() as f64
            / after.len().max(1) as f64
    }

    /// How far cells of a class look different because they were seen in the first frames.
    pub(super) fn drift(&self, class: impl Fn((i32, i32)) -> Option<u32>) -> Option<f64> {
        let seen = |&((y, x), values): &((i32, i32), MeasuredValues)| {
            let is_early = *self.first_seen_s.get(&(x, y))? < self.early_s;
            Some((class((x, y))?, is_early, values))
        };
        drift(self.appearance.iter().filter_map(seen))
    }

    /// The cells of a map that are of a known class.
    pub(super) fn timed(
        &self,
        map: &Labelled,
        class: impl Fn((i32, i32)) -> Option<u32>,
    ) -> BTreeMap<(i32, i32), TimedCell> {
        let timed = |(&place, &label): (&(i32, i32), &u32)| {
            let first_seen_s = *self.first_seen_s.get(&place)?;
            Some((place, TimedCell { label, class: class(place)?, first_seen_s }))
        };
        map.cells.iter().filter_map(timed).collect()
    }
}

fn cells(habitats: &Habitats) -> BTreeMap<(i32, i32), u32> {
    habitats.map().iter().map(|cell| ((cell.x, cell.y), cell.topic.0)).collect()
}

impl Labelled {
    /// The map without cells that reach beyond the image.
    fn of(habitats: &Habitats, site: &Site) -> Self {
        let (columns, rows) = site.size();
        let is_inside = |&(x, y): &(i32, i32)| (0..columns as i32).contains(&x) && (-(rows as i32)..0).contains(&y);
        let mut cells = cells(habitats);
        cells.retain(|place, _| is_inside(place));
        Self { cells, tree: habitats.tree().clone() }
    }

    /// The cells with their labels, of which at most `count` are told apart.
    pub(super) fn labels(&self, count: usize) -> impl Iterator<Item = ((i32, i32), u32)> {
        self.cells.iter().map(move |(&place, &label)| (place, self.tree.at(label, count)))
    }

    pub(super) fn label(&self, place: (i32, i32), count: usize) -> Option<u32> {
        self.cells.get(&place).map(|&label| self.tree.at(label, count))
    }

    /// The number of different labels on the map.
    pub(super) fn count(&self) -> usize {
        self.cells.values().collect::<std::collections::BTreeSet<_>>().len()
    }
}

/// North-west corners of the frames, and the number of frames of a line.
fn corners((width, height): (u32, u32), size: (u32, u32), path: Path) -> (Vec<(u32, u32)>, usize) {
    let places = |length: u32, frame: u32, step: u32| -> Vec<u32> {
        let free = length - frame;
        (0..free.div_ceil(step).max(1)).map(|i| i * step).chain((free > 0).then_some(free)).collect()
    };
    let (step, lines) = match path {
        Path::Across => ((STEP.0, FRAME.0 - STEP.0), true),
        _ => (STEP, false),
    };
    let (fast, slow) = match lines {
        true => (places(height, size.1, step.0), places(width, size.0, step.1)),
        false => (places(width, size.0, step.0), places(height, size.1, step.1)),
    };
    let mut corners = Vec::new();
    for (line, &slow) in slow.iter().enumerate() {
        let turned = (0..fast.len()).map(|i| fast[if line % 2 == 0 { i } else { fast.len() - 1 - i }]);
        corners.extend(turned.map(|fast| if lines { (slow, fast) } else { (fast, slow) }));
    }
    if path == Path::Back {
        corners.reverse();
    }
    (corners, fast.len())
}
