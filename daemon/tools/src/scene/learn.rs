//! A model learns from a source: in sweeps after all input, or online.

use super::usage::cpu_seconds;
use super::{Sighting, WordSource};
use scene_model::habitats::Habitats;
use scene_model::topics::{Inserted, SceneModel};
use scenecast_core::UserError;
use std::time::Instant;

/// Maximum time between two sightings for which the model refines, seconds.
const MAX_GAP_S: f64 = 60.0;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Schedule {
    /// This many sweeps over all words after the whole input was read.
    Sweeps(u32),
    /// This many words per second of the source's time, while the input is read.
    Online(f64),
}

#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct LearningEffort {
    pub(crate) resampled: u64,
    pub(crate) seconds: f64,
    /// CPU time of resampling, summed over all threads.
    pub(crate) cpu_seconds: f64,
    /// Counts of words that the model accepted and skipped.
    pub(crate) skipped: Inserted,
}

impl LearningEffort {
    fn measure(&mut self, work: impl FnOnce() -> u64) -> u64 {
        let (began, cpu) = (Instant::now(), cpu_seconds());
        let done = work();
        self.resampled += done;
        self.seconds += began.elapsed().as_secs_f64();
        self.cpu_seconds += cpu_seconds() - cpu;
        done
    }
}

/// Lets a model learn from a source; `progress` is called with the share that is done, 0..=1.
///
/// Online, the model refines for the time from one sighting to the next, and after the last one for
/// the mean of these times.
pub(crate) fn learn(
    model: &mut SceneModel,
    source: &mut dyn WordSource,
    schedule: Schedule,
    progress: &mut dyn FnMut(f64),
) -> Result<LearningEffort, UserError> {
    let mut effort = LearningEffort::default();
    let (mut owed, mut last, mut gaps) = (0.0, None, (0.0, 0u64));
    let mut refine = |model: &mut SceneModel, effort: &mut LearningEffort, words: f64| {
        owed += words;
        if owed >= 1.0 {
            owed -= effort.measure(|| model.refine(owed as u64)) as f64;
        }
    };
    let reading = if matches!(schedule, Schedule::Online(_)) { 1.0 } else { 0.3 };
    while let Some(Sighting { t_s, observations, done, .. }) = source.next()? {
        if let (Schedule::Online(rate), Some(last)) = (schedule, last) {
            let gap = f64::clamp(t_s - last, 0.0, MAX_GAP_S);
            gaps = (gaps.0 + gap, gaps.1 + 1);
            refine(model, &mut effort, rate * gap);
        }
        last = Some(t_s);
        let outcome = model.insert(t_s, &observations);
        effort.skipped.accepted += outcome.accepted;
        effort.skipped.skipped_bad += outcome.skipped_bad;
        effort.skipped.skipped_full += outcome.skipped_full;
        progress(reading * done);
    }
    match schedule {
        Schedule::Online(rate) => {
            let mean = if gaps.1 > 0 { gaps.0 / gaps.1 as f64 } else { 1.0 };
            refine(model, &mut effort, rate * mean);
        }
        Schedule::Sweeps(sweeps) => {
            for sweep in 0..sweeps {
                effort.measure(|| model.sweep(1));
                progress(reading + (1.0 - reading) * f64::from(sweep + 1) / f64::from(sweeps));
            }
        }
    }
    Ok(effort)
}

/// Learns habitats from all images of a source, as if seen at once: their order does not matter.
pub(crate) fn learn_habitats(
    habitats: &mut Habitats,
    source: &mut dyn WordSource,
    cell_m: f64,
    progress: &mut dyn FnMut(f64),
) -> Result<LearningEffort, UserError> {
    let mut effort = LearningEffort::default();
    while let Some(Sighting { observations, image: (size, points), done, .. }) = source.next()? {
        habitats.add(size, &points, &observations, cell_m);
        progress(0.8 * done);
    }
    effort.measure(|| {
        habitats.correct();
        0
    });
    Ok(effort)
}
