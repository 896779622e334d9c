//! `scenecast scene` and `scenecast vocabulary` as their user meets them.

use scenecast_tests::{assert_refused, run, scratch, shared_data};
use serde_json::Value;
use std::fmt::Write;
use std::path::{Path, PathBuf};

const KEYS: [&str; 17] = [
    "words",
    "cells",
    "resampled",
    "seconds",
    "cpu_seconds",
    "words_per_cpu_second",
    "labels",
    "labels_used",
    "perplexity",
    "mutual_information_nats",
    "normalised_mutual_information",
    "homogeneity",
    "completeness",
    "v_measure",
    "null_mutual_information_nats",
    "peak_rss_bytes",
    "kernel",
];

fn path(p: impl AsRef<Path>) -> String {
    p.as_ref().to_str().unwrap().to_owned()
}

fn write(dir: &Path, name: &str, content: impl AsRef<[u8]>) -> String {
    let file = dir.join(name);
    std::fs::create_dir_all(file.parent().unwrap()).unwrap();
    std::fs::write(&file, content).unwrap();
    path(file)
}

/// Runs `scene run`; its JSON, which must be one line with exactly the keys, in order.
fn scene_run(arguments: &[&str], out: &Path) -> Value {
    let output = run(&[&["scene", "run"], arguments, &["--out", &path(out)]].concat());
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(said.lines().count(), 1, "{said}");
    let places: Vec<usize> = KEYS.iter().map(|key| said.find(&format!("\"{key}\":")).unwrap()).collect();
    assert!(places.is_sorted(), "{said}");
    let figures: Value = serde_json::from_str(&said).unwrap();
    assert_eq!(figures.as_object().unwrap().len(), KEYS.len());
    figures
}

fn refused(input: &[&str], out: &Path, words: &[&str]) {
    assert_refused(&[&["scene", "run"], input, &["--out", &path(out)]].concat(), words);
    assert!(!out.exists(), "nothing is left of {input:?}");
}

/// Rows of `labels.csv`: x, y, z, label.
fn labels(out: &Path) -> Vec<([f64; 3], u32)> {
    let text = std::fs::read_to_string(out.join("labels.csv")).unwrap();
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("x,y,z,label,confidence,perplexity"));
    let row = |line: &str| {
        let fields: Vec<f64> = line.split(',').map(|field| field.parse().unwrap()).collect();
        assert!(fields.len() == 6 && (0.0..=1.0).contains(&fields[4]) && fields[5] >= 1.0, "{line}");
        ([fields[0], fields[1], fields[2]], fields[3] as u32)
    };
    lines.map(row).collect()
}

/// Two classes side by side, 20 x 10 cells of 1 m, each with words of its own; later on the right.
fn two_classes(dir: &Path) -> (String, String) {
    let (mut words, mut classes) = (String::new(), "x,y,z,class\n".to_owned());
    for i in 0..200u32 {
        let (x, y) = (f64::from(i / 10) + 0.5, f64::from(i % 10) - 4.5);
        let class = u32::from(x > 10.0);
        let _ = write!(words, "{},{x},{y},0.1", f64::from(i) * 0.5);
        for n in 0..40 {
            let _ = write!(words, ",{}", class * 20 + (n * 7 + i) % 20);
        }
        words.push('\n');
        let _ = writeln!(classes, "{x},{y},0.1,{}", ["sand", "rock"][class as usize]);
    }
    (write(dir, "words.csv", words), write(dir, "classes.csv", classes))
}

