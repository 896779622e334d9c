//! Memory and time of large models: 10 k cells with 1 M words at K = 100, then 1 M cells with 50 M words at K = 16.
#![allow(clippy::disallowed_methods, missing_docs, unreachable_pub, dead_code)]

mod workload;

use std::time::Instant;

use scene_model::project::Observation;
use scene_model::topics::{SceneConfig, SceneModel};

fn main() {
    let config = SceneConfig { cell_m: [1.0; 3], vocabulary: 1000, max_labels: 100, ..SceneConfig::default() };
    let before = resident_mb();
    let mut model = SceneModel::new(config.clone()).unwrap();
    for row in 0..100 {
        model.insert(f64::from(row), &strip(row, 100, 100));
    }
    model.sweep(10);
    let _ = model.label_map();
    println!("10 k cells, 1 M words, K 100: {:.0} MB", resident_mb() - before);
    drop(model);

    let start = Instant::now();
    let mut model = SceneModel::new(SceneConfig { max_labels: 16, ..config }).unwrap();
    for row in 0..1000 {
        model.insert(f64::from(row), &strip(row, 1000, 50));
    }
    let inserted = start.elapsed().as_secs_f64();
    model.sweep(1);
    println!(
        "{} cells, {} words, K 16: {:.0} MB, insertion {inserted:.1} s, one sweep {:.1} s",
        model.cells(),
        model.words(),
        resident_mb(),
        start.elapsed().as_secs_f64() - inserted
    );
}

/// The words of one row of cells, with eight kinds of ground.
fn strip(row: u32, columns: u32, words_per_cell: u32) -> Vec<Observation> {
    let mut rng = workload::XorShiftRng(u64::from(row) * 7919 + 1);
    let mut seen = Vec::with_capacity((columns * words_per_cell) as usize);
    for column in 0..columns {
        let ground = (row / 20 * 3 + column / 30 * 5) % 8;
        for _ in 0..words_per_cell {
            let word = ground * 125 + (rng.unit() * rng.unit() * 250.0) as u32;
            let (x, y) = (f64::from(column) + 0.5, f64::from(row) + 0.5);
            seen.push(Observation { word: word % 1000, x, y, z: 0.0 });
        }
    }
    seen
}

/// The resident memory of this process in MB (on Linux; elsewhere NaN).
fn resident_mb() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    line.and_then(|text| text.trim().trim_end_matches(" kB").parse::<f64>().ok()).map_or(f64::NAN, |kb| kb / 1024.0)
}
