//! Places the frames of a real sequence one after the other, and prints their distance from the given poses.
//!
//! `cargo run --release -p scenecast-tools --example skerki -- FOLDER`, where `FOLDER` has `poses_estimated.csv`
//! and its frames. Dead reckoning, compass and altitude are the given ones with errors. Pixels stand for metres.

use scenecast_protocol::coordinates::MapPoint;
use scenecast_registration::{CameraImage, FrameInput, Registrar};
use scenecast_worlds::scoring::{PointPair, RigidFit, rms_distance};
use std::path::Path;

/// A frame with its given pose.
struct Given {
    image: image::GrayImage,
    x: f64,
    y: f64,
    yaw_deg: f64,
    scale: f64,
}

fn main() {
    let folder = std::env::args().nth(1).expect("the folder of the sequence");
    let frames = read(Path::new(&folder));
    println!("{:34} {:>9} {:>9}", "errors", "dead, px", "placed, px");
    for (name, drift, compass_deg, altitude) in [
        ("drift 5 %", 0.05, 0.0, 0.0),
        ("drift 5 %, 1 degree, 2 %", 0.05, 1.0, 0.02),
        ("drift 10 %, 1 degree, 2 %", 0.1, 1.0, 0.02),
    ] {
        for seed in 1..=5 {
            let (dead, placed, tally) = place(&frames, drift, compass_deg, altitude, seed);
            println!("{:34} {dead:9.1} {placed:9.1}  {tally:?}", format!("{name}, seed {seed}"));
        }
    }
}

fn place(
    frames: &[Given],
    drift: f64,
    compass_deg: f64,
    altitude: f64,
    seed: u64,
) -> (f64, f64, scenecast_registration::Tally) {
    let mut random = seed;
    let mut normal = || {
        let mut unit = || {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (random >> 11) as f64 / (1u64 << 53) as f64
        };
        (0..12).map(|_| unit()).sum::<f64>() - 6.0
    };
    let (scale, turn) = (1.0 + drift * normal(), drift * normal());
    let mut registrar = Registrar::new(drift);
    let (mut dead, mut before) = ((0.0, 0.0), None::<(f64, f64)>);
    let [mut believed, mut placed] = [const { Vec::new() }; 2];
    for given in frames {
        let at = (given.x, -given.y);
        let (dx, dy) = before.map_or((0.0, 0.0), |b| (at.0 - b.0, at.1 - b.1));
        let path = dx.hypot(dy);
        dead.0 += scale * dx - turn * dy + 0.3 * drift * path * normal();
        dead.1 += scale * dy + turn * dx + 0.3 * drift * path * normal();
        before = Some(at);
        let (columns, rows) = (given.image.width() as usize, given.image.height() as usize);
        let placed_frame = registrar.handle_frame(&FrameInput {
            image: CameraImage::grey(columns, rows, given.image.as_raw()).expect("the size of the image"),
            metres_per_pixel: given.scale * (1.0 + altitude * normal()),
            dead_reckoned: MapPoint::new(dead.0, dead.1),
            compass_rad: (given.yaw_deg + compass_deg * normal()).to_radians(),
        });
        believed.push((dead, at));
        placed.push((placed_frame.pose.at().xy(), at));
    }
    let rms = |track: &[PointPair]| {
        let fit = RigidFit::new(track);
        rms_distance(track.iter().map(|&(at, truth)| (fit.apply(at), truth)))
    };
    (rms(&believed), rms(&placed), registrar.tally())
}

fn read(folder: &Path) -> Vec<Given> {
    let table = std::fs::read_to_string(folder.join("poses_estimated.csv")).expect("poses_estimated.csv");
    let rows = table.lines().skip(1).map(|line| {
        let fields: Vec<&str> = line.split(',').collect();
        let number = |i: usize| fields[i].parse().expect("a number");
        let image = image::open(folder.join(fields[0])).expect("a frame").to_luma8();
        Given { image, x: number(2), y: number(3), yaw_deg: number(4), scale: number(5) }
    });
    rows.collect()
}