#[test]
fn labels_follow_the_classes_at_any_number_of_threads() {
    let dir = scratch("scene-words");
    let (words, classes) = two_classes(&dir);
    let out = |name: &str| dir.join(name);
    let batch = scene_run(&["--words", &words, "--annotations", &classes], &out("batch"));
    assert_eq!((&batch["words"], &batch["cells"], &batch["resampled"]), (&8000.into(), &200.into(), &240_000.into()));
    assert!((batch["mutual_information_nats"].as_f64().unwrap() - 2f64.ln()).abs() < 0.02, "{batch}");
    assert!(
        batch["null_mutual_information_nats"].as_f64().unwrap() < batch["mutual_information_nats"].as_f64().unwrap()
    );
    scene_run(&["--words", &words, "--threads", "3"], &out("threads"));
    let bytes = |name: &str, file: &str| std::fs::read(dir.join(name).join(file)).unwrap();
    assert_eq!(bytes("batch", "labels.csv"), bytes("threads", "labels.csv"));
    assert_eq!(bytes("batch", "labels.png"), bytes("threads", "labels.png"));
    let online = scene_run(&["--words", &words, "--refine-rate", "4000", "--annotations", &classes], &out("online"));
    let resampled = online["resampled"].as_f64().unwrap();
    assert!((resampled / 400_000.0 - 1.0).abs() < 0.01, "100 s at 4000 words a second: {resampled}");
    assert!((online["mutual_information_nats"].as_f64().unwrap() - 2f64.ln()).abs() < 0.05, "{online}");
    let elsewhere = write(&dir, "elsewhere.csv", "500,500,0,sand\n");
    let apart = scene_run(&["--words", &words, "--annotations", &elsewhere, "--sweeps", "1"], &out("apart"));
    assert_eq!(apart["mutual_information_nats"], Value::Null);
    assert!(batch["perplexity"].as_f64().unwrap() < 25.0);
    let rows = labels(&out("batch"));
    assert_eq!(rows.len(), 200);
    let map = image::open(out("batch").join("labels.png")).unwrap();
    assert_eq!((map.width(), map.height()), (20, 10));
}

#[test]
fn the_map_has_y_up_and_shows_the_fuller_of_stacked_cells() {
    let dir = scratch("scene-stacked");
    let line = |x: f64, y: f64, z: f64, word: u32, times: usize| {
        format!("0,{x},{y},{z}{}\n", format!(",{word}").repeat(times))
    };
    // Bottom left: word 0. Top right: word 9 above, more of word 0 below.
    let words = [line(-0.5, 0.5, 0.0, 0, 60), line(0.5, 1.5, 0.0, 0, 60), line(0.5, 1.5, 5.0, 9, 40)].concat();
    let words = write(&dir, "words.csv", words);
    let out = dir.join("out");
    let figures = scene_run(&["--words", &words], &out);
    assert_eq!((&figures["cells"], &figures["mutual_information_nats"]), (&3.into(), &Value::Null));
    let rows = labels(&out);
    let places: Vec<[f64; 3]> = rows.iter().map(|row| row.0).collect();
    assert_eq!(places, [[-0.5, 0.5, 0.0], [0.5, 1.5, 5.0], [0.5, 1.5, 0.0]], "by y, x, then the one that shows");
    assert!(rows[0].1 == rows[2].1 && rows[0].1 != rows[1].1);
    let mut decoder = png::Decoder::new(std::io::Cursor::new(std::fs::read(out.join("labels.png")).unwrap()));
    decoder.set_transformations(png::Transformations::IDENTITY);
    let mut reader = decoder.read_info().unwrap();
    assert_eq!(reader.info().color_type, png::ColorType::Indexed);
    let depth = reader.info().bit_depth as usize;
    let mut raw = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut raw).unwrap();
    let pixels: Vec<u8> =
        raw.iter().flat_map(|b| [b >> (8 - depth), b >> (8 - 2 * depth) & ((1 << depth) - 1)]).collect();
    assert_eq!(pixels, [0, rows[2].1 as u8, rows[0].1 as u8, 0]);
}

