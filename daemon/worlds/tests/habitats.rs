//! The habitats of the scene model over procedural sea floors, flown in several orders and from several altitudes.

use image::{RgbImage, imageops};
use scene_model::habitats::{Habitats, measure};
use scene_model::project::{DownCamera, Pose};
use scenecast_worlds::patches;
use std::collections::BTreeMap;

/// Metres a pixel from the usual altitude.
const PITCH: f64 = 0.025;
/// More frames without a new cell than the map takes to rest.
const REST_FRAMES: usize = 120;

/// Adds a frame from `scale` times the usual altitude, with the place of its middle.
fn see(habitats: &mut Habitats, image: &RgbImage, scale: f64, (x, y): (f64, f64)) {
    let (columns, rows) = image.dimensions();
    let camera = DownCamera { metres_per_pixel: PITCH * scale, altitude_m: 4.0 * scale };
    let points = measure(image, (0.25 / camera.metres_per_pixel) as f32);
    let pose = Pose { x, y, z: 0.0, yaw_rad: 0.0 };
    let places = camera.project(columns, rows, &pose, &Habitats::as_words(&points));
    habitats.add((columns, rows), &points, &places, 0.25);
}

/// Sees part `k` of a floor, whose parts overlap, from the usual altitude.
fn pass(habitats: &mut Habitats, floor: &RgbImage, k: u32) {
    let image = imageops::crop_imm(floor, 0, 80 * k, 320, 240).to_image();
    see(habitats, &image, 1.0, (0.0, -2.0 * f64::from(k)));
    habitats.update();
}

fn labels(habitats: &Habitats) -> BTreeMap<(i32, i32), u32> {
    habitats.map().iter().map(|cell| ((cell.x, cell.y), cell.topic.0)).collect()
}

/// The labels of the cells of a floor whose frames are seen in an order, after a rest.
fn rested(order: impl Iterator<Item = u32>) -> BTreeMap<(i32, i32), u32> {
    let floor = patches(3, 320, 2400, 70, 7).image;
    let mut habitats = Habitats::new(16);
    order.for_each(|k| pass(&mut habitats, &floor, k));
    for _ in 0..REST_FRAMES {
        habitats.add((320, 240), &[], &[], 0.25);
        habitats.update();
    }
    labels(&habitats)
}

#[test]
fn a_corrected_map_is_the_same_in_any_order() {
    let (forward, back) = (rested(0..27), rested((0..27).rev()));
    let mut names = BTreeMap::new();
    for ((place, label), (_, other)) in forward.iter().zip(&back) {
        assert_eq!(names.entry(label).or_insert(other), &other, "{place:?}");
    }
    assert!(names.len() > 3 && forward.len() == back.len());
}

#[test]
fn hovering_over_one_place_changes_no_label_elsewhere() {
    let floor = patches(3, 320, 2400, 70, 7).image;
    let mut habitats = Habitats::new(16);
    (0..27).for_each(|k| pass(&mut habitats, &floor, k));
    // The correction at rest comes first.
    (0..REST_FRAMES).for_each(|_| pass(&mut habitats, &floor, 26));
    let before = labels(&habitats);
    (0..300).for_each(|_| pass(&mut habitats, &floor, 12));
    let after = labels(&habitats);
    let changed = before.iter().filter(|(place, label)| after[place] != **label).count();
    assert!(changed * 100 <= before.len(), "{changed} of {}", before.len());
}

/// The share of a floor's cells that have the same label where a copy of the floor is seen from `scale` times the altitude.
fn equal_from(scale: f64) -> f64 {
    let near = patches(3, 640, 2400, 70, 7).image;
    let size = |pixels: u32| (f64::from(pixels) / scale).round() as u32;
    let far = imageops::thumbnail(&near, size(640), size(2400));
    let mut habitats = Habitats::new(16);
    let mut over = |floor: &RgbImage, scale: f64, east_m: f64| {
        let metres_per_pixel = PITCH * scale;
        let (columns, rows) = (320.min(floor.width()), 240.min(floor.height()));
        for k in 0..200 {
            let top_m = 2.0 * f64::from(k);
            let top = (top_m / metres_per_pixel).round() as u32;
            if top + rows > floor.height() {
                return;
            }
            let left = (floor.width() - columns) / 2;
            let image = imageops::crop_imm(floor, left, top, columns, rows).to_image();
            let y = -f64::from(top) * metres_per_pixel - f64::from(rows) * metres_per_pixel / 2.0;
            see(&mut habitats, &image, scale, (east_m, y));
        }
    };
    over(&near, 1.0, 0.0);
    over(&far, scale, 50.0);
    habitats.learn();
    let cells = (-15..15).flat_map(|x| (-200..-10).map(move |y| (x, y)));
    let pairs = cells.filter_map(|(x, y)| Some((habitats.label_at(x, y)?, habitats.label_at(x + 200, y)?)));
    let pairs: Vec<(u32, u32)> = pairs.collect();
    pairs.iter().filter(|(a, b)| a == b).count() as f64 / pairs.len() as f64
}

#[test]
fn a_floor_keeps_its_labels_from_a_quarter_above() {
    let equal = [1.0, 1.1, 1.25].map(equal_from);
    assert!(equal[0] > 0.99 && equal[1] > 0.94 && equal[2] > 0.88, "{equal:?}");
}
