//! From which camera frame each cell has its label, when that was taken by the vehicle's clock, and what the scene model knew then.

use crate::{SeenCell, SeenFrame};
use scene_model::project::Pose;
use scenecast_protocol::map::Cell;
use scenecast_protocol::time::Instant;
use std::collections::BTreeMap;
use std::sync::Arc;

/// A camera frame that was mapped.
#[derive(Debug, Clone, PartialEq)]
pub struct MappedFrame {
    /// Mission time at which it was taken, seconds.
    pub taken_s: f64,
    /// The pose of the camera in the vehicle's map frame: by registration, where that is on.
    pub camera: Pose,
}

/// Why a cell has its label.
#[derive(Debug, Clone, PartialEq)]
pub struct Evidence {
    /// The frame after which the cell changed.
    pub frame: Arc<MappedFrame>,
    /// Visual words in the cell after that frame.
    pub words: u32,
    /// How sure the label was then, 0 to 1.
    pub confidence: f32,
}

/// The evidence of each cell that has changed in this run.
#[derive(Debug, Default)]
pub(super) struct EvidenceByCell(BTreeMap<Cell, Evidence>);

impl EvidenceByCell {
    /// A frame has changed cells of the map.
    pub(super) fn handle_frame(&mut self, seen: &SeenFrame, frames: FrameClock) {
        let Some(taken) = frames.taken(seen.t_s) else { return };
        let frame = Arc::new(MappedFrame { taken_s: taken.as_secs_f64(), camera: seen.camera });
        for &SeenCell { cell, words, confidence } in &seen.cells {
            self.0.insert(cell, Evidence { frame: frame.clone(), words, confidence });
        }
    }

    pub(super) fn get(&self, cell: Cell) -> Option<&Evidence> {
        self.0.get(&cell)
    }

    /// Forgets all, because labels change their meaning.
    pub(super) fn clear(&mut self) {
        self.0.clear();
    }
}

/// Turns the times of camera frames into those of the vehicle's clock. Frames have a time of their own, which begins with the first
/// frame of the mission and goes on from one run of the program to the next.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct FrameClock {
    /// The first frame of this run, and what the vehicle's clock is ahead of the frames', seconds.
    run: Option<(f64, f64)>,
}

impl FrameClock {
    /// A frame has reached the map.
    pub(super) fn handle(&mut self, seen: &SeenFrame, now: Instant) {
        // That is some time after it was taken: the least difference is the nearest.
        let ahead_s = now.as_secs_f64() - seen.t_s;
        self.run = Some(self.run.map_or((seen.t_s, ahead_s), |(first_s, least_s)| (first_s, least_s.min(ahead_s))));
    }

    /// The time of a frame; `None` for one of an earlier run, whose clock is gone.
    pub(super) fn taken(&self, t_s: f64) -> Option<Instant> {
        let (first_s, ahead_s) = self.run?;
        (t_s >= first_s).then(|| Instant::from_secs_f64((t_s + ahead_s).max(0.0)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use scene_model::project::Pose;

    #[test]
    fn frames_of_this_run_have_its_clock_and_earlier_ones_none() {
        let mut clock = FrameClock::default();
        let mut frame = |t_s: f64, now_s: f64| {
            let camera = Pose { x: 0.0, y: 0.0, z: 0.0, yaw_rad: 0.0 };
            clock.handle(&SeenFrame { t_s, camera, cells: Vec::new() }, Instant::from_secs_f64(now_s));
            clock
        };
        assert_eq!(FrameClock::default().taken(998.0), None, "the map of a checkpoint");
        frame(1000.0, 8.5);
        let clock = frame(1002.0, 9.0);
        assert_eq!(clock.taken(1001.0), Some(Instant::from_secs_f64(8.0)), "the first one was late");
        assert_eq!(clock.taken(999.0), None);
    }
}
