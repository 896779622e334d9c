//! Whether the camera is as configured: the size of its pixels, its turn on the vehicle, and whether its images or the poses are mirrored.
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
/// Further pairs of a camera that seems wrong, of headings apart from the first one's: their least sine of the angle between.
const FURTHER_PAIRS: usize = 24;
const APART: f64 = 0.5;
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
    /// `None` before the vehicle has turned: straight ahead, mirrored images move as others do. Mirrored places with headings to match
    /// look the same.
    pub is_mirrored: Option<bool>,
    /// Whether places and headings turn in opposite directions; then `turn_rad` is 0.
    pub is_torn: bool,
    /// Pairs of frames that were compared, and frames that were looked at.
    pub pairs: usize,
    pub frames: u32,
}

/// What the images show of the camera, for people.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum CameraFinding {
    AsConfigured(String),
    /// One line for people: what differs from the configuration, and what to change.
    Wrong(String),
}

impl CameraGeometry {
    fn wrong(&self) -> Wrong {
        let is_half = self.turn_rad.abs() > std::f64::consts::PI - WRONG_TURN_RAD;
        Wrong {
            size: (self.size_ratio - 1.0).abs() > WRONG_SIZE,
            turn: self.turn_rad.abs() > WRONG_TURN_RAD,
            mirrored: self.is_mirrored == Some(true),
            torn: self.is_torn,
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
        match (wrong.torn, self.is_mirrored) {
            (false, Some(true)) => parts.push(
                "the images are mirrored: mirror them in the camera or its driver; or the poses are, which looks the same: east and north \
                 exchanged, or headings that grow to the left"
                    .to_owned(),
            ),
            (false, _) => {}
            (true, is_reversed) => parts.push(torn(is_reversed)),
        }
        let what = if wrong.torn { "the poses are wrong" } else { "the camera is not as configured" };
        (!parts.is_empty()).then(|| format!("by its images and odometry {what}: {}", parts.join("; ")))
    }

    /// What was measured, for people whose camera needs no change.
    #[must_use]
    pub fn confirmation(&self, metres_per_pixel: f64) -> String {
        let Self { size_ratio, turn_rad, is_mirrored, pairs, frames, .. } = self;
        let mirrored = match is_mirrored {
            Some(_) => "they are not mirrored",
            None => "whether they are mirrored shows only when the vehicle turns",
        };
        format!(
            "by {pairs} pairs of its first {frames} frames and odometry the camera is as configured: a pixel measures {:.5} m on the sea \
             floor (configured: {metres_per_pixel} m), the bow is {:.0} degrees clockwise from the top of the images, and {mirrored}",
            metres_per_pixel / size_ratio,
            turn_rad.to_degrees()
        )
    }

    /// What people should know of it. `metres_per_pixel` is the configured size.
    #[must_use]
    pub fn finding(&self, metres_per_pixel: f64) -> CameraFinding {
        let advice = self.advice(metres_per_pixel);
        advice.map_or_else(|| CameraFinding::AsConfigured(self.confirmation(metres_per_pixel)), CameraFinding::Wrong)
    }
}

/// How places and headings that turn in opposite directions can be mended. The images turn against the headings where these are reversed.
fn torn(is_reversed: Option<bool>) -> String {
    let headings = "the headings of the poses grow to the left: they are to grow clockwise from north";
    let places =
        "the places of the poses are mirrored: east and north are exchanged, or one of them has the wrong sign";
    match is_reversed {
        Some(true) => headings.to_owned(),
        Some(false) => places.to_owned(),
        None => format!("{headings}; or {places}"),
    }
}

/// What is not as configured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Wrong {
    size: bool,
    turn: bool,
    mirrored: bool,
    torn: bool,
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

/// How a vehicle has moved between two frames.
#[derive(Debug, Clone, Copy)]
struct Pair {
    /// By the images: to the right, and ahead as the imaginary part, metres.
    by_images: Complex<f64>,
    /// By odometry: east, and north as the imaginary part, metres.
    by_odometry: Complex<f64>,
    /// The heading halfway between the two frames, clockwise from north, radians.
    heading_rad: f64,
}

impl Pair {
    /// The displacement by the images in relation to that by odometry, with the headings as they are or reversed.
    fn ratio(&self, is_mirrored: bool, is_reversed: bool) -> Complex<f64> {
        let Self { by_images, by_odometry, heading_rad } = *self;
        let by_images = if is_mirrored { Complex::new(-by_images.re, by_images.im) } else { by_images };
        by_images / (by_odometry * Complex::from_polar(1.0, if is_reversed { -heading_rad } else { heading_rad }))
    }
}

/// Collects evidence from the first frames of a mission, at most [`PAIRS`] and [`FURTHER_PAIRS`] pairs of them.
#[derive(Debug, Clone, Default)]
pub struct GeometryCheck {
    flat: FlatField,
    earlier: Option<Earlier>,
    pairs: Vec<Pair>,
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
        let wanted = if self.seems_wrong() { PAIRS + FURTHER_PAIRS } else { PAIRS };
        let has_all = self.pairs.len() >= wanted && self.is_mirrored().is_some();
        has_all || self.tried >= MAX_TRIED || self.frames >= MAX_FRAMES
    }

