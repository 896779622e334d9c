//! RGB-D sequences in the layout of the TUM benchmark (Sturm et al. 2012), as recordings: each image with its distances at the
//! pose of the camera.
//!
//! `rgb.txt` and `depth.txt` are lines `time file`, `groundtruth.txt` lines `time tx ty tz qx qy qz qw`: camera to
//! world. Depth is a 16-bit PNG in units of 1/5000 m, 0 where there is no reading.

use crate::images::{DepthFile, FrameImage, read_image};
use crate::pose_table::{Placed, reachable_rows};
use crate::recording::{RecordedFrame, Recording};
use scene_model::project::CameraPose;
use scenecast_core::UserError;
use scenecast_sensors::{Calibration, Rotation, Times, ViewGeometry, tilt_of};
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

/// How an RGB-D sequence is read.
#[derive(Debug, Clone, Default)]
pub struct TumOptions {
    /// `None` for the benchmark's own camera, scaled to the width of the images.
    pub calibration: Option<Arc<Calibration>>,
    /// Depth units per metre; `None` for those of the benchmark.
    pub units_per_m: Option<f64>,
    /// The largest angle between the optical axis and the vertical, radians.
    pub max_tilt_rad: Option<f64>,
    /// Height of the camera above the floor where an image shows no distance, metres.
    pub altitude_m: f64,
}

impl Recording {
    /// The images of an RGB-D sequence at the poses of its ground truth, whose axes are east, north and up.
    ///
    /// # Errors
    /// Lists that cannot be read, or a camera that is tilted more than allowed.
    pub fn open_tum(dir: &Path, options: &TumOptions) -> Result<Self, UserError> {
        let folder = TumFolder::open(dir)?;
        let calibration = match &options.calibration {
            Some(calibration) => calibration.clone(),
            None => {
                let width =
                    folder.frames.first().map_or(Ok(640), |first| read_image(&first.image).map(|i| i.width()))?;
                let own = Calibration::of_matrix(tum_camera(width));
                Arc::new(own.map_err(|error| UserError::file(dir, error))?)
            }
        };
        let began_s = folder.frames.first().map_or(0.0, |first| first.t_s);
        let mut frames = Vec::new();
        for frame in &folder.frames {
            frames.push(recorded(frame, began_s, &calibration, options).map_err(|cause| {
                UserError::Input(format!(
                    "{}: the pose at {} s: {cause}",
                    dir.join("groundtruth.txt").display(),
                    frame.t_s
                ))
            })?);
        }
        Ok(Self { frames, notes: folder.notes().collect() })
    }
}

/// Why a field of a line is not read as a finite number.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NumberFault {
    #[error("{0} is missing")]
    Missing(&'static str),
    #[error("{name} = {text:?} is no number")]
    NoNumber { name: &'static str, text: String },
    #[error("{name} = {text}: it takes a finite number")]
    NotFinite { name: &'static str, text: String },
}

/// The finite number in a field of this name, with blanks around it or without.
pub fn finite_number(field: Option<&str>, name: &'static str) -> Result<f64, NumberFault> {
    let text = field.map(str::trim).ok_or(NumberFault::Missing(name))?;
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        Ok(_) => Err(NumberFault::NotFinite { name, text: text.to_owned() }),
        Err(_) => Err(NumberFault::NoNumber { name, text: text.to_owned() }),
    }
}

/// A line of a list, or a pose, that cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
enum TumError {
    #[error(transparent)]
    Number(#[from] NumberFault),
    #[error("expected a time and a file")]
    NoFile,
    #[error("the file is {0:?}; expected a file below the folder")]
    FileElsewhere(String),
    #[error("the quaternion qx qy qz qw has not the length 1")]
    Rotation,
    #[error(
        "the camera looks {off_vertical_deg:.0} degrees away from straight down; with registration.enabled = true, up to {most_deg:.0} are allowed"
    )]
    Tilted { off_vertical_deg: f64, most_deg: f64 },
}

