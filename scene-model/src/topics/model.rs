//! The scene model: words are inserted, refined, and turned into a label map.

use std::sync::{Mutex, MutexGuard, PoisonError};

use super::cells::{Cells, centre_of, coord_of};
use super::config::{ConfigError, SceneConfig};
use super::kernel::Kernel;
use super::label_map::{FlatCell, MapCache};
use super::labels::{Labels, TopicId, word_of};
use super::sampler::{MixedSchedule, SamplerPool, phase_words};
use super::snapshot::Snapshot;
use crate::project::Observation;
use crate::random::{CounterRng, derive};

/// The counts of accepted and skipped observations of one [`SceneModel::insert`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Inserted {
    /// Words that are in the model now.
    pub accepted: u64,
    /// Words with a position that is not finite or out of range, or with an id beyond the vocabulary.
    pub skipped_bad: u64,
    /// Words of cells that had [`max_words_per_cell`](SceneConfig::max_words_per_cell) words already.
    pub skipped_full: u64,
}

/// For each four refined cells, one further cell of the map is evaluated again in turn, since
/// neighbours and topics have changed.
const REFRESH_SHARE: usize = 4;

/// The scene model of one mission.
///
/// Memory grows with the explored area: each cell takes about 100 bytes, 2 bytes for each label slot and 4 bytes for
/// each word. The table of word counts takes 4 bytes for each pair of label slot and vocabulary word.
///
/// ```
/// use scene_model::project::Observation;
/// use scene_model::topics::{SceneConfig, SceneModel};
///
/// let config = SceneConfig { cell_m: [1.0, 1.0, 1e4], vocabulary: 10, ..SceneConfig::default() };
/// let mut model = SceneModel::new(config)?;
///
/// // Twenty cells in a row. Words 0 to 4 occur in the western half, words 5 to 9 in the eastern half.
/// let words = (0..1000u32).map(|i| {
///     let east = i % 20;
///     Observation { word: i / 20 % 5 + if east < 10 { 0 } else { 5 }, x: f64::from(east) + 0.5, y: 0.5, z: 0.0 }
/// });
/// let inserted = model.insert(0.0, &words.collect::<Vec<_>>());
/// assert_eq!(inserted.accepted, 1000);
/// model.sweep(50);
///
/// let map = model.label_map();
/// assert_eq!(map.len(), 20);
/// assert_eq!(map[0].topic, map[5].topic);
/// assert_ne!(map[0].topic, map[19].topic);
/// # Ok::<(), scene_model::topics::ConfigError>(())
/// ```
#[derive(Debug)]
pub struct SceneModel {
    config: SceneConfig,
    kernel: Kernel,
    cells: Cells,
    labels: Labels,
    sampler: SamplerPool,
    schedule: MixedSchedule,
    rng: CounterRng,
    /// The number of phases so far, from which the key of the next phase's random numbers is derived.
    phases: u64,
    /// The next cell to evaluate again although its own words have not changed.
    next_refresh: u32,
    last_seen_s: f64,
    map: Mutex<MapCache>,
}

impl SceneModel {
    /// Returns an empty model. Fails if a parameter is out of its range.
    ///
    /// It uses the widest vectors of this machine and one thread.
    pub fn new(config: SceneConfig) -> Result<Self, ConfigError> {
        config.check()?;
        let labels = Labels::new(&config);
        let kernel = Kernel::detect();
        Ok(Self {
            cells: Cells::new(labels.blocks, config.colour_levels),
            sampler: SamplerPool::new(labels.blocks, kernel, 1),
            kernel,
            schedule: MixedSchedule::default(),
            rng: CounterRng::new(config.seed),
            phases: 0,
            next_refresh: 0,
            last_seen_s: f64::NEG_INFINITY,
            map: Mutex::default(),
            labels,
            config,
        })
    }

    pub(super) fn snapshot(&self) -> Snapshot {
        let (topics, next_topic) = self.labels.topics();
        let cells = (0..self.cells.len() as u32).map(|cell| (self.cells.coord(cell), self.cells.words(cell).to_vec()));
        Snapshot {
            config: self.config.clone(),
            rng: self.rng.clone(),
            phases: self.phases,
            next_refresh: self.next_refresh,
            last_seen_s: self.last_seen_s,
            recent: self.schedule.recent().to_vec(),
            topics: topics.to_vec(),
            next_topic,
            cells: cells.collect(),
        }
    }

    /// The model of a checked snapshot; the next map evaluates every cell.
    pub(super) fn restore(snapshot: Snapshot) -> Self {
        let (cells, labels) = snapshot.rebuild();
        let kernel = Kernel::detect();
        let (mut schedule, mut map) = (MixedSchedule::default(), MapCache::default());
        schedule.set_recent(&snapshot.recent);
        (0..cells.len() as u32).for_each(|cell| map.mark_stale(cell));
        Self {
            sampler: SamplerPool::new(labels.blocks, kernel, 1),
            kernel,
            schedule,
            rng: snapshot.rng,
            phases: snapshot.phases,
            next_refresh: snapshot.next_refresh,
            last_seen_s: snapshot.last_seen_s,
            map: Mutex::new(map),
            config: snapshot.config,
            cells,
            labels,
        }
    }

