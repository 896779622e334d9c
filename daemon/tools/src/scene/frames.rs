//! Words of a recorded survey: images from above with their poses.

use super::{Look, Sighting, WordSource};
use scene_model::project::{DownCamera, Pose};
use scenecast_core::UserError;
use scenecast_files::Recording;
use std::path::Path;

/// The frames of a recording; unreadable ones are counted and skipped.
pub(crate) struct Frames {
    recording: Recording,
    look: Look,
    metres_per_pixel: f64,
    cell_m: f64,
    next: usize,
    unreadable: Vec<String>,
    /// What of the recording is not among its frames.
    notes: Vec<String>,
}

impl Frames {
    pub(crate) fn open(
        (dir, poses): (&Path, Option<&Path>),
        look: Look,
        metres_per_pixel: f64,
        cell_m: f64,
    ) -> Result<Self, UserError> {
        Ok(Self::of(Recording::open(dir, poses, metres_per_pixel)?, look, metres_per_pixel, cell_m))
    }

    /// The frames of a recording that is open.
    pub(crate) fn of(recording: Recording, look: Look, metres_per_pixel: f64, cell_m: f64) -> Self {
        let notes = recording.notes.clone();
        Self { recording, look, metres_per_pixel, cell_m, next: 0, unreadable: Vec::new(), notes }
    }
}

impl WordSource for Frames {
    fn next(&mut self) -> Result<Option<Sighting>, UserError> {
        while let Some(frame) = self.recording.frames.get(self.next) {
            self.next += 1;
            let done = self.next as f64 / self.recording.frames.len() as f64;
            let image = match frame.image.read() {
                Ok(image) => image,
                Err(error) => {
                    self.unreadable.push(error.to_string());
                    continue;
                }
            };
            let camera = DownCamera { metres_per_pixel: self.metres_per_pixel * frame.scale, altitude_m: 0.0 };
            let pose = Pose { x: frame.x_m, y: frame.y_m, z: -frame.depth_m, yaw_rad: -frame.heading_rad };
            let cell_px = (self.cell_m / camera.metres_per_pixel) as f32;
            if f64::from(image.width().min(image.height())) < f64::from(cell_px) {
                let (width, height) = image.dimensions();
                let file = &frame.image;
                self.unreadable.push(format!("{file}: {width} x {height} pixels are less than a cell of {cell_px:.1}"));
                continue;
            }
            let content = self.look.at(&image, cell_px);
            let observations = camera.project(image.width(), image.height(), &pose, &content.as_words());
            let image = (image.dimensions(), content.into_points());
            return Ok(Some(Sighting { t_s: frame.t_s, observations, image, done }));
        }
        Ok(None)
    }

    fn skipped(&self) -> Option<String> {
        let (count, all) = (self.unreadable.len(), self.recording.frames.len());
        let unreadable =
            self.unreadable.first().map(|first| format!("{count} of {all} frames skipped, the first: {first}"));
        let notes: Vec<String> = self.notes.iter().cloned().chain(unreadable).collect();
        (!notes.is_empty()).then(|| notes.join("; "))
    }
}
