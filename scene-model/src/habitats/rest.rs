//! When a map rests, so that it can be corrected.

use serde::{Deserialize, Serialize};

/// A map rests when so many frames in a row have shown fewer new cells than their number.
pub(crate) const REST_FRAMES: u32 = 60;
/// It is corrected if it has grown by more than this share since the last correction.
const GROWN: f64 = 0.05;

/// The growth of a map: cells at the last correction, cells where the count of frames began, and these frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Rest {
    corrected: usize,
    began: usize,
    frames: u32,
}

impl Rest {
    /// Counts a frame after which the map has so many cells, and tells whether the map is to be corrected now.
    pub(crate) fn is_due(&mut self, cells: usize) -> bool {
        self.frames += 1;
        if self.frames < REST_FRAMES {
            return false;
        }
        let is_resting = cells - self.began < REST_FRAMES as usize;
        (self.began, self.frames) = (cells, 0);
        let is_due = is_resting && (cells - self.corrected) as f64 > GROWN * cells as f64;
        if is_due {
            self.corrected = cells;
        }
        is_due
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_is_corrected_once_after_it_has_grown() {
        let mut rest = Rest::default();
        let mut corrections = |cells: &dyn Fn(usize) -> usize| (0..300).filter(|&i| rest.is_due(cells(i))).count();
        assert_eq!(corrections(&|frame| 10 * frame), 0);
        assert_eq!(corrections(&|_| 3000), 1);
        assert_eq!(corrections(&|frame| 3000 + frame / 3), 0);
        assert_eq!(corrections(&|_| 3200), 1);
    }
}
