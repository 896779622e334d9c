//! `scenecast map` as its user meets it.

use scenecast_protocol::map_codec::LabelRaster;
use scenecast_tests::{assert_refused, run, scratch};
use scenecast_training::{Flips, MapRng, MapScene, Survey};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// The first maps of a small survey as `1.png`, `2.png`, ...
fn series(dir: &Path, steps: usize) -> Vec<LabelRaster> {
    let scene = MapScene::Colonies.draw(&mut MapRng::new(3), 60, 40, 6);
    let mut survey = Survey::new(1, scene, Flips { border: 20_000, anywhere: 0, settling: 0 }, steps);
    let maps = (1..=steps).map(|step| {
        survey.advance();
        std::fs::write(dir.join(format!("{step}.png")), survey.map().to_png()).unwrap();
        survey.map().clone()
    });
    maps.collect()
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// What a command that must succeed prints, as JSON.
fn json(arguments: &[&str]) -> Value {
    let output = run(arguments);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

fn rgb_png(path: &Path) {
    image::RgbImage::new(8, 6).save(path).unwrap();
}

fn files(dir: &Path) -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> = std::fs::read_dir(dir).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files
}

#[test]
fn a_map_comes_back_exactly_from_its_chunks_with_every_codec() {
    let dir = scratch("map-round-trip");
    let maps = series(&dir, 12);
    let (base, target) = (dir.join("11.png"), dir.join("12.png"));
    let (chunks, back) = (dir.join("change.scmc"), dir.join("back.png"));
    for codec in ["auto", "png", "context"] {
        let common = ["--codec", codec, "--frame-bytes", "64", "--out", text(&chunks)];
        let delta = json(&[&["map", "encode", "--target", text(&target), "--base", text(&base)][..], &common].concat());
        let decode = ["map", "decode", "--base", text(&base), "--in", text(&chunks), "--out", text(&back)];
        assert!(run(&decode).status.success());
        assert_eq!(LabelRaster::from_png(&std::fs::read(&back).unwrap()).unwrap(), maps[11], "{codec}");
        let still = json(&[&["map", "encode", "--target", text(&target)][..], &common].concat());
        assert!(run(&["map", "decode", "--in", text(&chunks), "--out", text(&back)]).status.success());
        assert_eq!(LabelRaster::from_png(&std::fs::read(&back).unwrap()).unwrap(), maps[11], "{codec}");
        let of = |figures: &Value, name: &str| figures[name].as_u64().unwrap();
        let changed = maps[10].labels.iter().zip(&maps[11].labels).filter(|(old, new)| old != new).count();
        assert_eq!(of(&delta, "cells_changed"), changed as u64);
        assert!(of(&delta, "bytes") < of(&still, "bytes"));
        assert!(of(&still, "frames") * 64 >= of(&still, "bytes"));
        assert!(of(&delta, "png_delta_bytes") < of(&delta, "png_full_bytes"));
        assert_eq!(delta["codec"], codec);
        let alone = json(&[&["map", "encode", "--target", text(&target), "--no-png"][..], &common].concat());
        assert_eq!((&alone["bytes"], alone.get("png_full_bytes")), (&still["bytes"], None));
    }
}

#[test]
fn a_series_is_measured_in_the_order_of_its_numbers() {
    let dir = scratch("map-series");
    series(&dir, 12);
    let figures = json(&["map", "bench", "--series", text(&dir), "--frame-bytes", "256", "--json"]);
    assert_eq!((&figures["steps"], &figures["frame_bytes"]), (&12.into(), &256.into()));
    assert!(figures["ratio_delta"].as_f64() < Some(0.6), "{figures}");
    assert!(figures["ratio_full"].as_f64() < Some(0.4), "{figures}");
    let shown = run(&["map", "bench", "--series", text(&dir)]);
    assert!(String::from_utf8_lossy(&shown.stdout).contains("best PNG, delta"));
}

#[test]
fn bad_maps_and_chunk_files_are_refused_in_one_line() {
    let dir = scratch("map-refused");
    series(&dir, 2);
    let (map, rgb, high, small) = (dir.join("2.png"), dir.join("rgb.png"), dir.join("high.png"), dir.join("small.png"));
    rgb_png(&rgb);
    std::fs::write(&high, LabelRaster::uniform(60, 40, 255).to_png()).unwrap();
    std::fs::write(&small, LabelRaster::uniform(9, 7, 1).to_png()).unwrap();
    let (chunks, cut, bent) = (dir.join("good.scmc"), dir.join("cut.scmc"), dir.join("bent.scmc"));
    json(&["map", "encode", "--target", text(&map), "--base", text(&dir.join("1.png")), "--out", text(&chunks)]);
    let bytes = std::fs::read(&chunks).unwrap();
    std::fs::write(&cut, &bytes[..bytes.len() - 3]).unwrap();
    let mut damaged = bytes.clone();
    damaged[40] ^= 4;
    std::fs::write(&bent, &damaged).unwrap();
    let before = files(&dir);

    let out = dir.join("out");
    let encode = |target: &Path, base: &Path, words: &[&str]| {
        let arguments = ["map", "encode", "--target", text(target), "--base", text(base), "--out", text(&out)];
        assert_refused(&arguments, words);
    };
    encode(&rgb, &map, &["rgb.png", "Rgb", "indexed"]);
    encode(&map, &rgb, &["rgb.png", "Rgb", "indexed"]);
    encode(&high, &map, &["high.png", "255", "254"]);
    encode(&map, &small, &["2.png", "60 x 40", "small.png", "9 x 7"]);
    encode(&chunks, &map, &["good.scmc", "PNG"]);
    encode(&dir.join("none.png"), &map, &["none.png"]);
    let decode = |input: &Path, base: &Path, words: &[&str]| {
        let arguments = ["map", "decode", "--in", text(input), "--base", text(base), "--out", text(&out)];
        assert_refused(&arguments, words);
    };
    let base = dir.join("1.png");
    decode(&cut, &base, &["cut.scmc", "cut off"]);
    decode(&bent, &base, &["bent.scmc", "damaged"]);
    decode(&map, &base, &["2.png", "not a file of map chunks"]);
    decode(&chunks, &small, &["good.scmc", "9 x 7", "60 x 40"]);
    decode(&chunks, &map, &["good.scmc", "base map"]);
    assert_refused(&["map", "decode", "--in", text(&chunks), "--out", text(&out)], &["good.scmc", "base map"]);
    let room = ["map", "encode", "--target", text(&map), "--frame-bytes", "9", "--out", text(&out)];
    assert_refused(&room, &["--frame-bytes", "24..=65535"]);
    let codec = ["map", "encode", "--target", text(&map), "--codec", "gif", "--out", text(&out)];
    assert_refused(&codec, &["--codec", "auto, png or context"]);
    assert_refused(&["map", "bench", "--series", text(&dir)], &["has no number"]);
    assert_eq!(files(&dir), before, "nothing was written");
}
