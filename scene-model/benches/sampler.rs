//! The speed of each kernel on the synthetic workload, next to a plain implementation in the same run.
//!
//! `cargo bench -p scene-model --bench sampler`; `-- avx2` selects a kernel. Divan's table has wall times. The
//! table below it has words per CPU-second of the sampling thread (on Linux; elsewhere of wall time), and the
//! ratio to the plain algorithm.
#![allow(clippy::disallowed_methods, missing_docs, unreachable_pub, dead_code)]

mod cpu;
mod plain;
mod workload;

use std::collections::BTreeMap;
use std::sync::{Mutex, OnceLock};

use cpu::cpu_seconds;
use divan::Bencher;
use divan::counter::ItemsCount;
use plain::PlainSampler;
use scene_model::topics::{Kernel, SceneConfig, SceneModel};
use workload::Workload;

const SWEEPS: u32 = 30;
const LABELS: [u32; 4] = [8, 16, 32, 100];
const PLAIN: &str = "plain";

/// Resampled words and CPU seconds, by method and K.
type Spent = BTreeMap<(&'static str, u32), (u64, f64)>;
static SPENT: Mutex<Spent> = Mutex::new(BTreeMap::new());

fn main() {
    divan::main();
    print_cpu_rates();
}

/// One sweep of the published algorithm: f64, one division for each label, one cumulative distribution for each word.
#[divan::bench(args = LABELS, sample_count = 3, sample_size = 1)]
fn plain_algorithm(bencher: Bencher<'_, '_>, labels: u32) {
    let work = work();
    let inputs = bencher.counter(words(1)).with_inputs(|| PlainSampler::new(work, labels as usize));
    inputs.bench_local_values(|mut plain| spend(PLAIN, labels, || plain.sweep()));
}

#[divan::bench(args = LABELS, sample_count = 3, sample_size = 1)]
fn portable(bencher: Bencher<'_, '_>, labels: u32) {
    sampler(bencher, Kernel::Portable, labels, 1);
}

#[divan::bench(args = LABELS, sample_count = 3, sample_size = 1)]
fn avx2(bencher: Bencher<'_, '_>, labels: u32) {
    sampler(bencher, Kernel::Avx2, labels, 1);
}

#[divan::bench(args = LABELS, sample_count = 3, sample_size = 1)]
fn avx512(bencher: Bencher<'_, '_>, labels: u32) {
    sampler(bencher, Kernel::Avx512, labels, 1);
}

/// The widest kernel with two threads: only divan's wall time is meaningful.
#[divan::bench(args = LABELS, sample_count = 3, sample_size = 1)]
fn two_threads(bencher: Bencher<'_, '_>, labels: u32) {
    sampler(bencher, Kernel::detect(), labels, 2);
}

/// 30 sweeps of a new model, with births.
fn sampler(bencher: Bencher<'_, '_>, kernel: Kernel, labels: u32, threads: usize) {
    if !kernel.is_available() {
        return;
    }
    let model = || {
        let work = work();
        let config =
            SceneConfig { cell_m: [1.0; 3], vocabulary: work.vocabulary, max_labels: labels, ..SceneConfig::default() };
        let mut model = SceneModel::new(config).unwrap();
        model.use_kernel(kernel);
        model.use_threads(threads);
        model.insert(0.0, &work.observations);
        model
    };
    bencher.counter(words(SWEEPS)).with_inputs(model).bench_local_values(|mut model| {
        let mut sweep = || model.sweep(SWEEPS);
        if threads == 1 { spend(kernel.name(), labels, sweep) } else { sweep() }
    });
}

fn spend(method: &'static str, labels: u32, mut work: impl FnMut() -> u64) -> u64 {
    let start = cpu_seconds();
    let words = work();
    let seconds = cpu_seconds() - start;
    let mut spent = SPENT.lock().unwrap();
    let entry = spent.entry((method, labels)).or_default();
    *entry = (entry.0 + words, entry.1 + seconds);
    words
}

fn print_cpu_rates() {
    let spent = SPENT.lock().unwrap();
    let rate = |method, labels| spent.get(&(method, labels)).map(|(words, seconds)| *words as f64 / seconds / 1e6);
    println!("\nM words per CPU-second (times the plain algorithm), births on");
    for labels in LABELS {
        let plain = rate(PLAIN, labels);
        print!("K {labels:3}:");
        for method in [PLAIN, "portable", "avx2", "avx512"] {
            let Some(found) = rate(method, labels) else { continue };
            let times = plain.map_or("-".to_owned(), |plain| format!("{:.1}", found / plain));
            print!("  {method} {found:.1} ({times})");
        }
        println!();
    }
}

fn work() -> &'static Workload {
    static WORK: OnceLock<Workload> = OnceLock::new();
    WORK.get_or_init(|| workload::workload(1, 100, 100, 1000))
}

fn words(sweeps: u32) -> ItemsCount {
    ItemsCount::new(work().observations.len() * sweeps as usize)
}
