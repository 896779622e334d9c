//! Flies virtual cameras over mosaics and prints the error of the registration.
//!
//! `cargo run --release -p scenecast-registration --example flights -- FOLDER [case ...] [seeds=N]`, where `FOLDER` has the
//! images `eilatmixx/*.jpg` and `scripps_2014/2014_RGB_crop_1000.png`. Each scene is flown `N` times, with other motion and
//! relief. The motion is made up, the texture is real. Errors are in
//! cells of 0.25 m after the best rigid fit of all frames.

#![allow(clippy::disallowed_methods, reason = "an example reads files and measures its duration")]

mod flight;
mod floor;
mod relief;

use flight::{Case, Outcome, fly};
use floor::Floor;
use std::path::Path;

fn main() {
    let mut arguments = std::env::args().skip(1);
    let folder = arguments.next().expect("the folder of the images");
    let (numbers, wanted): (Vec<String>, Vec<String>) = arguments.partition(|word| word.starts_with("seeds="));
    let seeds = numbers.last().map_or(1, |word| word["seeds=".len()..].parse().expect("a number of seeds"));
    let is_wanted = |name: &str| wanted.is_empty() || wanted.iter().any(|word| word == name);
    let scenes = scenes(Path::new(&folder));
    assert!(!scenes.is_empty(), "no images in {folder}");
    println!("{:22} {:>6} {:>7} {:>7} {:>7} {:>7}  evidence", "flight", "dead", "placed", "p95", "solved", "ms");
    for case in Case::all().iter().filter(|case| is_wanted(case.name)) {
        let mut outcomes: Vec<Outcome> = Vec::new();
        for kind in 0..seeds {
            for (i, (name, floor)) in scenes.iter().enumerate() {
                let outcome = fly(floor, case, i as u64 + 1 + 100 * kind, kind);
                print_row(&format!("  {name}"), &outcome);
                outcomes.push(outcome);
            }
        }
        let mean = |of: fn(&Outcome) -> f64| outcomes.iter().map(of).sum::<f64>() / outcomes.len() as f64;
        println!(
            "{:22} {:6.2} {:7.3} {:7.3} {:7.3} {:7.2}",
            case.name,
            mean(|o| o.dead),
            mean(|o| o.placed),
            mean(|o| o.p95),
            mean(|o| o.solved),
            mean(|o| o.ms)
        );
    }
    for (name, floor) in [("ripples", Floor::ripples()), ("without texture", Floor::even())] {
        if is_wanted(name) {
            print_row(name, &fly(&floor, &Case::long(), 1, 0));
        }
    }
}

fn print_row(name: &str, outcome: &Outcome) {
    let Outcome { dead, placed, p95, solved, ms, slowest_ms, tally } = outcome;
    println!(
        "{name:22} {dead:6.2} {placed:7.3} {p95:7.3} {solved:7.3} {ms:7.2}  slowest {slowest_ms:.1} ms, {tally:?}"
    );
}

/// The mosaics of the folder, each with its name.
fn scenes(folder: &Path) -> Vec<(String, Floor)> {
    let mut files: Vec<_> = std::fs::read_dir(folder.join("eilatmixx"))
        .map(|entries| entries.filter_map(|entry| Some(entry.ok()?.path())).collect())
        .unwrap_or_default();
    files.retain(|path| path.extension().is_some_and(|extension| extension == "jpg"));
    files.sort();
    let mut scenes = Vec::new();
    let with_size = files.into_iter().map(|path| (path, 0.01));
    let scripps = folder.join("scripps_2014/2014_RGB_crop_1000.png");
    for (path, metres_per_pixel) in with_size.chain([(scripps, 0.025)]) {
        if let Ok(image) = image::open(&path) {
            let name = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
            scenes.push((name, Floor::new(&image.to_luma8(), metres_per_pixel)));
        }
    }
    scenes
}
