//! Words resampled per CPU-second on the synthetic workload, for each kernel, beside a plain re-implementation.
//!
//! `cargo bench -p scene-model --bench sampler`. It is its own harness because the figure of interest is a ratio within
//! one run. CPU time is of the sampling thread (Linux; elsewhere wall time).
#![allow(clippy::disallowed_methods, missing_docs, unreachable_pub)]

mod cpu;
mod plain;
mod workload;

use std::time::Instant;

use cpu::cpu_seconds;
use plain::Plain;
use scene_model::topics::{Kernel, SceneConfig, SceneModel};
use scene_model::tuning::mutual_information_nats;
use workload::{Chance, Workload};

const SWEEPS: u32 = 30;
const KERNELS: [Kernel; 3] = [Kernel::Portable, Kernel::Avx2, Kernel::Avx512];

fn main() {
    let work = workload::workload(1, 100, 100, 1000);
    println!("{} words in {} cells, V = {}", work.observations.len(), work.truth.len(), work.vocabulary);
    println!("M words per CPU-second, {SWEEPS} sweeps, births on (in brackets: times the plain algorithm)");
    for max_labels in [8, 16, 32, 100] {
        let plain = plain_rate(&work, max_labels);
        print!("K {max_labels:3}: plain {plain:4.1}");
        for kernel in KERNELS.into_iter().filter(|kernel| kernel.is_available()) {
            let (rate, _) = sampled(&work, max_labels, kernel, 1);
            print!(", {} {rate:.1} ({:.0} x)", kernel.name(), rate / plain);
        }
        println!();
    }
    for max_labels in [16, 100] {
        let wall = |threads| {
            let start = Instant::now();
            sampled(&work, max_labels, Kernel::detect(), threads);
            start.elapsed().as_secs_f64()
        };
        println!(
            "wall time at K {max_labels}, insertion included: 1 thread {:.2} s, 2 threads {:.2} s",
            wall(1),
            wall(2)
        );
    }
    quality();
}

/// Mutual information with the true labels over 8 seeds, with true positions and with noisy ones.
fn quality() {
    for (name, sigma) in [("true positions", 0.0), ("positions off by half a cell (Gaussian)", 0.5)] {
        let mut shares: Vec<f64> = (1..=8).map(|seed| share_found(seed, sigma)).collect();
        shares.sort_by(f64::total_cmp);
        println!("MI / entropy of the truth over 8 seeds, {name}: median {:.3}, worst {:.3}", shares[4], shares[0]);
    }
}

fn share_found(seed: u64, sigma: f64) -> f64 {
    let mut work = workload::workload(seed, 100, 100, 1000);
    let mut chance = Chance(seed + 77);
    for seen in &mut work.observations {
        let radius = sigma * (-2.0 * (1.0 - chance.unit()).ln()).sqrt();
        let (sin, cos) = (std::f64::consts::TAU * chance.unit()).sin_cos();
        (seen.x, seen.y) = (seen.x + radius * cos, seen.y + radius * sin);
    }
    let (_, model) = sampled(&work, 16, Kernel::detect(), 1);
    let pairs = model.label_map().into_iter().filter_map(|cell| {
        let inside = (0..work.side).contains(&cell.x) && (0..work.side).contains(&cell.y);
        inside.then(|| (cell.topic.0, work.truth[(cell.y * work.side + cell.x) as usize]))
    });
    mutual_information_nats(pairs).nats / entropy(&work.truth)
}

fn entropy(labels: &[u32]) -> f64 {
    mutual_information_nats(labels.iter().map(|&label| (label, label))).nats
}

fn sampled(work: &Workload, max_labels: u32, kernel: Kernel, threads: usize) -> (f64, SceneModel) {
    let config = SceneConfig { cell_m: [1.0; 3], vocabulary: work.vocabulary, max_labels, ..SceneConfig::default() };
    let mut model = SceneModel::new(config).unwrap();
    model.use_kernel(kernel);
    model.use_threads(threads);
    model.insert(0.0, &work.observations);
    let start = cpu_seconds();
    let words = model.sweep(SWEEPS);
    (words as f64 / (cpu_seconds() - start) / 1e6, model)
}

fn plain_rate(work: &Workload, labels: u32) -> f64 {
    let mut plain = Plain::new(work, labels as usize);
    let start = cpu_seconds();
    let words = plain.sweep();
    words as f64 / (cpu_seconds() - start) / 1e6
}