    fn is_mirrored(&self) -> Option<bool> {
        (self.turns.abs() > MIN_TURNS).then_some(self.turns < 0.0)
    }

    /// Whether pairs of other headings may show that the poses are wrong, and not the camera.
    fn seems_wrong(&self) -> bool {
        self.geometry().is_none_or(|found| found.wrong().turn || found.is_torn || found.is_mirrored == Some(true))
    }

    /// Whether a pair at a heading is of use.
    fn wants(&self, heading_rad: f64) -> bool {
        let is_apart = || self.pairs.first().is_some_and(|first| (heading_rad - first.heading_rad).sin().abs() > APART);
        match self.pairs.len() {
            ..PAIRS => true,
            count => count < PAIRS + FURTHER_PAIRS && is_apart() && self.seems_wrong(),
        }
    }

    /// What people should know of the camera, once its frames have shown it, and again when a turn has shown more. `metres_per_pixel`
    /// is the configured size.
    pub fn poll_finding(&mut self, metres_per_pixel: f64) -> Option<CameraFinding> {
        if self.pairs.len() < PAIRS && !self.is_complete() {
            return None;
        }
        let found = self.geometry()?;
        let is_new = self.told.replace(found.wrong()) != Some(found.wrong());
        is_new.then(|| found.finding(metres_per_pixel))
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
        let heading_rad = earlier.heading_rad + turned / 2.0;
        if !self.wants(heading_rad) {
            // Only a turn is of use now, of a frame that still overlaps with this one.
            return moved.norm() < WITHIN_VIEW * pitch_m * now.plane.columns().min(now.plane.rows()) as f64;
        }
        self.tried += 1;
        let Some(peak) = matched(earlier, now, 0.0) else { return false };
        let [right, down] = [0, 1].map(|axis| f64::from(peak.shift_px[axis]) + f64::from(peak.offset_px[axis]));
        if right.hypot(down) < MIN_SHIFT_PX {
            return true;
        }
        self.pairs.push(Pair { by_images: Complex::new(right, -down) * pitch_m, by_odometry: moved, heading_rad });
        false
    }

    /// What the images show so far; `None` until enough of them agree.
    #[must_use]
    pub fn geometry(&self) -> Option<CameraGeometry> {
        if self.pairs.len() < MIN_PAIRS {
            return None;
        }
        let is_mirrored = self.is_mirrored();
        let as_said = self.agreed(is_mirrored == Some(true), false);
        // Headings that are reversed let the images turn as mirrored ones do, and mirrored places do not.
        let reversed = || match is_mirrored {
            Some(is_mirrored) => self.agreed(!is_mirrored, true),
            None => self.agreed(false, true).or_else(|| self.agreed(true, true)),
        };
        let is_torn = as_said.is_none();
        let (size_ratio, direction) = as_said.or_else(reversed)?;
        // The bow at an angle to the left of the top is a negative turn.
        let turn_rad = if is_torn { 0.0 } else { -direction.arg() };
        Some(CameraGeometry {
            size_ratio,
            turn_rad,
            is_mirrored,
            is_torn,
            pairs: self.pairs.len(),
            frames: self.frames,
        })
    }

