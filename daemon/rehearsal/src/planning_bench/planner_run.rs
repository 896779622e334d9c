//! The run of one planner on one scene.

use super::scene::{CELL_M, Scene};
use scenecast_core::Area;
use scenecast_protocol::coordinates::{DecimetrePoint, WorldPoint};
use scenecast_protocol::directive::{Fence, PlannerKind, Polygon};
use scenecast_protocol::map::{Cell, LabelGrid};
use scenecast_vehicle::{Course, Footprint, Steering};
use scenecast_worlds::{length_m, stretches_outside};
use sim_channel::RandomStream;

/// Edge of the camera's footprint, metres: eight cells.
const SIGHT_M: f64 = 2.0;
/// Minimum distance between the vehicle and an outline, metres.
const CLEARANCE_M: f64 = 0.5;
/// Distance limit as a share of the path of full coverage.
const SHARE: f64 = 0.4;
/// Maximum number of legs, more than any run needs.
const MAX_LEGS: usize = 20_000;

/// The vehicle's orders at the start of a run.
#[derive(Debug, Clone)]
pub(crate) struct Task {
    pub fence: Fence,
    pub start: (f64, f64),
    /// Distance limit, metres, with the return path to the start.
    pub limit_m: f64,
    /// Mean utility in the scene of a metre on which every cell in view is new.
    pub mean_per_m: f64,
}

/// Track and utility of a run.
#[derive(Debug)]
pub(crate) struct PlannerRun {
    pub track: Vec<(f64, f64)>,
    /// Sum of the weights of all cells that were seen.
    pub utility: f64,
}

impl Task {
    /// Draws a fence with cut corners, one or two keep-outs, and a start inside.
    pub fn draw(scene: &Scene, seed: u64) -> Self {
        let mut rng = RandomStream::new(seed, &[0x91A7]);
        let Area { east, north, .. } = scene.area;
        let place = |x: f64, y: f64| DecimetrePoint::nearest(WorldPoint::new(x, y)).unwrap_or_default();
        let cut = |rng: &mut RandomStream| (0.03 + 0.12 * rng.uniform()) * east.min(north);
        let [a, b, c, d] = [cut(&mut rng), cut(&mut rng), cut(&mut rng), cut(&mut rng)];
        let fence = [
            (a, 0.0),
            (east - b, 0.0),
            (east, b),
            (east, north - c),
            (east - c, north),
            (d, north),
            (0.0, north - d),
            (0.0, a),
        ];
        let fence = Polygon(fence.iter().map(|&(x, y)| place(x, y)).collect());
        let keep_outs: Vec<Polygon> = (0..=rng.below(2))
            .map(|_| {
                let (x, y) = ((0.2 + 0.6 * rng.uniform()) * east, (0.2 + 0.6 * rng.uniform()) * north);
                let r = (0.04 + 0.06 * rng.uniform()) * east.min(north);
                Polygon(vec![place(x - r, y - r), place(x + r, y - 0.5 * r), place(x + 0.4 * r, y + r)])
            })
            .collect();
        let fence = Fence { fence: Some(fence), keep_outs, return_point: None };
        let clear = |p: (f64, f64)| scenecast_vehicle::planning::Bounds::new(&fence, SIGHT_M / 2.0).allows(p);
        let mut start = (east / 2.0, north / 2.0);
        for _ in 0..1000 {
            start = (rng.uniform() * east, rng.uniform() * north);
            if clear(start) {
                break;
            }
        }
        let bounds = scenecast_vehicle::planning::Bounds::new(&fence, 0.0);
        let inside: Vec<Cell> = cells(scene.area).filter(|&c| bounds.holds(middle(c))).collect();
        let area = inside.len() as f64 * CELL_M * CELL_M;
        let utility: f64 = inside.iter().map(|&c| scene.utility.weight(scene.labels.get(c))).sum();
        let fence = Fence { return_point: DecimetrePoint::nearest(WorldPoint::new(start.0, start.1)), ..fence };
        Self { fence, start, limit_m: SHARE * area / SIGHT_M, mean_per_m: utility * SIGHT_M / area.max(1e-9) }
    }
}

