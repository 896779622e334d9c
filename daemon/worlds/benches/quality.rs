//! Mutual information with the true labels of the synthetic workload over 8 seeds: at the true positions, and at
//! positions displaced by a Gaussian of half a cell.
//!
//! `cargo bench -p scenecast-worlds --bench quality`
#![allow(missing_docs, unreachable_pub)]

#[path = "../../../scene-model/benches/workload/mod.rs"]
mod workload;

use scene_model::topics::{SceneConfig, SceneModel};
use scenecast_worlds::scoring::mutual_information_nats;
use workload::{Workload, XorShiftRng};

const SWEEPS: u32 = 30;
const MAX_LABELS: u32 = 16;

fn main() {
    println!("{SWEEPS} sweeps, K bound {MAX_LABELS}, nats");
    println!("seed  entropy of the truth  MI  MI with noise  labels");
    let mut rows = [const { Vec::new() }; 4];
    for seed in 1..=8 {
        let (work, noisy) = (workload::workload(seed, 100, 100, 1000), displaced(seed, 0.5));
        let entropy = mutual_information_nats(work.truth.iter().map(|&label| (label, label))).nats;
        let ((mi, labels), (noisy_mi, _)) = (found(&work), found(&noisy));
        println!("{seed:4}  {entropy:20.3}  {mi:.3}  {noisy_mi:.3}  {labels}");
        let columns = [entropy, mi, mi / entropy, 1.0 - noisy_mi / mi];
        rows.iter_mut().zip(columns).for_each(|(row, value)| row.push(value));
    }
    let [entropy, mi, share, fall] = rows.map(|mut row| {
        row.sort_by(f64::total_cmp);
        [0.5 * (row[3] + row[4]), row[0], row[7]]
    });
    println!("median entropy {:.3}, median MI {:.3}, worst {:.3}", entropy[0], mi[0], mi[1]);
    println!("MI / entropy: median {:.3}, worst {:.3}", share[0], share[1]);
    println!("fall of MI with the noise: median {:.1} %, worst {:.1} %", 100.0 * fall[0], 100.0 * fall[2]);
}

fn displaced(seed: u64, sigma: f64) -> Workload {
    let mut work = workload::workload(seed, 100, 100, 1000);
    let mut rng = XorShiftRng(seed + 77);
    for seen in &mut work.observations {
        let radius = sigma * (-2.0 * (1.0 - rng.unit()).ln()).sqrt();
        let (sin, cos) = (std::f64::consts::TAU * rng.unit()).sin_cos();
        (seen.x, seen.y) = (seen.x + radius * cos, seen.y + radius * sin);
    }
    work
}

/// The mutual information of the map with the truth, and the number of different labels in the map.
fn found(work: &Workload) -> (f64, usize) {
    let config =
        SceneConfig { cell_m: [1.0; 3], vocabulary: work.vocabulary, max_labels: MAX_LABELS, ..SceneConfig::default() };
    let mut model = SceneModel::new(config).unwrap();
    model.insert(0.0, &work.observations);
    model.sweep(SWEEPS);
    let map = model.label_map();
    let pairs = map.iter().filter_map(|cell| {
        let inside = (0..work.side).contains(&cell.x) && (0..work.side).contains(&cell.y);
        inside.then(|| (cell.topic.0, work.truth[(cell.y * work.side + cell.x) as usize]))
    });
    let labels: std::collections::BTreeSet<_> = map.iter().map(|cell| cell.topic).collect();
    (mutual_information_nats(pairs).nats, labels.len())
}