#[test]
fn a_wrong_words_file_is_refused_with_its_line() {
    let dir = scratch("scene-wrong");
    let out = dir.join("out");
    for (name, content, said) in [
        ("empty.csv", "", "there are no words"),
        ("head.csv", "t,x,y,z,w1\n", "there are no words"),
        ("nan.csv", "0,0,0,0,1\n0,NaN,0,0,1\n", "nan.csv:2: x = NaN"),
        ("infinite.csv", "0,0,0,0,1\n0,0,0,-inf,1\n", "infinite.csv:2: z = -inf"),
        ("short.csv", "0,0\n", "short.csv:1: y is missing"),
        ("word.csv", "0,0,0,0,1.5\n", "word.csv:1: word id \"1.5\""),
        ("large.csv", "0,0,0,0,4000000\n", "large.csv:1: word id 4000000"),
        ("text.csv", "\u{0}\u{1}hello\n", "text.csv:1: t ="),
        ("far.csv", "0,0,0,0,1\n0,1e6,1e6,0,1\n", "far.csv:2: the map would reach over"),
    ] {
        let file = write(&dir, name, content);
        refused(&["--words", &file], &out, &[said]);
    }
    let good = write(&dir, "good.csv", "0,0.5,0.5,0,1,2\n");
    refused(&["--words", &good, "--vocabulary-size", "2"], &out, &["good.csv:1: word id 2", "--vocabulary-size is 2"]);
    refused(&["--words", &path(&dir)], &out, &["a file is needed"]);
    refused(&["--words", "nowhere.csv"], &out, &["nowhere.csv"]);
    refused(&["--words", &good, "--beta", "0"], &out, &["--beta 0", "allowed is"]);
    refused(&["--words", &good, "--max-labels", "255"], &out, &["--max-labels", "1..=254"]);
    refused(&["--words", &good, "--cell-size", "0"], &out, &["--cell-size", "metres"]);
    refused(&["--words", &good, "--refine-rate", "nan"], &out, &["--refine-rate"]);
    refused(&["--words", &good, "--birth", "twins"], &out, &["literal, collapsed, rost"]);
    refused(&[], &out, &["--words"]);
    let classes = write(&dir, "classes.csv", "0,0,0,1\n0,inf,0,1\n");
    refused(&["--words", &good, "--annotations", &classes], &out, &["classes.csv:2: y = inf"]);
    assert_refused(&["scene", "run", "--words", &good, "--out", &good], &["good.csv", "takes a folder"]);
}

fn reef(dir: &Path) -> String {
    let world = scenecast_worlds::patches(3, 400, 300, 60, 5);
    world.image.save(dir.join("reef.png")).unwrap();
    image::GrayImage::from_raw(400, 300, world.truth).unwrap().save(dir.join("classes.png")).unwrap();
    path(dir.join("reef.png"))
}

#[test]
fn a_mosaic_is_scored_and_unfit_annotations_are_refused() {
    let dir = scratch("scene-mosaic");
    let (mosaic, classes) = (reef(&dir), path(dir.join("classes.png")));
    let out = dir.join("out");
    let cell = ["--metres-per-pixel", "0.002", "--cell-size", "0.02"];
    let figures = scene_run(&[&["--mosaic", &mosaic, "--annotations", &classes], &cell[..]].concat(), &out);
    assert_eq!(figures["cells"], 1200);
    let number = |key: &str| figures[key].as_f64().unwrap();
    assert!(number("mutual_information_nats") > number("null_mutual_information_nats") + 0.2, "{figures}");
    assert_eq!(image::image_dimensions(out.join("labels.png")).unwrap(), (40, 30));
    assert!(labels(&out).iter().all(|([x, y, z], _)| (0.0..0.8).contains(x) && (-0.6..0.0).contains(y) && *z == 0.0));
    let none = dir.join("none");
    image::GrayImage::new(300, 300).save(dir.join("small.png")).unwrap();
    image::RgbImage::new(1, 1).save(dir.join("dot.png")).unwrap();
    let (small, dot) = (path(dir.join("small.png")), path(dir.join("dot.png")));
    refused(&["--mosaic", &mosaic, "--annotations", &small], &none, &["small.png", "300 x 300", "400 x 300"]);
    refused(&["--mosaic", &mosaic, "--annotations", &mosaic], &none, &["reef.png", "grey or indexed"]);
    refused(&["--mosaic", &dot], &none, &["dot.png", "1 x 1"]);
    refused(&["--mosaic", &write(&dir, "text.png", "hello")], &none, &["text.png", "not an image"]);
    refused(&["--mosaic", &mosaic, "--refine-rate", "10"], &none, &["--refine-rate", "--labels topics"]);
    let online = ["--mosaic", &mosaic, "--labels", "topics", "--refine-rate", "10"];
    refused(&online, &none, &["--refine-rate", "--sweeps"]);
    refused(&["--mosaic", &mosaic, "--cell-size", "0.001"], &none, &["--cell-size", "pixels"]);
    let ignored = ["--mosaic", &mosaic, "--annotations", &classes, "--ignore", "0,1,2,3,4,5"];
    refused(&ignored, &none, &["classes.png", "nothing is annotated"]);
}

