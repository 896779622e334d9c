//! Pairs of real frames with given poses. The frames are no part of the project: `../shared/data/skerki_sequence`.

#![allow(clippy::disallowed_methods, reason = "the test reads recorded frames")]

use crate::camera_image::{CameraImage, FlatField, Thumbnail};
use crate::consensus::ExpectedRelief;
use crate::pair::{Attempts, Expected, Gates, Match};
use crate::similarity::FramePose;
use nalgebra::Vector2;
use scenecast_protocol::coordinates::MapPoint;
use std::path::PathBuf;

struct Frame {
    thumbnail: Thumbnail,
    pose: FramePose,
}

/// The frames with their given poses; pixels of the first frame stand for metres. Without them a test is skipped, which CI takes for a
/// failure: nothing drawn stands for real images.
fn frames() -> Option<Vec<Frame>> {
    let frames = read_frames();
    assert!(frames.is_some() || std::env::var_os("CI").is_none(), "no ../shared/data/skerki_sequence");
    frames
}

fn read_frames() -> Option<Vec<Frame>> {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../..");
    let found = ["shared/data", "../shared/data"].map(|folder| root.join(folder).join("skerki_sequence"));
    let folder = found.into_iter().find(|folder| folder.is_dir())?;
    let table = std::fs::read_to_string(folder.join("poses_estimated.csv")).ok()?;
    let mut flat = FlatField::default();
    let rows = table.lines().skip(1).map(|line| {
        let fields: Vec<&str> = line.split(',').collect();
        let number = |i: usize| fields[i].parse::<f64>().unwrap();
        let image = image::open(folder.join(fields[0])).unwrap().to_luma8();
        let seen = CameraImage::grey(image.width() as usize, image.height() as usize, image.as_raw()).unwrap();
        let thumbnail = Thumbnail::new(&seen, number(5), &mut flat).unwrap();
        Frame { thumbnail, pose: FramePose::new(MapPoint::new(number(2), -number(3)), number(4).to_radians(), 0.0) }
    });
    Some(rows.collect())
}

/// The share of the new frame that the earlier one shows.
fn overlap(new: &Frame, old: &Frame) -> f64 {
    let to_old = old.pose.to_map().inverse().after(&new.pose.to_map());
    let ([width, height], [w, h]) = (new.thumbnail.extent_m(), old.thumbnail.extent_m());
    let share = |i: usize| (i as f64 + 0.5) / 20.0 - 0.5;
    let is_seen = |i: &usize| {
        let at = to_old.apply(Vector2::new(share(i % 20) * width, share(i / 20) * height));
        2.0 * at.x.abs() < w && 2.0 * at.y.abs() < h
    };
    (0..400).filter(is_seen).count() as f64 / 400.0
}

/// The match of a pair whose expected place is off by `(dx, dy)`, and its distance from the given poses.
fn attempt(new: &Frame, old: &Frame, off: Vector2<f64>) -> Option<(Match, f64)> {
    let scales = new.thumbnail.unpacked().unwrap();
    let truth = old.pose.to_map().inverse().after(&new.pose.to_map());
    let similarity = truth.through(Vector2::zeros(), truth.apply(Vector2::zeros()) + off);
    let mut attempts = Attempts::new(&scales, 90.0, Gates::default());
    let expected = Expected { similarity, window_m: 90.0, spread: 0.012, relief: ExpectedRelief::known(4e-4) };
    let found = attempts.attempt(&old.thumbnail.unpacked().unwrap(), &expected)?;
    let error = (found.similarity.apply(found.anchor) - truth.apply(found.anchor)).norm();
    Some((found, error))
}

#[test]
fn real_frames_match_along_and_across_tracks() {
    let Some(frames) = frames() else {
        println!("SKIPPED: no ../shared/data/skerki_sequence");
        return;
    };
    let (mut along, mut across, mut pairs, mut wrong) = (0, 0, 0, 0);
    for (i, new) in frames.iter().enumerate() {
        for (j, old) in frames[..i].iter().enumerate() {
            let is_next = j + 1 == i;
            if !is_next && overlap(new, old) <= 0.15 {
                continue;
            }
            let off = Vector2::new([25.0, -30.0, 10.0][i % 3], [-20.0, 15.0, 30.0][j % 3]);
            let found = attempt(new, old, off);
            let is_wrong = found.is_some_and(|(_, error)| error > 20.0);
            wrong += usize::from(is_wrong);
            println!("{j} {i}: {:.2} {:?}", overlap(new, old), found.map(|(m, error)| (m.along_sigma_m, error)));
            if is_next {
                along += usize::from(found.is_some() && !is_wrong);
            } else {
                pairs += 1;
                across += usize::from(found.is_some() && !is_wrong);
            }
        }
    }
    println!("consecutive {along} of 27, across tracks {across} of {pairs}, wrong {wrong}");
    assert_eq!((along, wrong), (27, 0));
    assert!(across * 85 >= 80 * pairs, "{across} of {pairs}");
}

#[test]
fn frames_of_places_far_apart_do_not_match() {
    let Some(frames) = frames() else {
        println!("SKIPPED: no ../shared/data/skerki_sequence");
        return;
    };
    let mut tried = 0;
    for (i, new) in frames.iter().enumerate() {
        for old in frames[..i].iter().filter(|old| overlap(new, old) == 0.0) {
            // The pose says that they overlap by half.
            let mut moved = Frame { thumbnail: old.thumbnail.clone(), pose: new.pose };
            moved.pose =
                FramePose::new(MapPoint::new(new.pose.at().x_m + 150.0, new.pose.at().y_m), new.pose.heading_rad, 0.0);
            println!("far {i}");
            assert_eq!(attempt(new, &moved, Vector2::zeros()), None);
            tried += 1;
        }
    }
    assert!(tried > 50, "{tried}");
}
