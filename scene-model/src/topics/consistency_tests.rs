//! Property tests: after any sequence of calls, the counts of a model are the counts of its words.

use proptest::prelude::*;

use super::labels::{LANES, label_of, word_of};
use super::{Birth, Kernel, SceneConfig, SceneModel};
use crate::project::Observation;

#[derive(Clone, Debug)]
enum ModelStep {
    Insert(Vec<(i8, i8, i8, u32)>),
    Refine(u64),
    Sweep(u32),
    Map,
    Priors(f64, f64, f64),
}

fn step() -> impl Strategy<Value = ModelStep> {
    let place = (-4i8..4, -4i8..4, -1i8..2, 0u32..24);
    prop_oneof![
        4 => prop::collection::vec(place, 0..120).prop_map(ModelStep::Insert),
        3 => (0u64..400).prop_map(ModelStep::Refine),
        2 => (1u32..4).prop_map(ModelStep::Sweep),
        1 => Just(ModelStep::Map),
        1 => prop::sample::select(vec![(1e-9, 1e-9, 1e-12), (1e-3, 0.5, 0.0), (0.5, 0.1, 1e-5), (1e3, 1e3, 1e3)])
            .prop_map(|(alpha, beta, gamma)| ModelStep::Priors(alpha, beta, gamma)),
    ]
}

fn take(model: &mut SceneModel, step: &ModelStep) {
    match step {
        ModelStep::Insert(words) => {
            let seen = |&(x, y, z, word): &(i8, i8, i8, u32)| Observation {
                word,
                x: f64::from(x) + 0.5,
                y: f64::from(y) + 0.5,
                z: f64::from(z),
            };
            let observations: Vec<Observation> = words.iter().map(seen).collect();
            let outcome = model.insert(0.0, &observations);
            let all = outcome.accepted + outcome.skipped_bad + outcome.skipped_full;
            assert_eq!(all, observations.len() as u64);
        }
        ModelStep::Refine(words) => assert!(model.refine(*words) >= *words || model.words() == 0),
        ModelStep::Sweep(sweeps) => assert_eq!(model.sweep(*sweeps), u64::from(*sweeps) * model.words()),
        ModelStep::Map => drop(model.label_map()),
        ModelStep::Priors(alpha, beta, gamma) => model.set_priors(*alpha, *beta, *gamma).unwrap(),
    }
}

impl SceneModel {
    /// Panics if a count differs from the number of words that it stands for.
    pub(crate) fn assert_consistent(&self) {
        let (cells, labels) = self.parts();
        let mut rows = vec![0i32; labels.rows.len() * LANES];
        let mut total = 0;
        for cell in 0..cells.len() as u32 {
            let mut counts = vec![0u16; cells.width()];
            for &packed in cells.words(cell) {
                let label = label_of(packed);
                assert!(labels.topic(label).is_some(), "a word has a label that is not in use");
                counts[label as usize] += 1;
                rows[word_of(packed) as usize * labels.blocks * LANES + label as usize] += 1;
            }
            assert_eq!(counts, cells.counts(cell));
            assert!(cells.words(cell).len() <= self.config().max_words_per_cell as usize);
            total += cells.words(cell).len() as u64;
        }
        assert_eq!(total, cells.total());
        assert!(rows.iter().eq(labels.rows.iter().flat_map(|row| &row.0)));
        assert!(labels.in_use() <= self.config().max_labels as usize);
        for slot in 0..self.config().max_labels {
            let used = cells.total() > 0 && (0..cells.len() as u32).any(|cell| cells.counts(cell)[slot as usize] > 0);
            assert_eq!(labels.topic(slot).is_some(), used, "topics in use are those that words have");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn counts_are_consistent_after_any_sequence_of_calls(
        steps in prop::collection::vec(step(), 1..12),
        max_labels in prop::sample::select(vec![1u32, 2, 15, 16, 17, 40]),
        birth in prop::sample::select(vec![Birth::Literal, Birth::Collapsed, Birth::Rost]),
        gamma in prop::sample::select(vec![0.0, 1e-4, 0.1, 10.0]),
        seed in any::<u64>(),
    ) {
        let config = SceneConfig {
            cell_m: [1.0; 3], gamma, birth, max_labels, vocabulary: 20, max_words_per_cell: 30, seed,
            ..SceneConfig::default()
        };
        let mut model = SceneModel::new(config).unwrap();
        for step in &steps {
            take(&mut model, step);
            model.assert_consistent();
        }
        let map = model.label_map();
        prop_assert!(map.is_sorted_by_key(|cell| (cell.y, cell.x)));
        prop_assert!(map.iter().all(|cell| (0.0..=1.0).contains(&cell.confidence) && cell.perplexity >= 0.99));
    }

    #[test]
    fn every_kernel_gives_the_same_labels_bit_for_bit(
        steps in prop::collection::vec(step(), 1..8),
        max_labels in prop::sample::select(vec![1u32, 8, 16, 17, 32, 40, 100, 112, 150]),
        gamma in prop::sample::select(vec![1e-4, 1.0]),
        seed in any::<u64>(),
    ) {
        let config = SceneConfig {
            cell_m: [1.0; 3], gamma, max_labels, vocabulary: 24, seed, ..SceneConfig::default()
        };
        let run = |kernel| {
            let mut model = SceneModel::new(config.clone()).unwrap();
            assert!(model.use_kernel(kernel));
            steps.iter().for_each(|step| take(&mut model, step));
            let cells = model.parts().0;
            let words: Vec<Vec<u32>> = (0..cells.len() as u32).map(|cell| cells.words(cell).to_vec()).collect();
            (words, model.label_map())
        };
        let portable = run(Kernel::Portable);
        for kernel in [Kernel::Avx2, Kernel::Avx512].into_iter().filter(|kernel| kernel.is_available()) {
            prop_assert_eq!(&run(kernel), &portable);
        }
    }

    #[test]
    fn incremental_map_equals_a_map_from_scratch(
        steps in prop::collection::vec(step(), 1..8),
        seed in any::<u64>(),
    ) {
        let config =
            SceneConfig { cell_m: [1.0; 3], gamma: 0.01, vocabulary: 24, seed, ..SceneConfig::default() };
        let (mut watched, mut unwatched) =
            (SceneModel::new(config.clone()).unwrap(), SceneModel::new(config).unwrap());
        for step in &steps {
            take(&mut watched, step);
            take(&mut unwatched, step);
            let _ = watched.label_map();
        }
        watched.sweep(1);
        unwatched.sweep(1);
        prop_assert_eq!(watched.label_map(), unwatched.label_map());
    }
}

#[test]
fn labels_do_not_depend_on_the_number_of_threads() {
    let observations: Vec<Observation> = (0..600_000u32)
        .map(|i| Observation {
            word: (i * 7 + i / 6000 * 11) % 24,
            x: f64::from(i % 60),
            y: f64::from(i / 60 % 60),
            z: 0.0,
        })
        .collect();
    let run = |threads| {
        let config = SceneConfig { cell_m: [1.0; 3], vocabulary: 24, ..SceneConfig::default() };
        let mut model = SceneModel::new(config).unwrap();
        model.use_threads(threads);
        model.insert(0.0, &observations);
        model.sweep(2);
        model.refine(50_000);
        model.assert_consistent();
        (0..model.parts().0.len() as u32).map(|cell| model.parts().0.words(cell).to_vec()).collect::<Vec<_>>()
    };
    let alone = run(1);
    assert!(run(2) == alone && run(3) == alone);
}