/// A room of 2 x 2 m with a camera that looks down from 1 m, in the layout of the TUM benchmark.
fn tum(dir: &Path) -> PathBuf {
    let dir = dir.join("tum");
    std::fs::create_dir_all(dir.join("rgb")).unwrap();
    let world = scenecast_worlds::patches(3, 400, 300, 60, 5).image;
    let (mut rgb, mut depth, mut truth) = ("# color images\n".to_owned(), String::new(), String::new());
    for i in 0..6u32 {
        let time = 100.0 + f64::from(i) * 0.5;
        let view = image::imageops::crop_imm(&world, i * 20, 0, 160, 120).to_image();
        view.save(dir.join(format!("rgb/{i}.png"))).unwrap();
        // The left half of each depth image has no reading; the last frame has no depth image at all.
        let metres = |x: u32, _| image::Luma([if x < 80 { 0u16 } else { 5000 }]);
        image::ImageBuffer::from_fn(160, 120, metres).save(dir.join(format!("rgb/d{i}.png"))).unwrap();
        let _ = writeln!(rgb, "{time:.4} rgb/{i}.png");
        let apart = if i == 5 { 0.2 } else { 0.015 };
        let _ = writeln!(depth, "{:.4} rgb/d{i}.png", time + apart);
        let _ = writeln!(truth, "{:.4} {} 0 1 1 0 0 0", time - 0.01, f64::from(i) * 0.1);
    }
    write(&dir, "rgb.txt", rgb);
    write(&dir, "depth.txt", depth);
    write(&dir, "groundtruth.txt", truth);
    dir
}

#[test]
fn a_tum_sequence_is_projected_and_gaps_are_counted() {
    let dir = scratch("scene-tum");
    let source = tum(&dir);
    let out = dir.join("out");
    let argument = format!("tum:{}", source.display());
    let arguments = ["scene", "run", "--source", &argument, "--cell-size", "0.1", "--out", &path(&out)];
    let output = run(&arguments);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{said}");
    assert!(said.contains("1 of 6 images have no depth image") && said.contains("words have no depth"), "{said}");
    // fx is 131.25 at this width: 160 pixels see 1.2 m, of which the right half has depth; the poses go 0.4 m east.
    for ([x, y, z], _) in labels(&out) {
        assert!((-0.05..1.1).contains(&x) && (-0.55..0.55).contains(&y) && z.abs() < 0.06, "{x} {y} {z}");
    }
    let none = dir.join("none");
    std::fs::write(source.join("rgb/2.png"), "hello").unwrap();
    let again =
        run(&["scene", "run", "--source", &argument, "--refine-rate", "1000", "--out", &path(dir.join("again"))]);
    assert!(again.status.success());
    assert!(String::from_utf8_lossy(&again.stderr).contains("1 frames skipped, the first:"), "one bad frame");
    write(&source, "depth.txt", "500 rgb/d0.png\n");
    refused(&["--source", &argument], &none, &["rgb.txt", "none of its 6 images"]);
    write(&source, "groundtruth.txt", "100 0 0 nan 0 0 0 1\n");
    refused(&["--source", &argument], &none, &["groundtruth.txt:1", "tz = nan"]);
    refused(&["--source", "tum:nowhere"], &none, &["nowhere/rgb.txt"]);
    refused(&["--source", "video:x"], &none, &["tum:DIR, frames:DIR or bag:FILE"]);
}

#[test]
fn frames_with_poses_are_labelled_and_bad_ones_are_counted() {
    let dir = scratch("scene-frames");
    let world = scenecast_worlds::patches(3, 400, 300, 60, 5).image;
    let mut poses = "t_s,file,x_m,y_m,depth_m,heading_deg\n".to_owned();
    for i in 0..5u32 {
        image::imageops::crop_imm(&world, i * 40, 0, 160, 120).to_image().save(dir.join(format!("{i}.png"))).unwrap();
        let _ = writeln!(poses, "{},{i}.png,{},0,10,0", f64::from(i) * 2.0, f64::from(i) * 0.4);
    }
    poses.push_str("10,missing.png,0,0,10,0\n");
    write(&dir, "poses.csv", &poses);
    let out = dir.join("out");
    let argument = format!("frames:{}", dir.display());
    for kind in [&["--labels", "topics", "--refine-rate", "20000"][..], &[]] {
        let output = run(&[&["scene", "run", "--source", &argument, "--out", &path(&out)], kind].concat());
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{said}");
        assert!(said.contains("1 of 6 frames skipped") && said.contains("missing.png"), "{said}");
        let labels = labels(&out);
        assert!(labels.iter().all(|([x, y, _], _)| (-0.9..2.6).contains(x) && (-0.8..0.8).contains(y)));
        assert!(labels.len() > 20, "{labels:?}");
    }
    write(&dir, "poses.csv", "t_s,file,x_m,y_m,depth_m,heading_deg\n0,0.png,0,inf,0,0\n");
    refused(&["--source", &argument], &dir.join("none"), &["poses.csv:2"]);
    write(&dir, "poses.csv", "t_s,file,x_m,y_m,depth_m,heading_deg\n0,gone.png,0,0,0,0\n");
    refused(&["--source", &argument], &dir.join("none"), &["there are no cells", "gone.png"]);
}

