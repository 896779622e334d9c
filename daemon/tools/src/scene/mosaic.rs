//! Words of images of the ground from above: one mosaic, or the frames of a survey with their poses.

use super::{Look, Sighting, WordSource};
use image::{DynamicImage, GenericImageView, RgbImage};
use scene_model::habitats::MeasuredPoint;
use scene_model::project::{DownCamera, Observation, Pose};
use scenecast_core::UserError;
use scenecast_files::{RecordedFrame, Recording, own_scale_m, read_image, unread_emptiness};
use scenecast_protocol::coordinates::MapPoint;
use scenecast_registration::{CameraImage, FrameInput, GeometryCheck};
use scenecast_sensors::ImageSize;
use std::path::Path;

/// Minimum edge of a cell, in pixels; a smaller one holds no texture.
const MIN_CELL_PX: f64 = 4.0;

/// A mosaic, its top left corner at the origin: x grows to the right, y upwards, so y is below 0.
pub(crate) struct Mosaic {
    seen: Option<(Vec<Observation>, Vec<MeasuredPoint>)>,
    pub(crate) size: (u32, u32),
    /// Edge of a cell, pixels.
    pub(crate) cell_px: f32,
    note: Option<String>,
}

/// Shares of pixels without an image of the ground that people are told of.
const TOLD_SHARE: f64 = 0.02;

/// Whether an image has nothing at a place, in pixels.
fn is_clear(image: &DynamicImage, u: f32, v: f32) -> bool {
    let (x, y) = ((u as u32).min(image.width() - 1), (v as u32).min(image.height() - 1));
    image.get_pixel(x, y).0[3] == 0
}

/// What people should know of the parts of a mosaic that show no ground.
fn note_of_empty(image: &DynamicImage) -> Option<String> {
    let all = f64::from(image.width()) * f64::from(image.height());
    let share =
        |is_empty: fn([u8; 4]) -> bool| image.pixels().filter(|(_, _, pixel)| is_empty(pixel.0)).count() as f64 / all;
    let clear = if image.color().has_alpha() { share(|[.., alpha]| alpha == 0) } else { 0.0 };
    let black = share(|[r, g, b, alpha]| [r, g, b] == [0; 3] && alpha > 0);
    match (clear, black) {
        (clear, _) if clear >= TOLD_SHARE => {
            Some(format!("{:.0} % of the mosaic are transparent and get no label", clear * 100.0))
        }
        (_, black) if black >= TOLD_SHARE => Some(format!(
            "{:.0} % of the mosaic are exactly black and get labels; gdalwarp -srcnodata 0 -dstalpha makes a border without data transparent",
            black * 100.0
        )),
        _ => None,
    }
}

/// What people should know of a mosaic that says another size of its pixels than is given.
fn note_of_scale(own_m: Option<f64>, metres_per_pixel: f64) -> Option<String> {
    let own_m = own_m.filter(|own_m| !(0.9..=1.1).contains(&(own_m / metres_per_pixel)))?;
    Some(format!(
        "a pixel measures {own_m} m by the mosaic itself, and {metres_per_pixel} m by --metres-per-pixel, which is used"
    ))
}

impl Mosaic {
    /// Looks at a mosaic whose pixels are `metres_per_pixel` wide.
    pub(crate) fn open(path: &Path, look: &mut Look, metres_per_pixel: f64, cell_m: f64) -> Result<Self, UserError> {
        let cell_px = cell_m / metres_per_pixel;
        let picture = read_image(path)?;
        let image = picture.to_rgb8();
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
        let mut content = look.at(&image, cell_px as f32);
        if picture.color().has_alpha() {
            content.retain(|u, v| !is_clear(&picture, u, v));
        }
        let seen = Some((content.as_words().iter().map(place).collect(), content.into_points()));
        let unread = unread_emptiness(path)?.filter(|_| !picture.color().has_alpha());
        let unread = unread.map(|what| {
            format!("the mosaic has {what}, which is not read, so that all of it gets labels; gdalwarp -dstalpha OLD.tif NEW.tif makes what has no data transparent")
        });
        let notes = [note_of_scale(own_scale_m(path)?, metres_per_pixel), note_of_empty(&picture), unread];
        let notes: Vec<String> = notes.into_iter().flatten().collect();
        let note = (!notes.is_empty()).then(|| notes.join("; "));
        Ok(Self { seen, size: (width, height), cell_px: cell_px as f32, note })
    }
}

impl WordSource for Mosaic {
    fn next(&mut self) -> Result<Option<Sighting>, UserError> {
        let (size, seen) = (self.size, self.seen.take());
        Ok(seen.map(|(observations, points)| Sighting { t_s: 0.0, observations, image: (size, points), done: 1.0 }))
    }

    fn notes(&self) -> Option<String> {
        self.note.clone()
    }
}