    /// The median size and the mean direction of the ratios of all pairs, if they agree.
    fn agreed(&self, is_mirrored: bool, is_reversed: bool) -> Option<(f64, Complex<f64>)> {
        let ratios: Vec<Complex<f64>> = self.pairs.iter().map(|pair| pair.ratio(is_mirrored, is_reversed)).collect();
        let size = median(ratios.iter().map(|ratio| ratio.norm()));
        let spread = median(ratios.iter().map(|ratio| (ratio.norm() - size).abs()));
        let direction = ratios.iter().map(|ratio| ratio / ratio.norm()).sum::<Complex<f64>>() / ratios.len() as f64;
        (spread <= MAX_SPREAD * size && direction.norm() >= MIN_AGREEMENT).then_some((size, direction))
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
    use std::f64::consts::FRAC_PI_2;

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
                heading_rad += 0.35;
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
            told.extend(check.poll_finding(3.0 * PIXEL_M).map(|finding| (step, format!("{finding:?}"))));
        });
        let [(before, size), (after, mirrored)] = &told[..] else { panic!("{told:?}") };
        assert!(*before < 80 && size.contains("set camera.metres_per_pixel = 0.0") && *after >= 80, "{told:?}");
        assert!(mirrored.contains("mirrored") && mirrored.contains("set camera.metres_per_pixel"), "{told:?}");
    }

    #[test]
    fn a_camera_as_configured_needs_no_advice() {
        let geometry = found(Camera { turn_rad: 0.0, is_mirrored: false }, PIXEL_M).unwrap();
        assert!((geometry.size_ratio - 1.0).abs() < 0.05 && geometry.turn_rad.abs() < 0.05, "{geometry:?}");
        let CameraFinding::AsConfigured(text) = geometry.finding(PIXEL_M) else { panic!("{geometry:?}") };
        assert!(text.contains("a pixel measures 0.0") && text.contains("they are not mirrored"), "{text}");
        assert!(text.starts_with("by 24 pairs of its first "), "{text}");
    }

    #[test]
    fn a_camera_as_configured_is_told_of_once() {
        let (mut check, mut told) = (GeometryCheck::default(), Vec::new());
        fly(Camera { turn_rad: 0.0, is_mirrored: false }, PIXEL_M, 80, &mut |input, _| {
            check.handle_frame(&input);
            told.extend(check.poll_finding(PIXEL_M));
        });
        assert!(matches!(&told[..], [CameraFinding::AsConfigured(_)]), "{told:?}");
    }

    /// A place and a heading.
    type Posed = ([f64; 2], f64);

    #[test]
    fn mirrored_poses_are_told_from_a_mirrored_camera() {
        let advice = |wrong: fn(Posed) -> Posed| {
            let mut check = GeometryCheck::default();
            fly(Camera { turn_rad: 0.0, is_mirrored: false }, PIXEL_M, 30, &mut |input, _| {
                let (x, y) = input.dead_reckoned.xy();
                let ([x, y], compass_rad) = wrong(([x, y], input.compass_rad));
                check.handle_frame(&FrameInput { dead_reckoned: MapPoint::new(x, y), compass_rad, ..input });
            });
            check.geometry().unwrap().advice(PIXEL_M).unwrap()
        };
        for (wrong, expected) in [
            (
                (|(at, heading)| (at, -heading)) as fn(Posed) -> Posed,
                "the poses are wrong: the headings of the poses grow",
            ),
            (|([x, y], heading)| ([y, x], heading), "the poses are wrong: the places of the poses are mirrored"),
            (|([x, y], heading)| ([y, x], FRAC_PI_2 - heading), "or the poses are, which looks the same"),
            (|([x, y], heading)| ([-x, y], -heading), "or the poses are, which looks the same"),
        ] {
            let advice = advice(wrong);
            assert!(advice.contains(expected) && !advice.contains("metres_per_pixel"), "{expected}: {advice}");
        }
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