impl PlannerRun {
    pub fn metres(&self) -> f64 {
        length_m(&self.track)
    }

    /// Breaches of fence, keep-outs and limit, and an end that is not the return point.
    pub fn violations(&self, task: &Task) -> usize {
        let end = self.track.last().copied().unwrap_or_default();
        let is_lost = (end.0 - task.start.0).hypot(end.1 - task.start.1) > CLEARANCE_M;
        stretches_outside(&self.track, &task.fence) + usize::from(self.metres() > task.limit_m) + usize::from(is_lost)
    }
}

/// The part of the sea floor that the planner knows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum MapKnowledge {
    /// The cells that the vehicle has seen so far.
    Seen,
    /// The whole map from the start, which gives an upper bound of the utility.
    All,
}

/// Runs a planner until the rest of the limit is needed for the return path, then returns.
pub(crate) fn run_planner(scene: &Scene, task: &Task, kind: PlannerKind, knowledge: MapKnowledge) -> PlannerRun {
    let sight = Footprint { across: SIGHT_M, along: SIGHT_M, leg_overlap: 0.0 };
    let mut steering = Steering::new(scene.area, sight, CELL_M, kind, CLEARANCE_M);
    steering.set_fence(&task.fence);
    let mut map = LabelGrid::default();
    let mut run = PlannerRun { track: vec![task.start], utility: 0.0 };
    let (mut at, mut version, mut is_back) = (task.start, 1, false);
    run.utility += look(scene, at, &mut map);
    for _ in 0..MAX_LEGS {
        let left_m = task.limit_m - run.metres();
        let known = if knowledge == MapKnowledge::All { &scene.labels } else { &map };
        let course = match is_back {
            true => steering.next_return(at),
            false => steering.next(at, (known, version), Some(&scene.utility), left_m),
        };
        match course {
            Course::Go(to) => {
                run.utility += go(scene, &mut steering, at, to, &mut map);
                run.track.push(to);
                (at, version) = (to, version + 1);
            }
            Course::LimitReached if !is_back => is_back = true,
            _ => break,
        }
    }
    run
}

/// Moves straight and takes a view each half footprint; returns the utility of the cells seen for the first time.
fn go(scene: &Scene, steering: &mut Steering, from: (f64, f64), to: (f64, f64), map: &mut LabelGrid) -> f64 {
    let looks = ((to.0 - from.0).hypot(to.1 - from.1) / (SIGHT_M / 2.0)).ceil().max(1.0) as u32;
    let place = |i: u32| {
        let t = f64::from(i) / f64::from(looks);
        (from.0 + t * (to.0 - from.0), from.1 + t * (to.1 - from.1))
    };
    let mut utility = 0.0;
    for at in (1..=looks).map(place) {
        steering.handle_view(at);
        utility += look(scene, at, map);
    }
    utility
}

fn look(scene: &Scene, at: (f64, f64), map: &mut LabelGrid) -> f64 {
    let reach = SIGHT_M / 2.0;
    let seen = Area { west: at.0 - reach, south: at.1 - reach, east: at.0 + reach, north: at.1 + reach };
    let mut utility = 0.0;
    for cell in cells(seen).filter(|&c| seen.contains(middle(c))) {
        let label = scene.labels.get(cell);
        if label != 0 && map.set(cell, label) == 0 {
            utility += scene.utility.weight(label);
        }
    }
    utility
}

fn cells(area: Area) -> impl Iterator<Item = Cell> {
    let cell = |metres: f64| (metres / CELL_M).floor() as i32;
    let (west, east) = (cell(area.west), cell(area.east));
    (cell(area.south)..=cell(area.north)).flat_map(move |y| (west..=east).map(move |x| Cell::new(x, y)))
}

fn middle(cell: Cell) -> (f64, f64) {
    ((f64::from(cell.x) + 0.5) * CELL_M, (f64::from(cell.y) + 0.5) * CELL_M)
}
