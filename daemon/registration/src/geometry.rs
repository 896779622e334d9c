//! Whether the camera is as configured: the size of its pixels, its turn on the vehicle, and whether its images are mirrored.
//!
//! The registration searches for overlaps near where odometry expects them, so that a wrong size of pixels only makes it find fewer. Here
//! frames are compared over all shifts, and their displacements by the images with those by odometry.

use crate::camera_image::{FlatField, Thumbnail};
use crate::correlate::{Correlator, Peak};
use crate::plane::Plane;
use crate::registrar::FrameInput;
use nalgebra::Complex;
use scenecast_core::wrap_rad;

/// Pairs of frames that are used, fewest for a result, and pairs that are tried.
const PAIRS: usize = 24;
const MIN_PAIRS: usize = 12;
const MAX_TRIED: usize = 120;
/// Frames that are looked at.
const MAX_FRAMES: u32 = 1500;
/// Of a straight pair the heading changes by less, radians; of one in a turn by so much.
const STRAIGHT_RAD: f64 = 0.1;
const TURN_RAD: std::ops::Range<f64> = 0.15..1.8;
/// Shifts of fewer pixels of the reduced frames are too inexact, and shorter displacements, metres, are noise of odometry.
const MIN_SHIFT_PX: f64 = 12.0;
const MIN_DISPLACEMENT_M: f64 = 0.05;
/// Frames after which a frame is given up to which no later one fits.
const MAX_AGE: u32 = 12;
/// Share of the view by which frames are displaced that surely overlap.
const WITHIN_VIEW: f64 = 0.4;
/// Least confidence of a match, in standard deviations by chance, and least overlap.
const MIN_CONFIDENCE: f32 = 7.0;
const MIN_OVERLAP: f32 = 0.2;
/// The confidence by which turns as of a mirrored camera, or of one that is not, fit better in all.
const MIN_TURNS: f32 = 10.0;
/// Largest median deviation of ratios from their median, as a share of it; least length of the mean direction.
const MAX_SPREAD: f64 = 0.12;
const MIN_AGREEMENT: f64 = 0.85;
/// Deviations that people should know of.
const WRONG_SIZE: f64 = 0.1;
const WRONG_TURN_RAD: f64 = 0.35;

/// What the images show of the camera, in relation to what is configured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraGeometry {
    /// The configured size of a pixel, divided by that by which images and odometry agree.
    pub size_ratio: f64,
    /// The direction of the bow in the images, clockwise from their top, radians, beside what is configured.
    pub turn_rad: f64,
    /// `None` before the vehicle has turned: straight ahead, mirrored images move as others do.
    pub is_mirrored: Option<bool>,
}

impl CameraGeometry {
    fn wrong(&self) -> Wrong {
        let is_half = self.turn_rad.abs() > std::f64::consts::PI - WRONG_TURN_RAD;
        Wrong {
            size: (self.size_ratio - 1.0).abs() > WRONG_SIZE,
            turn: self.turn_rad.abs() > WRONG_TURN_RAD,
            mirrored: self.is_mirrored == Some(true),
            perhaps_mirrored: is_half && self.is_mirrored.is_none(),
        }
    }

    /// What people should change; `None` if images and odometry agree. `metres_per_pixel` is the configured size.
    #[must_use]
    pub fn advice(&self, metres_per_pixel: f64) -> Option<String> {
        let wrong = self.wrong();
        let mut parts = Vec::new();
        if wrong.size {
            let measured = metres_per_pixel / self.size_ratio;
            parts.push(format!(
                "a pixel measures {measured:.5} m on the sea floor and not {metres_per_pixel} m: set camera.metres_per_pixel = {measured:.5}"
            ));
        }
        if wrong.turn {
            let degrees = self.turn_rad.to_degrees();
            let or_mirrored = match wrong.perhaps_mirrored {
                true => " (or they are mirrored from top to bottom, which shows only when the vehicle turns)",
                false => "",
            };
            parts.push(format!(
                "the bow is {degrees:.0} degrees clockwise from the top of the images{or_mirrored}: turn the images, or, of a live camera, \
                 change the first number of camera.mount_deg by {:.0}",
                -degrees
            ));
        }
        if wrong.mirrored {
            parts.push("the images are mirrored: mirror them in the camera or its driver".to_owned());
        }
        (!parts.is_empty())
            .then(|| format!("by its images and odometry the camera is not as configured: {}", parts.join("; ")))
    }
}

/// What is not as configured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Wrong {
    size: bool,
    turn: bool,
    mirrored: bool,
    /// Half a turn may also be images that are mirrored from top to bottom.
    perhaps_mirrored: bool,
}

