//! The model: words go in, are refined, and come out as a label map.

use std::sync::{Mutex, MutexGuard, PoisonError};

use super::cells::Cells;
use super::checkpoint::Snapshot;
use super::config::{ConfigError, SceneConfig};
use super::gibbs::Workshop;
use super::grid::coord_of;
use super::kernel::Kernel;
use super::label_map::{FlatCell, MapCache};
use super::labels::{Labels, TopicId};
use super::schedule::{Mixed, phase_words};
use crate::project::Observation;
use crate::random::{Stream, derive};

/// What became of the observations of one call of [`SceneModel::insert`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Inserted {
    /// Words now in the model.
    pub accepted: u64,
    /// Positions that are no finite numbers or out of reach, word ids beyond the vocabulary.
    pub skipped_bad: u64,
    /// Words of cells that are full.
    pub skipped_full: u64,
}

/// One more cell is evaluated anew, in turn, for so many refined ones: its neighbours and the labels have changed.
const TOUCH_SHARE: usize = 4;

/// The scene model of one mission.
///
/// Memory grows with the explored area: about 2 bytes a label slot and 100 bytes a cell, 4 bytes a word (up to the
/// bound per cell), 4 bytes a label slot and vocabulary word.
#[derive(Debug)]
pub struct SceneModel {
    config: SceneConfig,
    kernel: Kernel,
    cells: Cells,
    labels: Labels,
    workshop: Workshop,
    schedule: Mixed,
    chance: Stream,
    /// Number of phases so far: the key of the next one's random numbers.
    phases: u64,
    /// The next cell whose view is refreshed though its own words stood still.
    next_touch: u32,
    last_seen_s: f64,
    map: Mutex<MapCache>,
}

