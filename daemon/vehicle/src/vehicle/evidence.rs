//! From which camera frame each cell has its label, and what the scene model knew of it then.

use super::frame_clock::FrameClock;
use crate::{SeenCell, SeenFrame};
use scene_model::project::Pose;
use scenecast_protocol::map::Cell;
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