/// A frame with which later ones are compared.
#[derive(Debug, Clone)]
struct Earlier {
    plane: Plane,
    at: Complex<f64>,
    heading_rad: f64,
    age: u32,
}

/// Collects evidence from the first frames of a mission, at most [`PAIRS`] pairs of them.
#[derive(Debug, Clone, Default)]
pub struct GeometryCheck {
    flat: FlatField,
    earlier: Option<Earlier>,
    /// Displacements by the images and by odometry: to the right, and ahead as the imaginary part, metres.
    pairs: Vec<[Complex<f64>; 2]>,
    /// The confidence of turns as of a camera that is not mirrored, less that as of a mirrored one.
    turns: f32,
    tried: usize,
    frames: u32,
    told: Option<Wrong>,
}

impl GeometryCheck {
    /// Whether it needs no more frames.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        let has_all = self.pairs.len() >= PAIRS && self.is_mirrored().is_some();
        has_all || self.tried >= MAX_TRIED || self.frames >= MAX_FRAMES
    }

    fn is_mirrored(&self) -> Option<bool> {
        (self.turns.abs() > MIN_TURNS).then_some(self.turns < 0.0)
    }

    /// What people should change at the camera, once its frames have shown it, and again when a turn has shown more.
    /// `metres_per_pixel` is the configured size.
    pub fn poll_advice(&mut self, metres_per_pixel: f64) -> Option<String> {
        if self.pairs.len() < PAIRS && !self.is_complete() {
            return None;
        }
        let found = self.geometry()?;
        let advice = found.advice(metres_per_pixel)?;
        let is_new = self.told.replace(found.wrong()) != Some(found.wrong());
        is_new.then_some(advice)
    }

    /// Takes the next frame of the track.
    pub fn handle_frame(&mut self, input: &FrameInput<'_>) {
        if self.is_complete() {
            return;
        }
        self.frames += 1;
        let thumbnail = Thumbnail::new(&input.image, input.metres_per_pixel, &mut self.flat);
        let Some(scales) = thumbnail.and_then(|thumbnail| thumbnail.unpacked()) else {
            self.earlier = None;
            return;
        };
        let (east, north) = input.dead_reckoned.xy();
        let now =
            Earlier { plane: scales.coarse, at: Complex::new(east, north), heading_rad: input.compass_rad, age: 0 };
        let Some(mut earlier) = self.earlier.take() else {
            self.earlier = Some(now);
            return;
        };
        earlier.age += 1;
        let is_kept = self.compare(&earlier, &now, 2.0 * scales.pitch_m) && earlier.age < MAX_AGE;
        self.earlier = Some(if is_kept { earlier } else { now });
    }

    /// Compares two frames; returns whether the earlier one is to be compared with later ones too.
    fn compare(&mut self, earlier: &Earlier, now: &Earlier, pitch_m: f64) -> bool {
        let turned = wrap_rad(now.heading_rad - earlier.heading_rad);
        let moved = now.at - earlier.at;
        if TURN_RAD.contains(&turned.abs()) {
            self.tried += 2;
            let confidence = |turn: f64| matched(earlier, now, turn).map_or(0.0, |peak| peak.confidence);
            self.turns += confidence(turned) - confidence(-turned);
            return false;
        }
        if turned.abs() > STRAIGHT_RAD {
            return turned.abs() < TURN_RAD.start;
        }
        if moved.norm() < MIN_DISPLACEMENT_M {
            return true;
        }
        if self.pairs.len() >= PAIRS {
            // Only a turn is of use now, of a frame that still overlaps with this one.
            return moved.norm() < WITHIN_VIEW * pitch_m * now.plane.columns().min(now.plane.rows()) as f64;
        }
        self.tried += 1;
        let Some(peak) = matched(earlier, now, 0.0) else { return false };
        let [right, down] = [0, 1].map(|axis| f64::from(peak.shift_px[axis]) + f64::from(peak.offset_px[axis]));
        if right.hypot(down) < MIN_SHIFT_PX {
            return true;
        }
        // From east and north to the axes of the vehicle halfway.
        let heading = earlier.heading_rad + turned / 2.0;
        let by_odometry = moved * Complex::from_polar(1.0, heading);
        self.pairs.push([Complex::new(right, -down) * pitch_m, by_odometry]);
        false
    }

    /// What the images show so far; `None` until enough of them agree.
    #[must_use]
    pub fn geometry(&self) -> Option<CameraGeometry> {
        if self.pairs.len() < MIN_PAIRS {
            return None;
        }
        let is_mirrored = self.is_mirrored();
        let ratio = |[by_images, by_odometry]: &[Complex<f64>; 2]| {
            let by_images =
                if is_mirrored == Some(true) { Complex::new(-by_images.re, by_images.im) } else { *by_images };
            by_images / by_odometry
        };
        let ratios: Vec<Complex<f64>> = self.pairs.iter().map(ratio).collect();
        let size_ratio = median(ratios.iter().map(|ratio| ratio.norm()));
        let spread = median(ratios.iter().map(|ratio| (ratio.norm() - size_ratio).abs()));
        let direction = ratios.iter().map(|ratio| ratio / ratio.norm()).sum::<Complex<f64>>() / ratios.len() as f64;
        let agree = spread <= MAX_SPREAD * size_ratio && direction.norm() >= MIN_AGREEMENT;
        // The bow at an angle to the left of the top is a negative turn.
        agree.then_some(CameraGeometry { size_ratio, turn_rad: -direction.arg(), is_mirrored })
    }
}

