//! Words of an RGB-D sequence in the layout of the TUM benchmark (Sturm et al. 2012; the paper's Algorithm 1).
//!
//! `rgb.txt` and `depth.txt` are lines `time file`, `groundtruth.txt` lines `time tx ty tz qx qy qz qw`: camera to
//! world. Depth is a 16-bit PNG in units of 1/5000 m, 0 where there is no reading.

use super::lines::{Lines, number};
use super::{Sighting, WordSource};
use image::{DynamicImage, RgbImage};
use scene_model::project::{CameraPose, DepthImage, PinholeCamera};
use scene_model::words::WordExtractor;
use scenecast_core::UserError;
use scenecast_files::read_image;
use std::path::{Path, PathBuf};

/// Maximum time between an image and the depth image or the pose that is matched with it, seconds.
const MAX_APART_S: f64 = 0.02;
/// Image width of the benchmark's intrinsics, pixels.
const DEFAULT_WIDTH_PX: f64 = 640.0;
const DEFAULT_INTRINSICS: Intrinsics = Intrinsics([525.0, 525.0, 319.5, 239.5]);
/// Minimum and maximum edge of a cell in which words are extracted, pixels.
const CELL_PX: (f32, f32) = (4.0, 200.0);

/// fx, fy, cx, cy in pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Intrinsics(pub(crate) [f64; 4]);

impl std::str::FromStr for Intrinsics {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers: Vec<f64> = text.split(',').filter_map(|field| field.trim().parse().ok()).collect();
        let four: Option<[f64; 4]> = numbers.try_into().ok().filter(|_| text.split(',').count() == 4);
        let four = four.filter(|all| all.iter().all(|n: &f64| n.is_finite()) && all[0] > 0.0 && all[1] > 0.0);
        four.map(Self).ok_or_else(|| "it takes FX,FY,CX,CY in pixels, the focal lengths above 0".to_owned())
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
    without_partner: usize,
    unreadable: Vec<String>,
    words_without_depth: u64,
}

struct TumFrame {
    t_s: f64,
    image: PathBuf,
    depth: PathBuf,
    pose: CameraPose,
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
        let images = read_list(&dir.join("rgb.txt"), file)?;
        let depths = read_list(&dir.join("depth.txt"), file)?;
        let poses = read_list(&dir.join("groundtruth.txt"), pose)?;
        let mut frames = Vec::new();
        for (t_s, image) in &images {
            if let (Some(depth), Some(pose)) = (nearest(&depths, *t_s), nearest(&poses, *t_s)) {
                frames.push(TumFrame { t_s: *t_s, image: dir.join(image), depth: dir.join(depth), pose: *pose });
            }
        }
        let without_partner = images.len() - frames.len();
        if frames.is_empty() {
            let cause =
                format!("none of its {} images has a depth image and a pose within {MAX_APART_S} s", images.len());
            return Err(UserError::file(&dir.join("rgb.txt"), cause));
        }
        Ok(Self {
            all: images.len(),
            first_s: frames[0].t_s,
            frames: frames.into_iter(),
            extractor,
            intrinsics,
            depth_scale,
            cell_m,
            without_partner,
            unreadable: Vec::new(),
            words_without_depth: 0,
        })
    }

    fn see(&mut self, frame: &TumFrame) -> Result<Vec<scene_model::project::Observation>, String> {
        let image = read_image(&frame.image).map_err(|e| e.to_string())?.to_rgb8();
        let depth = read_depth(&frame.depth, self.depth_scale)?;
        let camera = self.camera(&image);
        let metres = median(&depth).ok_or_else(|| format!("{}: no depth reading", frame.depth.display()))?;
        let cell_px = (camera.fx * self.cell_m / f64::from(metres)) as f32;
        let words = self.extractor.extract(&image, cell_px.clamp(CELL_PX.0, CELL_PX.1));
        let projected = camera.project(image.dimensions(), &depth, &frame.pose, &words);
        self.words_without_depth += projected.without_depth;
        Ok(projected.observations)
    }

    fn camera(&self, image: &RgbImage) -> PinholeCamera {
        let scale = f64::from(image.width()) / DEFAULT_WIDTH_PX;
        let Intrinsics([fx, fy, cx, cy]) =
            self.intrinsics.unwrap_or(Intrinsics(DEFAULT_INTRINSICS.0.map(|pixels| pixels * scale)));
        PinholeCamera { fx, fy, cx, cy }
    }
}

impl WordSource for Tum {
    fn next(&mut self) -> Result<Option<Sighting>, UserError> {
        while let Some(frame) = self.frames.next() {
            match self.see(&frame) {
                Ok(observations) => {
                    let done = 1.0 - self.frames.len() as f64 / self.all.max(1) as f64;
                    return Ok(Some(Sighting { t_s: frame.t_s - self.first_s, observations, done }));
                }
                Err(error) => self.unreadable.push(error),
            }
        }
        Ok(None)
    }