fn recorded(
    frame: &TumFrame,
    began_s: f64,
    calibration: &Arc<Calibration>,
    options: &TumOptions,
) -> Result<RecordedFrame, TumError> {
    let turn = Rotation::from_quaternion(frame.pose.rotation).ok_or(TumError::Rotation)?;
    let pose = turn.camera_pose(frame.pose.position);
    let axis = turn.apply([0.0, 0.0, 1.0]);
    let off_vertical = axis[0].hypot(axis[1]).atan2(-axis[2]);
    if let Some(most) = options.max_tilt_rad.filter(|most| off_vertical > *most) {
        return Err(TumError::Tilted { off_vertical_deg: off_vertical.to_degrees(), most_deg: most.to_degrees() });
    }
    let tilt = tilt_of(frame.pose.rotation, pose.heading_rad);
    let units_per_m = options.units_per_m.unwrap_or(TUM_UNITS_PER_M);
    Ok(RecordedFrame {
        t_s: frame.t_s - began_s,
        image: FrameImage::File(frame.image.clone()),
        x_m: pose.x_m,
        y_m: pose.y_m,
        depth_m: pose.depth_m,
        heading_rad: pose.heading_rad,
        scale: 1.0,
        geometry: Some(ViewGeometry { calibration: calibration.clone(), tilt, height_m: options.altitude_m }),
        depth: Some(DepthFile { path: frame.depth.clone(), units_per_m }),
    })
}

/// Maximum time between an image and the depth image or the pose that is matched with it, seconds.
const MAX_APART_S: f64 = 0.02;
/// Size of the largest list, bytes.
const MAX_LIST_BYTES: u64 = 256 << 20;
/// Image width of the benchmark's own camera, pixels.
const BENCHMARK_WIDTH_PX: f64 = 640.0;
/// fx, fy, cx and cy of the benchmark's own camera, pixels.
const BENCHMARK_CAMERA: [f64; 4] = [525.0, 525.0, 319.5, 239.5];

/// Depth units per metre of the benchmark.
pub const TUM_UNITS_PER_M: f64 = 5000.0;

/// The frames of a sequence that have depth and pose.
#[derive(Debug, Clone, PartialEq)]
pub struct TumFolder {
    /// The frames, in the order of their time.
    pub frames: Vec<TumFrame>,
    /// Images of the sequence, with those that are not among the frames.
    pub images: usize,
    /// About poses that are left out.
    note: Option<String>,
}

/// An image with its depth image and its pose.
#[derive(Debug, Clone, PartialEq)]
pub struct TumFrame {
    /// Time of the image in the list, seconds.
    pub t_s: f64,
    pub image: PathBuf,
    pub depth: PathBuf,
    pub pose: CameraPose,
}

impl TumFolder {
    /// Reads the lists of a folder.
    ///
    /// # Errors
    /// A list that cannot be read, by its line, or no image with depth and pose.
    pub fn open(dir: &Path) -> Result<Self, UserError> {
        let images = times_and(read_list(&dir.join("rgb.txt"), file)?);
        let depths = times_and(read_list(&dir.join("depth.txt"), file)?);
        let path = dir.join("groundtruth.txt");
        let poses = read_list(&path, pose)?.into_iter().map(|Entry { line, t_s, content: pose }| {
            let [east, north, _] = pose.position;
            Placed { line, t_s, at: [east, north], content: (t_s, pose) }
        });
        let (poses, note) = reachable_rows(&path, poses.collect(), Times::Exact);
        let mut frames = Vec::new();
        for (t_s, image) in &images {
            if let (Some(depth), Some(pose)) = (nearest(&depths, *t_s), nearest(&poses, *t_s)) {
                frames.push(TumFrame { t_s: *t_s, image: dir.join(image), depth: dir.join(depth), pose: *pose });
            }
        }
        if frames.is_empty() {
            let cause =
                format!("none of its {} images has a depth image and a pose within {MAX_APART_S} s", images.len());
            return Err(UserError::file(&dir.join("rgb.txt"), cause));
        }
        Ok(Self { images: images.len(), frames, note })
    }

    /// Lines about poses that are left out, and about images without a depth image or a pose.
    pub fn notes(&self) -> impl Iterator<Item = String> {
        let few = self.images - self.frames.len();
        let all = self.images;
        let few =
            (few > 0).then(|| format!("{few} of {all} images have no depth image or no pose within {MAX_APART_S} s"));
        self.note.clone().into_iter().chain(few)
    }
}

/// fx, fy, cx and cy of the benchmark's own camera in images of a width, pixels.
pub fn tum_camera(width_px: u32) -> [f64; 4] {
    BENCHMARK_CAMERA.map(|pixels| pixels * f64::from(width_px) / BENCHMARK_WIDTH_PX)
}

/// A line of a list.
struct Entry<T> {
    line: u64,
    t_s: f64,
    content: T,
}

fn times_and<T>(list: Vec<Entry<T>>) -> Vec<(f64, T)> {
    list.into_iter().map(|entry| (entry.t_s, entry.content)).collect()
}

