//! The mean brightness at each place of the frame: lamp, lens and dirt, which do not move with the sea floor.

use crate::plane::Plane;
use serde::{Deserialize, Serialize};

/// Frames that the running mean remembers. Without it, dirt on the lens is matched where the floor has no texture.
const FRAMES: u16 = 40;
/// Frames after which half of the mean is removed: before, it is the sea floor's own.
const HALF_FRAMES: f32 = 6.0;

/// A running mean of the logarithm of the brightness.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct FlatField {
    frames: u16,
    columns: u16,
    mean: Vec<f32>,
}

impl FlatField {
    /// Learns from a frame and returns it as an even light would show it. A frame of another size starts again.
    pub(crate) fn level(&mut self, logs: &Plane) -> Plane {
        if usize::from(self.columns) != logs.columns() || self.mean.len() != logs.values().len() {
            *self = Self { frames: 0, columns: logs.columns() as u16, mean: vec![0.0; logs.values().len()] };
        }
        self.frames = (self.frames + 1).min(FRAMES);
        let step = 1.0 / f32::from(self.frames);
        let share = f32::from(self.frames) / (f32::from(self.frames) + HALF_FRAMES);
        let mut level = logs.clone();
        for (value, mean) in level.values_mut().iter_mut().zip(&mut self.mean) {
            *mean += step * (*value - *mean);
            *value -= share * *mean;
        }
        level
    }

    /// Whether the numbers can be those of frames.
    pub(crate) fn is_sound(&self) -> bool {
        self.frames <= FRAMES && self.mean.len() <= 65_536 && self.mean.iter().all(|mean| mean.abs() < 100.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dirt_on_the_lens_fades_from_the_frames() {
        let mut flat = FlatField::default();
        let dirty = |moment: usize| {
            let value =
                |i: usize| if i.is_multiple_of(7) { -1.0 } else { 0.0 } + ((i * 31 + moment * 17) % 13) as f32 * 0.02;
            Plane::from_values(40, (0..1200).map(value).collect()).unwrap()
        };
        let contrast = |plane: &Plane| (plane.row(3)[1] - plane.row(3)[13]).abs();
        let first = flat.level(&dirty(0));
        let last = (1..100).map(|moment| flat.level(&dirty(moment))).last().unwrap();
        assert!(contrast(&first) < 1.1 && last.rms() < 0.35 * first.rms(), "{} {}", first.rms(), last.rms());
        let other = Plane::new(50, 40);
        assert_eq!(flat.level(&other).values().len(), 2000, "another camera");
        assert!(flat.is_sound());
    }
}
