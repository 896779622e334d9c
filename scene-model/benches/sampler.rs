//! Words resampled per second on the synthetic workload.
#![allow(clippy::disallowed_methods, missing_docs, unreachable_pub)]

#[path = "workload/mod.rs"]
mod workload;

use std::time::Instant;

use scene_model::topics::{Kernel, SceneConfig, SceneModel};
use scene_model::tuning::mutual_information_nats;

fn main() {
    let work = workload::workload(1, 100, 100, 1000);
    for kernel in [Kernel::Portable, Kernel::Avx2, Kernel::Avx512] {
        for max_labels in [8, 16, 32, 100] {
            let config =
                SceneConfig { cell_m: [1.0; 3], vocabulary: work.vocabulary, max_labels, ..SceneConfig::default() };
            let mut model = SceneModel::new(config).unwrap();
            if !model.use_kernel(kernel) {
                continue;
            }
            let start = Instant::now();
            model.insert(0.0, &work.observations);
            let inserted = start.elapsed().as_secs_f64();
            let start = cpu_seconds();
            let words = model.sweep(30);
            let seconds = cpu_seconds() - start;
            let start = Instant::now();
            let map = model.label_map();
            let map_ms = start.elapsed().as_secs_f64() * 1e3;
            let start = Instant::now();
            model.label_map();
            let map2_ms = start.elapsed().as_secs_f64() * 1e3;
            let pairs = map.iter().map(|c| (c.topic.0, work.truth[(c.y * work.side + c.x) as usize]));
            let score = mutual_information_nats(pairs);
            println!(
                "{:8} K {max_labels:3}: {:6.1} M words/s, insert {:.0} ms, map {map_ms:.1} ms, again {map2_ms:.2} ms, MI {:.3}, labels {}, perplexity {:.1}",
                kernel.name(),
                words as f64 / seconds / 1e6,
                inserted * 1e3,
                score.nats,
                model.labels(),
                model.perplexity(),
            );
        }
    }
}

/// CPU time of this thread, seconds.
fn cpu_seconds() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    text.split(' ').next().and_then(|ns| ns.parse::<f64>().ok()).unwrap_or(f64::NAN) * 1e-9
}