/// The frames of a recording; unreadable ones are counted and skipped.
pub(crate) struct Frames {
    recording: Recording,
    look: Look,
    metres_per_pixel: f64,
    cell_m: f64,
    next: usize,
    unreadable: Vec<String>,
    /// Of frames without a scale of their own.
    size: ImageSize,
    /// Whether the camera is as stated.
    geometry: GeometryCheck,
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
        let (unreadable, size, geometry) = (Vec::new(), ImageSize::default(), GeometryCheck::default());
        Self { recording, look, metres_per_pixel, cell_m, next: 0, unreadable, size, geometry, notes }
    }
}

/// Shows a frame to the check of the camera.
fn check(geometry: &mut GeometryCheck, image: &RgbImage, frame: &RecordedFrame, metres_per_pixel: f64) {
    let pixels = CameraImage::rgb(image.width() as usize, image.height() as usize, image.as_raw());
    if let Some(image) = pixels.filter(|_| !geometry.is_complete()) {
        let dead_reckoned = MapPoint::new(frame.x_m, frame.y_m);
        geometry.handle_frame(&FrameInput { image, metres_per_pixel, dead_reckoned, compass_rad: frame.heading_rad });
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
            if frame.scale == 1.0
                && let Err(error) = self.size.check(image.dimensions())
            {
                self.unreadable.push(format!("{}: {error}", frame.image));
                continue;
            }
            let camera = DownCamera { metres_per_pixel: self.metres_per_pixel * frame.scale, altitude_m: 0.0 };
            let pose = Pose { x: frame.x_m, y: frame.y_m, z: -frame.depth_m, yaw_rad: -frame.heading_rad };
            let cell_px = (self.cell_m / camera.metres_per_pixel) as f32;
            if f64::from(image.width().min(image.height())) < f64::from(cell_px) {
                let (width, height) = image.dimensions();
                let file = &frame.image;
                self.unreadable.push(format!("{file}: {width} x {height} pixels are less than a cell of {cell_px:.1}"));
                continue;
            }
            check(&mut self.geometry, &image, frame, camera.metres_per_pixel);
            let content = self.look.at(&image, cell_px);
            let observations = camera.project(image.width(), image.height(), &pose, &content.as_words());
            let image = (image.dimensions(), content.into_points());
            return Ok(Some(Sighting { t_s: frame.t_s, observations, image, done }));
        }
        Ok(None)
    }

    fn notes(&self) -> Option<String> {
        let (count, all) = (self.unreadable.len(), self.recording.frames.len());
        let unreadable =
            self.unreadable.first().map(|first| format!("{count} of {all} frames skipped, the first: {first}"));
        let advice = self.geometry.geometry().and_then(|found| found.advice(self.metres_per_pixel));
        let notes: Vec<String> = self.notes.iter().cloned().chain(unreadable).chain(advice).collect();
        (!notes.is_empty()).then(|| notes.join("; "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{Rgba, RgbaImage};

    #[test]
    fn transparent_parts_of_a_mosaic_are_not_looked_at() {
        let path = std::env::temp_dir().join(format!("scenecast-{}-mosaic-clear.png", std::process::id()));
        let pixel =
            |x: u32, y: u32| Rgba([(x * 7 % 251) as u8, (y * 5 % 251) as u8, 90, if x < 120 { 0 } else { 255 }]);
        RgbaImage::from_fn(240, 200, pixel).save(&path).unwrap();
        let mosaic = Mosaic::open(&path, &mut Look::Points, 0.01, 0.2).unwrap();
        assert_eq!(mosaic.notes().as_deref(), Some("50 % of the mosaic are transparent and get no label"));
        let (observations, points) = mosaic.seen.unwrap();
        assert!(points.len() == observations.len() && points.len() > 100, "{}", points.len());
        assert!(points.iter().all(|point| point.u >= 120.0) && observations.iter().all(|seen| seen.x >= 1.2));
    }

    #[test]
    fn a_pixel_size_that_differs_from_that_of_a_mosaic_is_named() {
        let named = |own_m| note_of_scale(own_m, 0.002).is_some();
        assert_eq!([named(Some(0.01)), named(Some(0.0021)), named(None)], [true, false, false]);
        let note = note_of_scale(Some(0.01), 0.002).unwrap();
        assert!(note.contains("0.01 m by the mosaic itself, and 0.002 m by --metres-per-pixel"), "{note}");
    }

    #[test]
    fn a_black_border_is_named_with_its_share() {
        let border = RgbImage::from_fn(100, 100, |x, _| image::Rgb(if x < 25 { [0; 3] } else { [9; 3] }));
        let note = note_of_empty(&DynamicImage::ImageRgb8(border)).unwrap();
        assert!(note.starts_with("25 % of the mosaic are exactly black"), "{note}");
        assert_eq!(note_of_empty(&DynamicImage::ImageRgb8(RgbImage::from_pixel(9, 9, image::Rgb([9; 3])))), None);
    }
}