    /// The parameters, including later changes by [`SceneModel::set_priors`].
    pub fn config(&self) -> &SceneConfig {
        &self.config
    }

    /// Changes the priors. Words keep their labels and labels their topics; the next map evaluates every cell with the
    /// new priors.
    ///
    /// Fails without any effect if a prior is out of its range.
    pub fn set_priors(&mut self, alpha: f64, beta: f64, gamma: f64) -> Result<(), ConfigError> {
        let config = SceneConfig { alpha, beta, gamma, ..self.config.clone() };
        config.check()?;
        if config == self.config {
            return Ok(());
        }
        self.config = config;
        self.labels.set_priors(&self.config);
        (0..self.cells.len() as u32).for_each(|cell| self.mark_stale(cell));
        Ok(())
    }

    /// Lets no topic be born while `limit` or more are in use; [`max_labels`](SceneConfig::max_labels) bounds them anyway.
    /// Topics in use stay. A new model has no such limit, and a loaded one neither.
    ///
    /// With few words, literal birth weights make a topic of every nuance, and no slot is left for what comes later.
    pub fn limit_labels(&mut self, limit: usize) {
        self.labels.set_limit(limit);
    }

    /// The vector instructions in use.
    #[must_use]
    pub fn kernel(&self) -> Kernel {
        self.kernel
    }

    /// Switches to another kernel if this machine can run it, and returns whether `kernel` is in use now. The labels
    /// do not depend on it.
    pub fn use_kernel(&mut self, kernel: Kernel) -> bool {
        if kernel.is_available() {
            self.kernel = kernel;
            self.sampler = SamplerPool::new(self.labels.blocks, kernel, self.sampler.threads());
        }
        self.kernel == kernel
    }

    /// Sets the number of sampling threads, at least 1; a new model has 1. The labels do not depend on it.
    ///
    /// Only phases of more than about 8000 words use a second thread.
    pub fn use_threads(&mut self, threads: usize) {
        self.sampler = SamplerPool::new(self.labels.blocks, self.kernel, threads);
    }

    /// The time of the newest observation in seconds; minus infinity before the first.
    #[must_use]
    pub fn last_seen_s(&self) -> f64 {
        self.last_seen_s
    }

    /// Adds words that were seen at the time `t_s`, in seconds, and gives each a first label.
    ///
    /// Words that the model cannot hold are counted and skipped. The time is used for [`SceneModel::last_seen_s`] alone.
    pub fn insert(&mut self, t_s: f64, observations: &[Observation]) -> Inserted {
        self.last_seen_s = self.last_seen_s.max(t_s);
        let mut outcome = Inserted::default();
        let mut touched: Vec<(u32, usize)> = Vec::new();
        for seen in observations {
            let coord = coord_of([seen.x, seen.y, seen.z], self.config.cell_m);
            let Some(coord) = coord.filter(|_| seen.word < self.config.vocabulary) else {
                outcome.skipped_bad += 1;
                continue;
            };
            let cell = self.cells.find_or_add(coord);
            let before = self.cells.words(cell).len();
            if before >= self.config.max_words_per_cell as usize {
                outcome.skipped_full += 1;
                continue;
            }
            self.cells.push(cell, seen.word);
            touched.push((cell, before));
            outcome.accepted += 1;
        }
        self.label_new(&mut touched);
        outcome
    }

    /// Labels new words cell by cell, with up-to-date counts for each cell.
    fn label_new(&mut self, touched: &mut Vec<(u32, usize)>) {
        touched.sort_unstable();
        touched.dedup_by_key(|entry| entry.0);
        self.cells.update_affinity(touched.iter().map(|entry| entry.0));
        for &(cell, first) in touched.iter() {
            let phase = self.next_phase();
            self.sampler.phase(&mut self.cells, &mut self.labels, [(cell, first)].into_iter(), phase);
            self.mark_stale(cell);
        }
        if !touched.is_empty() {
            let cells: Vec<u32> = touched.iter().map(|entry| entry.0).collect();
            self.schedule.set_recent(&cells);
        }
    }

    /// Resamples at least `words` words on the mixed online schedule (arXiv 1509.03242), and returns their number.
    ///
    /// Half of the draws go to the cells of the last [`SceneModel::insert`]. Call it after each frame with as many
    /// words as the processor allows: 15 to 60 million words a second on one core.
    pub fn refine(&mut self, words: u64) -> u64 {
        let mut done = 0;
        while done < words && self.cells.total() > 0 {
            let want = (words - done).min(2 * phase_words(self.cells.total()));
            let round = self.schedule.draw(&self.cells, want, &mut self.rng);
            for cells in &round {
                done += self.phase(cells);
            }
            for _ in 0..(round[0].len() + round[1].len()).div_ceil(REFRESH_SHARE) {
                let next = self.next_refresh;
                self.mark_stale(next);
                self.next_refresh = (next + 1) % self.cells.len() as u32;
            }
        }
        done
    }

