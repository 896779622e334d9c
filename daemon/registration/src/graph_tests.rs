//! Tests of the graph of a whole mission.

use crate::camera_image::CameraImage;
use crate::graph::FrameGraph;
use crate::registrar::{FrameInput, Registrar};
use scenecast_protocol::coordinates::MapPoint;

const COLUMNS: usize = 160;
const ROWS: usize = 120;
const PIXEL_M: f64 = 0.04;
/// Neighbouring frames overlap by a third.
const STEP_M: f64 = 4.2;

/// The brightness of a floor of blotches of several sizes.
fn floor(x_m: f64, y_m: f64) -> f64 {
    let blotch = |size_m: f64, salt: u64| {
        let cell = |metres: f64| (metres / size_m).floor() as i64 as u64;
        let mixed =
            (cell(x_m).wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ cell(y_m).wrapping_mul(0xC2B2_AE3D_27D4_EB4F)) + salt;
        (mixed.wrapping_mul(0x94D0_49BB_1331_11EB) >> 56) as f64 / 255.0
    };
    40.0 + 90.0 * blotch(0.9, 1) + 60.0 * blotch(0.31, 2) + 40.0 * blotch(0.13, 3)
}

/// Metres east and north of each frame.
type Track = Vec<(f64, f64)>;

/// The root mean square distance of places from the truth, both about their mean, metres.
fn error_m(places: &[(f64, f64)], truth: &[(f64, f64)]) -> f64 {
    let off = places.iter().zip(truth).map(|(a, b)| (a.0 - b.0, a.1 - b.1)).collect::<Vec<_>>();
    let n = off.len() as f64;
    let mean = off.iter().fold((0.0, 0.0), |m, o| (m.0 + o.0 / n, m.1 + o.1 / n));
    (off.iter().map(|o| (o.0 - mean.0).powi(2) + (o.1 - mean.1).powi(2)).sum::<f64>() / n).sqrt()
}

/// Flies two parallel legs there and back, with an odometry that errs by 5 % and a compass that errs from frame to frame.
/// Returns the graph, and the places by the registrar and in truth.
fn flight(frames: usize) -> (FrameGraph, Track, Track) {
    let (mut registrar, mut graph) = (Registrar::new(0.05), FrameGraph::default());
    let (mut placed, mut truth) = (Vec::new(), Vec::new());
    let mut dead = (0.0, 0.0);
    for i in 0..frames {
        let along = |i: usize| STEP_M * if i < frames / 2 { i as f64 } else { (frames - 1 - i) as f64 };
        let at = (along(i), if i < frames / 2 { 0.0 } else { 3.2 });
        let before = truth.last().copied().unwrap_or(at);
        dead = (dead.0 + 1.05 * (at.0 - before.0) + 0.02 * (at.1 - before.1), dead.1 + 0.97 * (at.1 - before.1));
        let pixels: Vec<u8> = (0..COLUMNS * ROWS)
            .map(|k| {
                let right = ((k % COLUMNS) as f64 + 0.5 - COLUMNS as f64 / 2.0) * PIXEL_M;
                let ahead = (ROWS as f64 / 2.0 - (k / COLUMNS) as f64 - 0.5) * PIXEL_M;
                let noise = ((k as u64 + 1).wrapping_mul(0xD134_2543_DE82_EF95 + 2 * i as u64) >> 58) as f64;
                (floor(at.0 + right, at.1 + ahead) + noise - 32.0).clamp(0.0, 255.0) as u8
            })
            .collect();
        let input = FrameInput {
            image: CameraImage::grey(COLUMNS, ROWS, &pixels).unwrap(),
            metres_per_pixel: PIXEL_M,
            dead_reckoned: MapPoint::new(dead.0, dead.1),
            compass_rad: 0.004 * [0.0, 1.0, -1.0, 0.5, -0.5][i % 5],
        };
        let found = registrar.handle_frame(&input);
        graph.add(&found);
        placed.push(found.pose.at().xy());
        truth.push(at);
    }
    (graph, placed, truth)
}

#[test]
fn the_graph_is_truer_than_the_frames_were_placed() {
    let (graph, placed, truth) = flight(36);
    let solved: Vec<(f64, f64)> = graph.solve().iter().map(|pose| pose.at().xy()).collect();
    let (before, after) = (error_m(&placed, &truth), error_m(&solved, &truth));
    assert!(after < 0.8 * before && after < 0.05, "{before} m placed, {after} m solved");
    assert!(graph.loops().count() > 10, "{} loops", graph.loops().count());
}

#[test]
fn a_wrong_match_does_not_bend_the_graph() {
    let (graph, _, truth) = flight(36);
    let places = |graph: &FrameGraph| graph.solve().iter().map(|pose| pose.at().xy()).collect::<Vec<_>>();
    let bent = error_m(&places(&graph.with_wrong_loop(1.5)), &truth);
    let right = error_m(&places(&graph), &truth);
    assert!(bent < right + 0.01, "{right} m, {bent} m with the wrong match");
}

#[test]
fn an_empty_graph_and_one_frame_have_their_own_poses() {
    assert_eq!(FrameGraph::default().solve(), []);
    let (graph, placed, _) = flight(1);
    assert_eq!(graph.solve().len(), 1);
    let at = graph.solve()[0].at().xy();
    assert!((at.0 - placed[0].0).abs() < 1e-9 && (at.1 - placed[0].1).abs() < 1e-9);
}