    fn skipped(&self) -> Option<String> {
        let mut notes = Vec::new();
        if self.without_partner > 0 {
            let (few, all) = (self.without_partner, self.all);
            notes.push(format!("{few} of {all} images have no depth image or no pose within {MAX_APART_S} s"));
        }
        if let Some(first) = self.unreadable.first() {
            notes.push(format!("{} frames skipped, the first: {first}", self.unreadable.len()));
        }
        if self.words_without_depth > 0 {
            notes.push(format!("{} words have no depth under them", self.words_without_depth));
        }
        (!notes.is_empty()).then(|| notes.join("; "))
    }
}

/// Reads lines `time value` and sorts them by time; errors name the line.
fn read_list<T>(path: &Path, read: impl Fn(&str) -> Result<T, String>) -> Result<Vec<(f64, T)>, UserError> {
    let mut lines = Lines::open(path)?;
    let mut list = Vec::new();
    while let Some(line) = lines.next()? {
        let (time, rest) = line.text.split_once([' ', '\t', ',']).unwrap_or((line.text, ""));
        let entry = number(Some(time), "the time").and_then(|t_s| Ok((t_s, read(rest.trim())?)));
        list.push(entry.map_err(|error| lines.error(error))?);
    }
    if list.is_empty() {
        return Err(UserError::file(path, "there are no lines"));
    }
    list.sort_by(|a, b| a.0.total_cmp(&b.0));
    Ok(list)
}

fn file(text: &str) -> Result<PathBuf, String> {
    if text.is_empty() { Err("expected a time and a file".to_owned()) } else { Ok(text.into()) }
}

fn pose(text: &str) -> Result<CameraPose, String> {
    let mut fields = text.split([' ', '\t', ',']).filter(|field| !field.is_empty());
    let mut next = |name| number(fields.next(), name);
    let position = [next("tx")?, next("ty")?, next("tz")?];
    let rotation = [next("qx")?, next("qy")?, next("qz")?, next("qw")?];
    let length: f64 = rotation.iter().map(|q| q * q).sum();
    if !(0.5..2.0).contains(&length) {
        return Err("the quaternion qx qy qz qw has not the length 1".to_owned());
    }
    Ok(CameraPose { position, rotation })
}

fn nearest<T>(list: &[(f64, T)], t_s: f64) -> Option<&T> {
    let after = list.partition_point(|entry| entry.0 < t_s);
    let near = list[after.saturating_sub(1)..(after + 1).min(list.len())].iter();
    let best = near.min_by(|a, b| (a.0 - t_s).abs().total_cmp(&(b.0 - t_s).abs()))?;
    // Times have microseconds; as floating-point numbers they may differ a little more than the limit.
    ((best.0 - t_s).abs() <= MAX_APART_S + 1e-6).then_some(&best.1)
}

fn read_depth(path: &Path, scale: f64) -> Result<DepthImage, String> {
    match read_image(path).map_err(|e| e.to_string())? {
        DynamicImage::ImageLuma16(depth) => {
            let (width, height) = depth.dimensions();
            let metres = depth.into_raw().into_iter().map(|units| (f64::from(units) / scale) as f32).collect();
            Ok(DepthImage { width, height, metres })
        }
        _ => Err(format!("{}: a depth image is a grey PNG of 16 bits", path.display())),
    }
}

/// Median depth over every seventh valid reading, metres.
fn median(depth: &DepthImage) -> Option<f32> {
    let mut readings: Vec<f32> = depth.metres.iter().copied().filter(|&metres| metres > 0.0).step_by(7).collect();
    if readings.is_empty() {
        return depth.metres.iter().copied().find(|&metres| metres > 0.0);
    }
    let middle = readings.len() / 2;
    Some(*readings.select_nth_unstable_by(middle, f32::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_in_time_is_matched_within_the_limit() {
        let list = [(1.0, 'a'), (1.03, 'b'), (2.0, 'c')];
        let found: Vec<Option<&char>> = [0.99, 1.014, 1.016, 1.06, 2.02, 9.0].map(|t| nearest(&list, t)).to_vec();
        assert_eq!(found, [Some(&'a'), Some(&'a'), Some(&'b'), None, Some(&'c'), None]);
    }

    #[test]
    fn intrinsics_are_four_numbers() {
        assert_eq!("525, 520,319.5,239.5".parse(), Ok(Intrinsics([525.0, 520.0, 319.5, 239.5])));
        for wrong in ["", "1,2,3", "0,1,2,3", "1,2,3,nan", "1,2,3,4,x"] {
            assert!(wrong.parse::<Intrinsics>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_pose_is_seven_numbers_with_a_rotation() {
        assert_eq!(pose("1 2 3 0 0 0 1").unwrap().position, [1.0, 2.0, 3.0]);
        assert!(pose("1 2 3 0 0 0 0").unwrap_err().contains("length 1"));
        assert!(pose("1 2 nan 0 0 0 1").unwrap_err().contains("tz"));
        assert!(pose("1 2 3 0 0 1").unwrap_err().contains("qw is missing"));
    }
}
