//! Inference while a vehicle is under way: how many labels the model may have, and which topics its cells show.

use serde::{Deserialize, Serialize};

use crate::publish::TopicMemory;
use crate::topics::{FlatCell, SceneModel};

/// Labels that the first frame may have.
const FIRST_LABELS: f64 = 2.0;
/// The square root of the words seen divided by this is the number of further labels.
const WORDS_ROOT: f64 = 140.0;

/// Lets the labels of a model grow with its words, and remembers the topics of its cells.
///
/// If the first frames may use all labels, these stand for nuances of the first floor, and what comes later shares them
/// for the whole mission. The bound on labels therefore grows with the square root of the words seen:
/// 2 + sqrt(words) / 140. A model whose words are all there from the start needs no such bound.
///
/// ```
/// use scene_model::online::OnlineInference;
/// use scene_model::project::Observation;
/// use scene_model::topics::{SceneConfig, SceneModel};
///
/// let mut model = SceneModel::new(SceneConfig { cell_m: [1.0; 3], vocabulary: 10, ..SceneConfig::default() })?;
/// let mut online = OnlineInference::default();
/// for frame in 0..5u32 {
///     let word = |i: u32| Observation { word: i % 5 + i / 500 * 5, x: f64::from(frame + i / 100), y: 0.5, z: 0.0 };
///     let words: Vec<Observation> = (0..1000).map(word).collect();
///     online.expect(words.len(), &mut model);
///     model.insert(f64::from(frame), &words);
///     model.refine(10_000);
///     let map = online.learn(f64::from(frame), &model);
///     assert_eq!(map, online.map(&model));
/// }
/// assert!(model.labels() <= 3);
/// # Ok::<(), scene_model::topics::ConfigError>(())
/// ```
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct OnlineInference {
    /// Words of all frames, those of full cells included.
    seen_words: u64,
    memory: TopicMemory,
}

impl OnlineInference {
    /// Makes room for the labels of a frame with `words` words, before they are inserted.
    pub fn expect(&mut self, words: usize, model: &mut SceneModel) {
        self.seen_words = self.seen_words.saturating_add(words as u64);
        model.limit_labels((FIRST_LABELS + (self.seen_words as f64).sqrt() / WORDS_ROOT).round() as usize);
    }

    /// Returns the map of the model after a frame of the time `t_s`, in seconds.
    pub fn learn(&mut self, t_s: f64, model: &SceneModel) -> Vec<FlatCell> {
        let map = model.label_map();
        self.memory.learn(t_s, &map);
        self.memory.steady(&map)
    }

    /// Returns the map of the model again, without another frame.
    #[must_use]
    pub fn map(&self, model: &SceneModel) -> Vec<FlatCell> {
        self.memory.steady(&model.label_map())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::project::Observation;
    use crate::topics::SceneConfig;

    #[test]
    fn labels_grow_with_the_words_up_to_the_bound() {
        let config = SceneConfig { cell_m: [1.0; 3], vocabulary: 64, gamma: 0.1, ..SceneConfig::default() };
        let mut model = SceneModel::new(config).unwrap();
        let mut inference = OnlineInference::default();
        let mut labels = Vec::new();
        for frame in 0..200u32 {
            let word = |i: u32| Observation {
                word: (i / 50 % 8 * 8 + i % 8 + frame) % 64,
                x: f64::from(i % 20),
                y: f64::from(frame),
                z: 0.0,
            };
            let words: Vec<Observation> = (0..20_000).map(word).collect();
            inference.expect(words.len(), &mut model);
            model.insert(f64::from(frame), &words);
            labels.push(model.labels());
        }
        assert!(labels[0] <= 3 && labels[24] <= 9, "{labels:?}");
        assert!(*labels.last().unwrap() > 9 && labels.iter().all(|&labels| labels <= 16), "{labels:?}");
    }
}
