//! Words of a mosaic: one image of the ground from above.

use super::{Look, Sighting, WordSource};
use scene_model::habitats::MeasuredPoint;
use scene_model::project::Observation;
use scenecast_core::UserError;
use scenecast_files::read_image;
use std::path::Path;

/// Minimum edge of a cell, in pixels; a smaller one holds no texture.
const MIN_CELL_PX: f64 = 4.0;

/// A mosaic, its top left corner at the origin: x grows to the right, y upwards, so y is below 0.
pub(crate) struct Mosaic {
    seen: Option<(Vec<Observation>, Vec<MeasuredPoint>)>,
    pub(crate) size: (u32, u32),
    /// Edge of a cell, pixels.
    pub(crate) cell_px: f32,
}

impl Mosaic {
    /// Looks at a mosaic whose pixels are `metres_per_pixel` wide.
    pub(crate) fn open(path: &Path, look: &mut Look, metres_per_pixel: f64, cell_m: f64) -> Result<Self, UserError> {
        let cell_px = cell_m / metres_per_pixel;
        let image = read_image(path)?.to_rgb8();
        let (width, height) = image.dimensions();
        if cell_px < MIN_CELL_PX {
            let cause =
                format!("--cell-size {cell_m}: {cell_px:.3} pixels of the mosaic; at least {MIN_CELL_PX} are needed");
            return Err(UserError::Input(cause));
        }
        if f64::from(width.min(height)) < cell_px {
            let cause =
                format!("the image has {width} x {height} pixels; a mosaic needs at least a cell of {cell_px:.1}");
            return Err(UserError::file(path, cause));
        }
        let place = |word: &scene_model::words::Word| Observation {
            word: word.id,
            x: f64::from(word.u) * metres_per_pixel,
            // A word on the upper edge belongs to the first row of cells.
            y: -f64::from(word.v).max(1e-3) * metres_per_pixel,
            z: 0.0,
        };
        let content = look.at(&image, cell_px as f32);
        let seen = Some((content.as_words().iter().map(place).collect(), content.into_points()));
        Ok(Self { seen, size: (width, height), cell_px: cell_px as f32 })
    }
}

impl WordSource for Mosaic {
    fn next(&mut self) -> Result<Option<Sighting>, UserError> {
        let (size, seen) = (self.size, self.seen.take());
        Ok(seen.map(|(observations, points)| Sighting { t_s: 0.0, observations, image: (size, points), done: 1.0 }))
    }
}
