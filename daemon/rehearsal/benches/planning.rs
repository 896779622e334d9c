//! `cargo bench -p scenecast --bench planning`: time of one plan on a map of 200 x 200 cells, half of it seen.

use scenecast_core::Area;
use scenecast_protocol::coordinates::DecimetrePoint;
use scenecast_protocol::directive::{Fence, PlannerKind, Polygon, Utility};
use scenecast_protocol::map::{Cell, LabelGrid};
use scenecast_vehicle::{Footprint, Steering};

const CELL_M: f64 = 0.25;
const SIDE: i32 = 200;

fn main() {
    divan::main();
}

/// Patches of eight labels on the western half.
fn map() -> LabelGrid {
    let label = |x: i32, y: i32| ((x / 13 * 5 + y / 17 * 3) % 8 + 1) as u8;
    (0..SIDE).flat_map(|y| (0..SIDE / 2).map(move |x| (Cell::new(x, y), label(x, y)))).collect()
}

/// The map, the utility, and a vehicle whose camera covers 4 x 4 or 8 x 8 cells.
fn steering(kind: PlannerKind, sight_cells: f64) -> (Steering, LabelGrid, Utility) {
    let side = f64::from(SIDE) * CELL_M;
    let sight = sight_cells * CELL_M;
    let area = Area { west: 0.0, south: 0.0, east: side, north: side };
    let mut steering =
        Steering::new(area, Footprint { across: sight, along: sight, leg_overlap: 0.0 }, CELL_M, kind, 0.5);
    let place = |x, y| DecimetrePoint::new(x, y);
    let fence = Polygon(vec![place(0, 0), place(480, 20), place(500, 480), place(30, 500)]);
    let keep_out = Polygon(vec![place(200, 200), place(260, 210), place(240, 280)]);
    steering.set_fence(&Fence { fence: Some(fence), keep_outs: vec![keep_out], return_point: None });
    let weights = [(2, 100), (5, 40), (7, -30)].into_iter().collect();
    (steering, map(), Utility { exploration: 5, weights, ..Utility::default() })
}

#[divan::bench(args = ["lawnmower", "greedy", "horizon"], consts = [4, 8], sample_count = 20)]
fn plan<const SIGHT: u32>(bencher: divan::Bencher<'_, '_>, name: &str) {
    let kind = PlannerKind::from_name(name).expect("a planner");
    let (mut steering, map, utility) = steering(kind, f64::from(SIGHT));
    let mut version = 0;
    bencher.bench_local(|| {
        version += 1;
        steering.replan();
        steering.next((12.5, 25.0), (&map, version), Some(&utility), 800.0)
    });
}

/// The remaining distance is so short that `horizon` plans it to its end, with nearly all of the map in reach.
#[divan::bench(consts = [4, 8], sample_count = 20)]
fn plan_to_the_end<const SIGHT: u32>(bencher: divan::Bencher<'_, '_>) {
    let (mut steering, map, utility) = steering(PlannerKind::Horizon, f64::from(SIGHT));
    let mut version = 0;
    bencher.bench_local(|| {
        version += 1;
        steering.replan();
        steering.next((4.0, 4.0), (&map, version), Some(&utility), 8.0 * f64::from(SIGHT))
    });
}
