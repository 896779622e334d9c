//! Work on each annotated image of a folder, on all cores.

use crate::annotated_images::Pair;
use crate::progress::Progress;
use scenecast_core::UserError;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

/// The annotated images of a folder, and the progress of the work on them.
pub struct Scenes<'a> {
    pairs: &'a [Pair],
    /// Steps that are done, of `steps`.
    progress: Mutex<(Progress, usize)>,
    steps: usize,
}

impl<'a> Scenes<'a> {
    /// Shows that `task` begins; the work on each scene has `steps` steps, in one or more passes.
    pub fn new(task: &'static str, pairs: &'a [Pair], steps: usize) -> Self {
        Self { pairs, progress: Mutex::new((Progress::new(task), 0)), steps: (steps * pairs.len()).max(1) }
    }

    /// The results of `work` in the order of the scenes, or the first error in that order. `work` calls its last
    /// argument after each step.
    pub fn each<T: Send>(
        &self,
        work: impl Fn(usize, &Pair, &dyn Fn()) -> Result<T, UserError> + Sync,
    ) -> Result<Vec<T>, UserError> {
        let (next, done) = (AtomicUsize::new(0), Mutex::new(BTreeMap::new()));
        let take = || {
            loop {
                let index = next.fetch_add(1, Ordering::Relaxed);
                let Some(pair) = self.pairs.get(index) else { return };
                let result = work(index, pair, &|| self.step());
                if result.is_err() {
                    next.store(self.pairs.len(), Ordering::Relaxed);
                }
                done.lock().unwrap_or_else(PoisonError::into_inner).insert(index, result);
            }
        };
        let threads = std::thread::available_parallelism().map_or(1, usize::from).min(self.pairs.len());
        std::thread::scope(|scope| (0..threads).for_each(|_| drop(scope.spawn(take))));
        done.into_inner().unwrap_or_else(PoisonError::into_inner).into_values().collect()
    }

    fn step(&self) {
        let mut progress = self.progress.lock().unwrap_or_else(PoisonError::into_inner);
        progress.1 += 1;
        let share = progress.1 as f64 / self.steps as f64;
        progress.0.show(share);
    }
}
