//! Words of an RGB-D sequence in the layout of the TUM benchmark (Sturm et al. 2012; the paper's Algorithm 1).

use super::{Sighting, WordSource};
use image::RgbImage;
use scene_model::project::PinholeCamera;
use scene_model::words::WordExtractor;
use scenecast_core::{Takes, UserError};
use scenecast_files::{TumFolder, TumFrame, read_depth, read_image, tum_camera};
use std::path::Path;

/// Minimum and maximum edge of a cell in which words are extracted, pixels.
const CELL_PX: (f32, f32) = (4.0, 200.0);

/// fx, fy, cx, cy in pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Intrinsics(pub(crate) [f64; 4]);

impl std::str::FromStr for Intrinsics {
    type Err = Takes;

    fn from_str(text: &str) -> Result<Self, Takes> {
        let numbers: Vec<f64> = text.split(',').filter_map(|field| field.trim().parse().ok()).collect();
        let four: Option<[f64; 4]> = numbers.try_into().ok().filter(|_| text.split(',').count() == 4);
        let four = four.filter(|all| all.iter().all(|n: &f64| n.is_finite()) && all[0] > 0.0 && all[1] > 0.0);
        four.map(Self).ok_or(Takes("it takes FX,FY,CX,CY in pixels, the focal lengths above 0"))
    }
}

/// The frames of a sequence that have depth and pose; others are counted and skipped.
pub(crate) struct Tum {
    frames: std::vec::IntoIter<TumFrame>,
    all: usize,
    first_s: f64,
    extractor: WordExtractor,
    intrinsics: Option<Intrinsics>,
    depth_scale: f64,
    cell_m: f64,
    /// About poses that are left out, and images without depth or pose.
    folder_notes: Vec<String>,
    unreadable: Vec<UserError>,
    words_without_depth: u64,
}

impl Tum {
    /// Opens a folder; without intrinsics the camera is the benchmark's own, scaled to the width of the images.
    pub(crate) fn open(
        dir: &Path,
        extractor: WordExtractor,
        intrinsics: Option<Intrinsics>,
        depth_scale: f64,
        cell_m: f64,
    ) -> Result<Self, UserError> {
        let folder = TumFolder::open(dir)?;
        let folder_notes = folder.notes().collect();
        let frames = folder.frames;
        Ok(Self {
            all: folder.images,
            first_s: frames[0].t_s,
            frames: frames.into_iter(),
            extractor,
            intrinsics,
            depth_scale,
            cell_m,
            folder_notes,
            unreadable: Vec::new(),
            words_without_depth: 0,
        })
    }

    fn see(&mut self, frame: &TumFrame) -> Result<Vec<scene_model::project::Observation>, UserError> {
        let image = read_image(&frame.image)?.to_rgb8();
        let depth = read_depth(&frame.depth, self.depth_scale)?;
        let camera = self.camera(&image);
        let metres = depth.median_m().ok_or_else(|| UserError::file(&frame.depth, "no depth reading"))?;
        let cell_px = (camera.fx * self.cell_m / metres) as f32;
        let words = self.extractor.extract(&image, cell_px.clamp(CELL_PX.0, CELL_PX.1));
        let projected = camera.project(image.dimensions(), &depth, &frame.pose, &words);
        self.words_without_depth += projected.without_depth;
        Ok(projected.observations)
    }

    fn camera(&self, image: &RgbImage) -> PinholeCamera {
        let Intrinsics([fx, fy, cx, cy]) = self.intrinsics.unwrap_or(Intrinsics(tum_camera(image.width())));
        PinholeCamera { fx, fy, cx, cy }
    }
}

impl WordSource for Tum {
    fn next(&mut self) -> Result<Option<Sighting>, UserError> {
        while let Some(frame) = self.frames.next() {
            match self.see(&frame) {
                Ok(observations) => {
                    let done = 1.0 - self.frames.len() as f64 / self.all.max(1) as f64;
                    return Ok(Some(Sighting {
                        t_s: frame.t_s - self.first_s,
                        observations,
                        image: Default::default(),
                        done,
                    }));
                }
                Err(error) => self.unreadable.push(error),
            }
        }
        Ok(None)
    }

    fn notes(&self) -> Option<String> {
        let mut notes = self.folder_notes.clone();
        if let Some(first) = self.unreadable.first() {
            notes.push(format!("{} frames skipped, the first: {first}", self.unreadable.len()));
        }
        if self.words_without_depth > 0 {
            notes.push(format!("{} words have no depth under them", self.words_without_depth));
        }
        (!notes.is_empty()).then(|| notes.join("; "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intrinsics_are_four_numbers() {
        assert_eq!("525, 520,319.5,239.5".parse(), Ok(Intrinsics([525.0, 520.0, 319.5, 239.5])));
        for wrong in ["", "1,2,3", "0,1,2,3", "1,2,3,nan", "1,2,3,4,x"] {
            assert!(wrong.parse::<Intrinsics>().is_err(), "{wrong}");
        }
    }
}