#[test]
fn the_shared_sequence_is_read_with_its_poses_in_a_mosaic() {
    let Some(data) = shared_data() else { return };
    let source = format!("frames:{}", data.join("skerki_sequence").display());
    let figures =
        scene_run(&["--source", &source, "--labels", "topics", "--sweeps", "2"], &scratch("scene-skerki").join("out"));
    assert!(figures["cells"].as_u64().unwrap() > 2000, "{figures}");
}

#[test]
fn random_worlds_are_drawn_by_their_seed() {
    let dir = scratch("scene-sample");
    let draw = |name: &str, seed: &str| {
        let file = path(dir.join(name));
        let arguments = ["--alpha", "0.001", "--gamma", "0.3", "--size", "32x16", "--grid", "2x3", "--seed", seed];
        let output = run(&[&["scene", "sample"], &arguments[..], &["--out", &file]].concat());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        std::fs::read(file).unwrap()
    };
    assert_eq!(draw("a.png", "4"), draw("b.png", "4"));
    assert_ne!(draw("a.png", "4"), draw("c.png", "5"));
    assert!(image::image_dimensions(dir.join("a.png")).unwrap().0 > 400);
    let none = path(dir.join("none.png"));
    let with = |alpha: &str, size: &str, words: &[&str]| {
        let arguments = ["scene", "sample", "--alpha", alpha, "--gamma", "1", "--size", size, "--out", &none];
        assert_refused(&arguments, words);
    };
    with("-1", "8x8", &["--alpha -1"]);
    with("0.1", "0x8", &["--size", "as in 64x48"]);
    with("0.1", "4096x4096", &["--size", "pixels"]);
    assert!(!Path::new(&none).exists());
}

#[test]
fn a_vocabulary_is_trained_once_and_used() {
    let dir = scratch("scene-vocabulary");
    let mosaic = reef(&dir);
    std::fs::remove_file(dir.join("classes.png")).unwrap();
    let file = path(dir.join("reef.vocabulary"));
    let train = ["vocabulary", "train", "--images", &path(&dir), "--out", &file];
    let output = run(&train);
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success() && said.contains("from 1 images"), "{said}");
    let once = std::fs::read(&file).unwrap();
    assert!(run(&train).status.success());
    assert_eq!(std::fs::read(&file).unwrap(), once);
    let with = |file| ["--mosaic", &mosaic, "--labels", "topics", "--vocabulary", file];
    scene_run(&with(&file), &dir.join("out"));
    let none = dir.join("none");
    let damaged = write(&dir, "damaged.vocabulary", &once[..once.len() - 9]);
    refused(&with(&damaged), &none, &["damaged.vocabulary", "cut off or damaged"]);
    let text = write(&dir, "text.vocabulary", "hello");
    refused(&with(&text), &none, &["text.vocabulary", "of another kind"]);
    let missing = ["sim", "--set", "scene.vocabulary=nowhere", "--duration", "9", "--out", &path(&none)];
    assert_refused(&missing, &["nowhere"]);
    write(&dir, "empty/readme.txt", "no image");
    let empty = path(dir.join("empty"));
    assert_refused(
        &["vocabulary", "train", "--images", &empty, "--out", &path(&none)],
        &["no PNG, JPEG or TIFF image"],
    );
    image::RgbImage::new(1, 1).save(dir.join("empty/dot.png")).unwrap();
    assert_refused(&["vocabulary", "train", "--images", &empty, "--out", &path(&none)], &["dot.png", "1 x 1"]);
    assert!(!none.exists());
}
