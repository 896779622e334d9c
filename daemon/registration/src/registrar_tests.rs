//! Flights over a floor of noise.

use crate::camera_image::CameraImage;
use crate::registrar::{FrameInput, Placed, Registrar};
use crate::saved_state::RestoreError;
use proptest::prelude::*;
use scenecast_protocol::coordinates::MapPoint;

const COLUMNS: usize = 320;
const ROWS: usize = 240;
const METRES_PER_PIXEL: f64 = 0.02;

/// The brightness of a floor with structure of 0.1 to 1 m.
fn noise(x_m: f64, y_m: f64) -> f64 {
    let lattice = |x: i64, y: i64| {
        let mut bits = (x as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ (y as u64).wrapping_mul(0xC2B2_AE3D_27D4_EB4F);
        bits = (bits ^ (bits >> 29)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        (bits >> 40) as f64 / 16_777_216.0 - 0.5
    };
    let smooth = |scale: f64| {
        let (x, y) = (x_m / scale, y_m / scale);
        let (left, top) = (x.floor(), y.floor());
        let (fx, fy) = (x - left, y - top);
        let at = |dx: i64, dy: i64| lattice(left as i64 + dx, top as i64 + dy);
        (at(0, 0) * (1.0 - fx) + at(1, 0) * fx) * (1.0 - fy) + (at(0, 1) * (1.0 - fx) + at(1, 1) * fx) * fy
    };
    smooth(0.15) + smooth(0.4) + smooth(1.1)
}

/// A frame of a floor at a true place and heading.
fn photograph(floor: fn(f64, f64) -> f64, (x_m, y_m): (f64, f64), heading_rad: f64) -> Vec<u8> {
    let (sin, cos) = heading_rad.sin_cos();
    let pixel = |i: usize| {
        let right = ((i % COLUMNS) as f64 + 0.5 - COLUMNS as f64 / 2.0) * METRES_PER_PIXEL;
        let ahead = (ROWS as f64 / 2.0 - (i / COLUMNS) as f64 - 0.5) * METRES_PER_PIXEL;
        let value = floor(x_m + cos * right + sin * ahead, y_m + cos * ahead - sin * right);
        (120.0 + 60.0 * value).clamp(0.0, 255.0) as u8
    };
    (0..COLUMNS * ROWS).map(pixel).collect()
}

/// True places and headings of two legs, 3.5 m apart, with a turn in between.
fn two_legs() -> Vec<((f64, f64), f64)> {
    let right_angle = std::f64::consts::FRAC_PI_2;
    let there = (0..12).map(|i| ((f64::from(i), 0.0), right_angle));
    let across = (1..=3).map(|i| ((11.0, 1.1667 * f64::from(i)), 0.0));
    let back = (0..12).map(|i| ((11.0 - f64::from(i), 3.5), -right_angle));
    there.chain(across).chain(back).collect()
}

/// Places frames whose odometry is too long by 4 % and turned by 0.03 rad.
fn step(registrar: &mut Registrar, floor: fn(f64, f64) -> f64, at: (f64, f64), heading_rad: f64) -> Placed {
    let samples = photograph(floor, at, heading_rad);
    registrar.handle_frame(&FrameInput {
        image: CameraImage::grey(COLUMNS, ROWS, &samples).unwrap(),
        metres_per_pixel: METRES_PER_PIXEL,
        dead_reckoned: believed(at),
        compass_rad: heading_rad,
    })
}

fn believed(at: (f64, f64)) -> MapPoint {
    MapPoint::new(1.04 * at.0 + 0.03 * at.1, 1.04 * at.1 - 0.03 * at.0)
}

#[test]
fn drift_is_corrected_where_the_floor_has_texture() {
    let mut registrar = Registrar::new(0.03);
    let error = |(at, heading): &((f64, f64), f64)| {
        let placed = step(&mut registrar, noise, *at, *heading);
        placed.pose.at().distance_m(MapPoint::new(at.0, at.1))
    };
    let errors: Vec<f64> = two_legs().iter().map(error).collect();
    let worst = errors.iter().copied().fold(0.0, f64::max);
    let (at, _) = two_legs()[14];
    let drift = believed(at).distance_m(MapPoint::new(at.0, at.1));
    assert!(worst < 0.04 && drift > 0.4, "{worst} m, {drift} m by dead reckoning");
    let tally = registrar.tally();
    assert_eq!((tally.frames, tally.chained, tally.contradicted), (27, 26, 0));
    assert!(tally.looped >= 10, "{tally:?}");
}

#[test]
fn frames_without_texture_follow_dead_reckoning() {
    let mut registrar = Registrar::new(0.03);
    for (at, heading) in two_legs() {
        let pose = step(&mut registrar, |_, _| 0.3, at, heading).pose;
        assert!(pose.at().distance_m(believed(at)) < 1e-6 && (pose.heading_rad - heading).abs() < 1e-6, "{pose:?}");
    }
    assert_eq!(registrar.tally().unseen, 27);
}

#[test]
fn identical_ripples_close_no_loop() {
    let ripples = |x_m: f64, _: f64| (x_m / 0.29 * std::f64::consts::TAU).sin();
    let mut registrar = Registrar::new(0.03);
    for (at, heading) in two_legs() {
        step(&mut registrar, ripples, at, heading);
    }
    let tally = registrar.tally();
    assert_eq!((tally.chained, tally.loops), (0, 0));
}

#[test]
fn a_restored_registrar_places_frames_as_the_saved_one() {
    let mut whole = Registrar::new(0.03);
    let legs = two_legs();
    for (at, heading) in &legs[..18] {
        step(&mut whole, noise, *at, *heading);
    }
    let mut restored = Registrar::restore(&whole.save()).unwrap();
    assert_eq!(restored, whole);
    for (at, heading) in &legs[18..] {
        assert_eq!(step(&mut restored, noise, *at, *heading), step(&mut whole, noise, *at, *heading));
    }
    let mut bytes = whole.save();
    bytes[8] += 1;
    assert_eq!(Registrar::restore(&bytes), Err(RestoreError::Version(u16::from(bytes[8]))));
    assert_eq!(Registrar::restore(b"SCNOTHER"), Err(RestoreError::Foreign));
}

#[test]
fn an_odd_or_broken_frame_affects_no_pose_but_its_own() {
    let mut registrar = Registrar::new(0.03);
    step(&mut registrar, noise, (0.0, 0.0), 0.0);
    for (columns, rows) in [(0, 0), (1, 1), (40, 30), (700, 11), (64, 64)] {
        let samples: Vec<u8> = (0..columns * rows).map(|i| (i * 37 % 251) as u8).collect();
        let placed = registrar.handle_frame(&FrameInput {
            image: CameraImage::grey(columns, rows, &samples).unwrap(),
            metres_per_pixel: METRES_PER_PIXEL,
            dead_reckoned: MapPoint::new(0.0, 0.0),
            compass_rad: 0.0,
        });
        assert!(placed.pose.at().distance_m(MapPoint::new(0.0, 0.0)) < 1e-6, "{columns} x {rows}: {placed:?}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn damaged_bytes_are_refused_or_usable(changes in proptest::collection::vec((any::<u32>(), any::<u8>()), 1..6), cut in 0usize..400) {
        let mut registrar = Registrar::new(0.01);
        for (at, heading) in &two_legs()[..3] {
            step(&mut registrar, noise, *at, *heading);
        }
        let mut bytes = registrar.save();
        for (place, value) in changes {
            // The numbers are at the beginning and behind the pixels of thumbnails; both ends are hit often.
            let place = if place % 2 == 0 { place as usize % bytes.len() } else { bytes.len() - 1 - place as usize % 300 };
            bytes[place] = value;
        }
        bytes.truncate(bytes.len() - cut / 2 * (cut % 2));
        if let Ok(mut restored) = Registrar::restore(&bytes) {
            step(&mut restored, noise, (3.0, 0.0), 0.5);
        }
    }
}

/// The state after two frames without a match, of which the layout must not change without its version.
fn unmatched_state() -> Vec<u8> {
    let mut registrar = Registrar::new(0.25);
    let pixels = [100; 32 * 24];
    for east in [0.0, 2.0] {
        registrar.handle_unmatched_frame(&FrameInput {
            image: CameraImage::grey(32, 24, &pixels).unwrap(),
            metres_per_pixel: 0.125,
            dead_reckoned: MapPoint::new(east, -1.0),
            compass_rad: 0.5,
        });
    }
    registrar.save()
}

#[test]
fn golden_layout_of_a_state() {
    let bytes = unmatched_state();
    assert_eq!((bytes.len(), &bytes[..10]), (594, &b"SCNREGIS\x02\x00"[..]), "another layout needs another version");
    assert_eq!(bytes[594 - 7..], [2, 0, 0, 0, 0, 0, 2], "two frames, both unseen");
    assert!(Registrar::restore(&bytes).is_ok_and(|restored| restored.save() == bytes));
}