/// Reads lines `time value` and sorts them by time; errors name the line.
fn read_list<T>(path: &Path, read: impl Fn(&str) -> Result<T, TumError>) -> Result<Vec<Entry<T>>, UserError> {
    let text = scenecast_config::read_text(path, MAX_LIST_BYTES)?;
    let mut list = Vec::new();
    for (place, line) in (1..).zip(text.lines()) {
        let line = line.trim_start_matches('\u{feff}').trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let (time, rest) = line.split_once([' ', '\t', ',']).unwrap_or((line, ""));
        let time = finite_number(Some(time), "the time").map_err(TumError::Number);
        let entry = time.and_then(|t_s| Ok(Entry { line: place, t_s, content: read(rest.trim())? }));
        let place = || format!("{}:{place}", path.display());
        list.push(entry.map_err(|error| UserError::Input(format!("{}: {error}", place())))?);
    }
    if list.is_empty() {
        return Err(UserError::file(path, "there are no lines"));
    }
    list.sort_by(|a, b| a.t_s.total_cmp(&b.t_s));
    Ok(list)
}

fn file(text: &str) -> Result<PathBuf, TumError> {
    let is_inside = Path::new(text).components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
    match text {
        "" => Err(TumError::NoFile),
        _ if !is_inside => Err(TumError::FileElsewhere(text.to_owned())),
        _ => Ok(text.into()),
    }
}

fn pose(text: &str) -> Result<CameraPose, TumError> {
    let mut fields = text.split([' ', '\t', ',']).filter(|field| !field.is_empty());
    let mut next = |name| finite_number(fields.next(), name);
    let position = [next("tx")?, next("ty")?, next("tz")?];
    let rotation = [next("qx")?, next("qy")?, next("qz")?, next("qw")?];
    Rotation::from_quaternion(rotation).ok_or(TumError::Rotation)?;
    Ok(CameraPose { position, rotation })
}

fn nearest<T>(list: &[(f64, T)], t_s: f64) -> Option<&T> {
    let after = list.partition_point(|entry| entry.0 < t_s);
    let near = list[after.saturating_sub(1)..(after + 1).min(list.len())].iter();
    let best = near.min_by(|a, b| (a.0 - t_s).abs().total_cmp(&(b.0 - t_s).abs()))?;
    // Times have microseconds; as floating-point numbers they may differ a little more than the limit.
    ((best.0 - t_s).abs() <= MAX_APART_S + 1e-6).then_some(&best.1)
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
    fn a_pose_is_seven_numbers_with_a_rotation() {
        assert_eq!(pose("1 2 3 0 0 0 1").unwrap().position, [1.0, 2.0, 3.0]);
        let refused = |text| pose(text).unwrap_err().to_string();
        assert!(refused("1 2 3 0 0 0 0").contains("length 1"));
        assert!(refused("1 2 nan 0 0 0 1").contains("tz"));
        assert!(refused("1 2 3 0 0 1").contains("qw is missing"));
    }

    #[test]
    fn a_pose_that_no_vehicle_reaches_is_left_out_and_named() {
        let dir = std::env::temp_dir().join(format!("scenecast-{}-tum-spikes", std::process::id()));
        std::fs::create_dir_all(&dir).unwrap();
        let list = |name: &str, line: fn(i32) -> String| {
            let text: String = (0..40).map(|i| format!("{}.5 {}\n", 1_305_031_102 + i, line(i))).collect();
            std::fs::write(dir.join(name), "# time\n".to_owned() + &text).unwrap();
        };
        list("rgb.txt", |i| format!("{i}.png"));
        list("depth.txt", |i| format!("{i}d.png"));
        list("groundtruth.txt", |i| format!("{} 0 -3 1 0 0 0", if i == 9 { 400 } else { i }));
        let folder = TumFolder::open(&dir).unwrap();
        assert!(folder.frames.len() == 39 && folder.frames.iter().all(|frame| frame.pose.position[0] < 40.0));
        let notes: Vec<String> = folder.notes().collect();
        assert!(notes.len() == 2 && notes[0].contains("groundtruth.txt:11: [400.0, 0.0] m"), "{notes:?}");
        std::fs::remove_dir_all(&dir).unwrap();
    }

    #[test]
    fn a_file_outside_of_the_folder_is_refused() {
        assert!(file("rgb/1.png").is_ok());
        assert!(file("../1.png").unwrap_err().to_string().contains("below the folder"));
        assert!(file("").is_err());
    }
}