/// The match of a frame with an earlier one, after a turn clockwise by `turn` radians since.
fn matched(earlier: &Earlier, now: &Earlier, turn: f64) -> Option<Peak> {
    let (columns, rows) = (now.plane.columns(), now.plane.rows());
    if (columns, rows) != (earlier.plane.columns(), earlier.plane.rows()) {
        return None;
    }
    let margin = columns.max(rows) * 3 / 4;
    let mut correlator = Correlator::new(&now.plane, margin);
    let (sin, cos) = turn.sin_cos();
    let middle = ((columns - 1) as f64 / 2.0, (rows - 1) as f64 / 2.0);
    let canvas = correlator.canvas(|x, y| {
        let (u, v) = (f64::from(x) - middle.0, f64::from(y) - middle.1);
        earlier.plane.at((middle.0 + u * cos - v * sin) as f32, (middle.1 + u * sin + v * cos) as f32)
    });
    correlator.peak(canvas, margin as f32, MIN_OVERLAP).filter(|peak| peak.confidence >= MIN_CONFIDENCE)
}

/// The middle one of some numbers, of which there is at least one.
fn median(numbers: impl Iterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = numbers.collect();
    sorted.sort_unstable_by(f64::total_cmp);
    sorted[sorted.len() / 2]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera_image::CameraImage;
    use scenecast_protocol::coordinates::MapPoint;

    /// Size of a pixel in truth, metres.
    const PIXEL_M: f64 = 0.01;
    const SIZE: [usize; 2] = [320, 240];

    /// Brightness of a floor of blotches of 7 and 20 cm.
    fn floor(x_m: f64, y_m: f64) -> f64 {
        let lattice = |cell_m: f64, key: u32| {
            let (x, y) = (x_m / cell_m, y_m / cell_m);
            let node = |i: f64, j: f64| {
                let mut bits =
                    (i as i32 as u32).wrapping_mul(0x9E37_79B1) ^ (j as i32 as u32).wrapping_mul(0x85EB_CA77) ^ key;
                bits = (bits ^ (bits >> 15)).wrapping_mul(0x2C1B_3C6D);
                f64::from((bits ^ (bits >> 12)) & 255)
            };
            let (i, j) = (x.floor(), y.floor());
            let (fx, fy) = (x - i, y - j);
            let row = |j: f64| node(i, j) + fx * (node(i + 1.0, j) - node(i, j));
            row(j) + fy * (row(j + 1.0) - row(j))
        };
        0.6 * lattice(0.07, 1) + 0.4 * lattice(0.2, 2)
    }

    /// The camera as it is: the bow is `turn` clockwise from the top of its images.
    #[derive(Clone, Copy)]
    struct Camera {
        turn_rad: f64,
        is_mirrored: bool,
    }

    impl Camera {
        fn image(self, at: [f64; 2], heading_rad: f64) -> Vec<u8> {
            let (sin, cos) = (heading_rad - self.turn_rad).sin_cos();
            let pixel = |i: usize| {
                let right = ((i % SIZE[0]) as f64 + 0.5 - SIZE[0] as f64 / 2.0) * PIXEL_M;
                let right = if self.is_mirrored { -right } else { right };
                let ahead = (SIZE[1] as f64 / 2.0 - (i / SIZE[0]) as f64 - 0.5) * PIXEL_M;
                floor(at[0] + right * cos + ahead * sin, at[1] - right * sin + ahead * cos) as u8
            };
            (0..SIZE[0] * SIZE[1]).map(pixel).collect()
        }
    }

    /// What is found on two legs with a turn between them, where a pixel is believed to measure `believed_m`.
    fn found(camera: Camera, believed_m: f64) -> Option<CameraGeometry> {
        let mut check = GeometryCheck::default();
        fly(camera, believed_m, 30, &mut |input, _| check.handle_frame(&input));
        check.geometry()
    }

    /// The frames of two legs with a turn from frame `turn` on between them, each with its number.
    fn fly(camera: Camera, believed_m: f64, turn: usize, handle: &mut dyn FnMut(FrameInput<'_>, usize)) {
        let (mut at, mut heading_rad) = ([3.0, 4.0], 0.3f64);
        for step in 0..turn + 40 {
            if (turn..turn + 6).contains(&step) {
                heading_rad += 0.5;
            }
            at = [at[0] + 0.3 * heading_rad.sin(), at[1] + 0.3 * heading_rad.cos()];
            let image = camera.image(at, heading_rad);
            let image = CameraImage::grey(SIZE[0], SIZE[1], &image).unwrap();
            let dead_reckoned = MapPoint::new(at[0], at[1]);
            let input = FrameInput { image, metres_per_pixel: believed_m, dead_reckoned, compass_rad: heading_rad };
            handle(input, step);
        }
    }

    #[test]
    fn advice_comes_before_a_turn_and_again_when_it_shows_more() {
        let (mut check, mut told) = (GeometryCheck::default(), Vec::new());
        fly(Camera { turn_rad: 0.0, is_mirrored: true }, 3.0 * PIXEL_M, 80, &mut |input, step| {
            check.handle_frame(&input);
            told.extend(check.poll_advice(3.0 * PIXEL_M).map(|advice| (step, advice)));
        });
        let [(before, size), (after, mirrored)] = &told[..] else { panic!("{told:?}") };
        assert!(*before < 80 && size.contains("set camera.metres_per_pixel = 0.0") && *after >= 80, "{told:?}");
        assert!(mirrored.contains("mirrored") && mirrored.contains("set camera.metres_per_pixel"), "{told:?}");
    }

    #[test]
    fn a_camera_as_configured_needs_no_advice() {
        let geometry = found(Camera { turn_rad: 0.0, is_mirrored: false }, PIXEL_M).unwrap();
        assert!((geometry.size_ratio - 1.0).abs() < 0.05 && geometry.turn_rad.abs() < 0.05, "{geometry:?}");
        assert_eq!(geometry.advice(PIXEL_M), None);
    }

    #[test]
    fn a_wrong_size_of_pixels_is_found_with_the_right_one() {
        for wrong in [3.0, 1.2, 1.0 / 3.0] {
            let geometry = found(Camera { turn_rad: 0.0, is_mirrored: false }, wrong * PIXEL_M).unwrap();
            assert!((geometry.size_ratio / wrong - 1.0).abs() < 0.05, "{wrong}: {geometry:?}");
            let advice = geometry.advice(wrong * PIXEL_M).unwrap();
            assert!(advice.contains("set camera.metres_per_pixel = 0.0"), "{advice}");
        }
    }

    #[test]
    fn a_turned_or_mirrored_camera_is_found() {
        for (degrees, is_mirrored) in [(90.0f64, false), (180.0, false), (-90.0, false), (0.0, true), (90.0, true)] {
            let geometry = found(Camera { turn_rad: degrees.to_radians(), is_mirrored }, PIXEL_M).unwrap();
            let off = wrap_rad(geometry.turn_rad - degrees.to_radians()).abs();
            assert!(geometry.is_mirrored == Some(is_mirrored) && off < 0.1, "{degrees} {is_mirrored}: {geometry:?}");
            let advice = geometry.advice(PIXEL_M).unwrap();
            assert_eq!(
                (advice.contains("clockwise"), advice.contains("mirrored")),
                (degrees != 0.0, is_mirrored),
                "{advice}"
            );
        }
    }

    #[test]
    fn a_floor_without_texture_gives_no_advice() {
        let mut check = GeometryCheck::default();
        let even = vec![90u8; SIZE[0] * SIZE[1]];
        for step in 0..60 {
            let image = CameraImage::grey(SIZE[0], SIZE[1], &even).unwrap();
            let dead_reckoned = MapPoint::new(0.3 * f64::from(step), 0.0);
            check.handle_frame(&FrameInput { image, metres_per_pixel: PIXEL_M, dead_reckoned, compass_rad: 0.0 });
        }
        assert_eq!(check.geometry(), None);
    }
}