impl SceneModel {
    /// An empty model; fails if a parameter is out of its range.
    pub fn new(config: SceneConfig) -> Result<Self, ConfigError> {
        config.check()?;
        let labels = Labels::new(&config);
        let kernel = Kernel::detect();
        Ok(Self {
            cells: Cells::new(labels.blocks, config.colour_levels),
            workshop: Workshop::new(labels.blocks, kernel, 1),
            kernel,
            schedule: Mixed::default(),
            chance: Stream::new(config.seed),
            phases: 0,
            next_touch: 0,
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
            chance: self.chance.clone(),
            phases: self.phases,
            next_touch: self.next_touch,
            last_seen_s: self.last_seen_s,
            recent: self.schedule.recent().to_vec(),
            topics: topics.to_vec(),
            next_topic,
            cells: cells.collect(),
        }
    }

    /// From a snapshot that was checked; every cell is evaluated anew.
    pub(super) fn restore(snapshot: Snapshot) -> Self {
        let (cells, labels) = snapshot.rebuild();
        let kernel = Kernel::detect();
        let (mut schedule, mut map) = (Mixed::default(), MapCache::default());
        schedule.just_seen(&snapshot.recent);
        (0..cells.len() as u32).for_each(|cell| map.touch(cell));
        Self {
            workshop: Workshop::new(labels.blocks, kernel, 1),
            kernel,
            schedule,
            chance: snapshot.chance,
            phases: snapshot.phases,
            next_touch: snapshot.next_touch,
            last_seen_s: snapshot.last_seen_s,
            map: Mutex::new(map),
            config: snapshot.config,
            cells,
            labels,
        }
    }

    /// The parameters that the model was made with.
    pub fn config(&self) -> &SceneConfig {
        &self.config
    }

    /// Goes on with other priors: words keep their labels and labels their topics, and what the map shows is evaluated anew.
    /// Fails, and changes nothing, if one is out of its range.
    pub fn set_priors(&mut self, alpha: f64, beta: f64, gamma: f64) -> Result<(), ConfigError> {
        let config = SceneConfig { alpha, beta, gamma, ..self.config.clone() };
        config.check()?;
        if config == self.config {
            return Ok(());
        }
        self.config = config;
        self.labels.set_priors(&self.config);
        (0..self.cells.len() as u32).for_each(|cell| self.touch(cell));
        Ok(())
    }

    /// The vector units in use.
    pub fn kernel(&self) -> Kernel {
        self.kernel
    }

    /// Uses other vector units, if this machine has them; the labels stay the same bit for bit.
    pub fn use_kernel(&mut self, kernel: Kernel) -> bool {
        if kernel.is_available() {
            self.kernel = kernel;
            self.workshop = Workshop::new(self.labels.blocks, kernel, self.workshop.threads());
        }
        self.kernel == kernel
    }

    /// Samples with so many threads (1 at the start); the labels stay the same bit for bit.
    pub fn use_threads(&mut self, threads: usize) {
        self.workshop = Workshop::new(self.labels.blocks, self.kernel, threads);
    }

    /// Time of the newest observation, seconds; minus infinity before the first.
    pub fn last_seen_s(&self) -> f64 {
        self.last_seen_s
    }

    /// Adds words seen at time `t_s` (seconds) and gives each a first label; bad readings are counted and skipped.
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

    /// Labels new words cell by cell, each cell against settled counts.
    fn label_new(&mut self, touched: &mut Vec<(u32, usize)>) {
        touched.sort_unstable();
        touched.dedup_by_key(|entry| entry.0);
        self.cells.weigh(touched.iter().map(|entry| entry.0));
        for &(cell, first) in touched.iter() {
            let phase = self.next_phase();
            self.workshop.phase(&mut self.cells, &mut self.labels, [(cell, first)].into_iter(), phase);
            self.touch(cell);
        }
        if !touched.is_empty() {
            let cells: Vec<u32> = touched.iter().map(|entry| entry.0).collect();
            self.schedule.just_seen(&cells);
        }
    }

    /// Resamples about `words` words on the mixed online schedule; returns how many it were.
    pub fn refine(&mut self, words: u64) -> u64 {
        let mut done = 0;
        while done < words && self.cells.total() > 0 {
            let want = (words - done).min(2 * phase_words(self.cells.total()));
            let round = self.schedule.draw(&self.cells, want, &mut self.chance);
            for cells in &round {
                done += self.phase(cells);
            }
            for _ in 0..(round[0].len() + round[1].len()).div_ceil(TOUCH_SHARE) {
                let next = self.next_touch;
                self.touch(next);
                self.next_touch = (next + 1) % self.cells.len() as u32;
            }
        }
        done
    }

    /// Resamples every word `sweeps` times; returns how many words that were.
    pub fn sweep(&mut self, sweeps: u32) -> u64 {
        let mut colours = [Vec::new(), Vec::new()];
        for cell in 0..self.cells.len() as u32 {
            colours[self.cells.colour(cell)].push(cell);
        }
        let mut done = 0;
        for _ in 0..sweeps {
            let most = phase_words(self.cells.total());
            for cells in &colours {
                let mut rest = cells.as_slice();
                while !rest.is_empty() {
                    let (phase, later) = rest.split_at(self.phase_length(rest, most));
                    done += self.phase(phase);
                    rest = later;
                }
            }
        }
        done
    }

    /// How many of the next cells fit a phase of `most` words; at least one.
    fn phase_length(&self, cells: &[u32], most: u64) -> usize {
        let mut words = 0;
        let fitting = cells.iter().take_while(|&&cell| {
            words += self.cells.words(cell).len() as u64;
            words <= most
        });
        fitting.count().max(1)
    }

    /// Resamples cells of one colour.
    fn phase(&mut self, cells: &[u32]) -> u64 {
        let phase = self.next_phase();
        let list = cells.iter().map(|&cell| (cell, 0));
        let done = self.workshop.phase(&mut self.cells, &mut self.labels, list, phase);
        cells.iter().for_each(|&cell| self.touch(cell));
        done
    }

    fn next_phase(&mut self) -> u64 {
        self.phases += 1;
        derive(self.config.seed, self.phases)
    }

    fn touch(&mut self, cell: u32) {
        self.map.get_mut().unwrap_or_else(PoisonError::into_inner).touch(cell);
    }

    /// Cells with words.
    pub fn cells(&self) -> usize {
        self.cells.len()
    }

    /// Words in all cells.
    pub fn words(&self) -> u64 {
        self.cells.total()
    }

    /// Topics in use.
    pub fn labels(&self) -> usize {
        self.labels.active()
    }

    /// exp(-mean ln p(w)) over all words, with own and neighbour counts; in-sample, so a signal and no score.
    pub fn perplexity(&self) -> f64 {
        self.fresh_map().perplexity()
    }

    /// The label map flattened to two dimensions, sorted by (y, x).
    ///
    /// The label of a cell is the mode of its words' MAP labels; where cells stack, the label with most words in the
    /// column wins, ties to the upper cell. Only cells that changed since the last call are evaluated.
    pub fn label_map(&self) -> Vec<FlatCell> {
        self.fresh_map().flatten(&self.cells)
    }

    /// The label of every cell in three dimensions, sorted by (y, x), then from top to bottom.
    pub fn label_volume(&self) -> Vec<FlatCell> {
        self.fresh_map().volume(&self.cells)
    }

    #[cfg(test)]
    pub(crate) fn parts(&self) -> (&Cells, &Labels) {
        (&self.cells, &self.labels)
    }

    /// What the model expects at a place (metres), seen already or not: each topic in use with its prior share there,
    /// (n_k + alpha) / sum, largest first, ties to the oldest. Empty where nothing was seen at or next to the place.
    pub fn expected_at(&self, position: [f64; 3]) -> Vec<(TopicId, f32)> {
        let Some(coord) = coord_of(position, self.config.cell_m) else { return Vec::new() };
        let counts = self.cells.counts_around(coord);
        let total: u32 = counts.iter().sum();
        if total == 0 {
            return Vec::new();
        }
        let mass = f64::from(total) + self.config.alpha * self.labels.active() as f64;
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