    /// Resamples every word `sweeps` times, and returns the number of draws. Use it offline;
    /// 30 sweeps are usually enough.
    pub fn sweep(&mut self, sweeps: u32) -> u64 {
        let mut colours = [Vec::new(), Vec::new()];
        for cell in 0..self.cells.len() as u32 {
            colours[self.cells.colour(cell)].push(cell);
        }
        let mut done = 0;
        for _ in 0..sweeps {
            let max_words = phase_words(self.cells.total());
            for cells in &colours {
                let mut rest = cells.as_slice();
                while !rest.is_empty() {
                    let (phase, later) = rest.split_at(self.phase_length(rest, max_words));
                    done += self.phase(phase);
                    rest = later;
                }
            }
        }
        done
    }

    /// How many of the next cells fit into a phase of `max_words` words; at least one.
    fn phase_length(&self, cells: &[u32], max_words: u64) -> usize {
        let mut words = 0;
        let fitting = cells.iter().take_while(|&&cell| {
            words += self.cells.words(cell).len() as u64;
            words <= max_words
        });
        fitting.count().max(1)
    }

    /// Resamples cells of one checkerboard colour.
    fn phase(&mut self, cells: &[u32]) -> u64 {
        let phase = self.next_phase();
        let list = cells.iter().map(|&cell| (cell, 0));
        let done = self.sampler.phase(&mut self.cells, &mut self.labels, list, phase);
        cells.iter().for_each(|&cell| self.mark_stale(cell));
        done
    }

    fn next_phase(&mut self) -> u64 {
        self.phases += 1;
        derive(self.config.seed, self.phases)
    }

    fn mark_stale(&mut self, cell: u32) {
        self.map.get_mut().unwrap_or_else(PoisonError::into_inner).mark_stale(cell);
    }

    /// The number of cells with words.
    #[must_use]
    pub fn cells(&self) -> usize {
        self.cells.len()
    }

    /// The number of words in all cells.
    #[must_use]
    pub fn words(&self) -> u64 {
        self.cells.total()
    }

    /// Returns every word that the model holds, at the middle of its cell, in the order of the first observation of the
    /// cells.
    pub fn observations(&self) -> impl Iterator<Item = Observation> {
        (0..self.cells.len() as u32).flat_map(|cell| {
            let [x, y, z] = centre_of(self.cells.coord(cell), self.config.cell_m);
            self.cells.words(cell).iter().map(move |&packed| Observation { word: word_of(packed), x, y, z })
        })
    }

    /// The number of topics in use. It tends to run up to [`max_labels`](SceneConfig::max_labels).
    #[must_use]
    pub fn labels(&self) -> usize {
        self.labels.in_use()
    }

    /// exp(-mean ln p(w)) over all words, with own and neighbour counts; 1 for an empty model.
    ///
    /// It is in-sample: a measure of surprise. Do not choose parameters by it.
    #[must_use]
    pub fn perplexity(&self) -> f64 {
        self.fresh_map().perplexity()
    }

    /// Returns the label map flattened to two dimensions, sorted by `(y, x)`.
    ///
    /// The label of a cell is the mode of the MAP labels of its words. Where cells lie above each other, the label with
    /// the most words in the column wins, ties to the upper cell. Only the cells that were resampled since the last call
    /// are evaluated, and after [`SceneModel::refine`] a share of the others in turn.
    #[must_use]
    pub fn label_map(&self) -> Vec<FlatCell> {
        self.fresh_map().flatten(&self.cells)
    }

    /// Returns the label of every cell in three dimensions, sorted by `(y, x)`, then from top to bottom.
    #[must_use]
    pub fn label_volume(&self) -> Vec<FlatCell> {
        self.fresh_map().volume(&self.cells)
    }

    #[cfg(test)]
    pub(crate) fn parts(&self) -> (&Cells, &Labels) {
        (&self.cells, &self.labels)
    }

    /// Returns the topics that the model expects at a position in metres, observed or not, with their probabilities.
    ///
    /// The probability of a topic is its prior there: (n_k + alpha) over the sum for all topics in use. The
    /// largest comes first, ties to the oldest topic. The list is empty if neither the cell of the position
    /// nor a neighbour has words.
    #[must_use]
    pub fn expected_at(&self, position: [f64; 3]) -> Vec<(TopicId, f32)> {
        let Some(coord) = coord_of(position, self.config.cell_m) else { return Vec::new() };
        let counts = self.cells.counts_around(coord);
        let total: u32 = counts.iter().sum();
        if total == 0 {
            return Vec::new();
        }
        let mass = f64::from(total) + self.config.alpha * self.labels.in_use() as f64;
        let share = |(slot, &count): (usize, &u32)| {
            let topic = self.labels.topic(slot as u32)?;
            Some((topic, ((f64::from(count) + self.config.alpha) / mass) as f32))
        };
        let mut shares: Vec<(TopicId, f32)> = counts.iter().enumerate().filter_map(share).collect();
        shares.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        shares
    }

    fn fresh_map(&self) -> MutexGuard<'_, MapCache> {
        let mut map = self.map.lock().unwrap_or_else(PoisonError::into_inner);
        map.refresh(self.kernel, &self.cells, &self.labels);
        map
    }
}
