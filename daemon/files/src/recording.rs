//! Recorded missions: images with their poses.

use crate::images::{DepthFile, FrameImage};
use crate::pose_table::{Columns, Placed, PoseRow, PoseTableError, reachable_rows};
use image::RgbImage;
use scene_model::project::View;
use scenecast_core::{Area, UserError};
use scenecast_sensors::{Times, ViewGeometry};
use std::fmt::Write as _;
use std::io::{BufRead as _, Read as _};
use std::path::{Path, PathBuf};

/// A camera frame of a recorded mission.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordedFrame {
    pub t_s: f64,
    pub image: FrameImage,
    /// Where the camera believed to be: metres east and north.
    pub x_m: f64,
    pub y_m: f64,
    /// Depth below the surface, metres.
    pub depth_m: f64,
    /// Heading clockwise from north, radians.
    pub heading_rad: f64,
    /// Size of the image's pixels on the sea floor, in those of the camera's usual ones.
    pub scale: f64,
    /// The calibrated camera. With it, the pose is that of the camera itself; otherwise it is above the middle of the frame.
    pub geometry: Option<ViewGeometry>,
    /// The distances that were measured with the image.
    pub depth: Option<DepthFile>,
}

impl RecordedFrame {
    /// The image, without distortion if the camera is calibrated, and what it then sees.
    ///
    /// # Errors
    /// A file that cannot be read, or is not as its calibration says.
    pub fn read(&self) -> Result<(RgbImage, Option<View>), UserError> {
        let image = self.image.read()?;
        let Some(geometry) = &self.geometry else { return Ok((image, None)) };
        let depth = self.depth.as_ref().map(DepthFile::read).transpose()?;
        let viewed = geometry.view(image, depth);
        let (image, view) = viewed.map_err(|error| UserError::Input(format!("{}: {error}", self.image)))?;
        Ok((image, Some(view)))
    }
}

/// A folder with images and a table of their poses, in order of time: `poses.csv`, or the only `poses*.csv`.
///
/// The table is CSV (RFC 4180), and its first line names the columns, in any order; further columns are ignored. Either
/// they are `t_s,file,x_m,y_m,depth_m,heading_deg`, to which `scale` may be added, the size of the frame's pixels in the
/// camera's usual ones; or `file,time_utc_hms,x_px,y_px,yaw_deg,scale`: the position of the
/// frame's middle in a mosaic, in the mosaic's pixels with rows that grow downwards, and the size of the frame's pixels
/// in those of the mosaic.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    /// The frames, in order of time.
    pub frames: Vec<RecordedFrame>,
    /// What of the recording is not among the frames, for people.
    pub notes: Vec<String>,
}

/// Largest table, for about ten million frames, bytes.
const MAX_TABLE_BYTES: u64 = 1 << 30;

impl Recording {
    /// Reads a table of poses, or else that of the folder; an error names the line. A pixel of a mosaic is
    /// `metres_per_pixel` wide.
    pub fn open(dir: &Path, poses: Option<&Path>, metres_per_pixel: f64) -> Result<Self, UserError> {
        let path = poses.map_or_else(|| table(dir), |path| Ok(path.to_owned()))?;
        let file = scenecast_config::open_regular(&path, MAX_TABLE_BYTES)?;
        let mut file = std::io::BufReader::new(file.take(MAX_TABLE_BYTES));
        if let Some(fault) = scenecast_config::utf16_fault(file.fill_buf().map_err(|e| UserError::file(&path, e))?) {
            return Err(UserError::file(&path, fault));
        }
        let mut reader = csv::ReaderBuilder::new().flexible(true).trim(csv::Trim::All).from_reader(file);
        let names = reader.headers().map_err(|e| UserError::file(&path, e))?.clone();
        let (columns, in_pixels) = match names.iter().any(|name| name == "x_px") {
            true => (Columns::find(&names, &MOSAIC_COLUMNS), true),
            false => (Columns::find(&names, &METRE_COLUMNS), false),
        };
        let columns = columns.map_err(|wrong| UserError::Input(format!("{}:1: {wrong}", path.display())))?;
        let mut frames: Vec<Placed<RecordedFrame>> = Vec::new();
        for row in reader.records() {
            let row = row.map_err(|e| UserError::file(&path, e))?;
            let line = row.position().map_or(0, csv::Position::line);
            let place = format!("{}:{line}", path.display());
            let last = frames.last().map(|last| last.t_s);
            let frame = PoseRow::new(&columns, &row).and_then(|row| match in_pixels {
                true => {
                    let midnight = last.map_or(0.0, |last_s| (last_s / DAY_S).floor() * DAY_S);
                    of_mosaic(dir, row, metres_per_pixel).map(|f| after(f, midnight, last))
                }
                false => of_metres(dir, row),
            });
            let frame = frame.map_err(|wrong| UserError::Input(format!("{place}: {wrong}")))?;
            if let Some(before) = last.filter(|last_s| *last_s > frame.t_s) {
                let now = frame.t_s;
                let line = format!("{place}: the time {now} s is earlier than {before} s on the line before");
                return Err(UserError::Input(line));
            }
            frames.push(Placed { line, t_s: frame.t_s, at: [frame.x_m, frame.y_m], content: frame });
        }
        if frames.is_empty() {
            return Err(UserError::file(&path, "there are no frames"));
        }
        let (mut frames, note) = reachable_rows(&path, frames, Times::Coarse);
        // The table gives the time of the day, not the mission's.
        let began_s = if in_pixels { frames[0].t_s } else { 0.0 };
        frames.iter_mut().for_each(|frame| frame.t_s -= began_s);
        Ok(Self { frames, notes: note.into_iter().collect() })
    }

    /// Limits of the places in the recording.
    pub fn area(&self) -> Area {
        let nowhere = Area { west: f64::MAX, south: f64::MAX, east: f64::MIN, north: f64::MIN };
        self.frames.iter().fold(nowhere, |a, f| Area {
            west: a.west.min(f.x_m),
            south: a.south.min(f.y_m),
            east: a.east.max(f.x_m),
            north: a.north.max(f.y_m),
        })
    }
}

const METRE_COLUMNS: [&str; 6] = ["t_s", "file", "x_m", "y_m", "depth_m", "heading_deg"];
const MOSAIC_COLUMNS: [&str; 6] = ["file", "time_utc_hms", "x_px", "y_px", "yaw_deg", "scale"];

fn of_metres(dir: &Path, row: PoseRow<'_>) -> Result<RecordedFrame, PoseTableError> {
    Ok(RecordedFrame {
        t_s: row.number_in("t_s", |t_s| t_s >= 0.0, "0 or more")?,
        image: FrameImage::File(row.file(dir)?),
        x_m: row.number("x_m")?,
        y_m: row.number("y_m")?,
        depth_m: row.depth_m()?,
        heading_rad: row.number("heading_deg")?.to_radians(),
        scale: row.scale()?,
        geometry: None,
        depth: None,
    })
}

const DAY_S: f64 = 86_400.0;

/// A frame placed in a mosaic, at its time of the day.
fn of_mosaic(dir: &Path, row: PoseRow<'_>, metres_per_pixel: f64) -> Result<RecordedFrame, PoseTableError> {
    let time = row.text("time_utc_hms")?;
    let t_s = time_of_day(time).ok_or_else(|| PoseTableError::text("time_utc_hms", time, "hhmmss"))?;
    let scale = row.number_in("scale", |scale| scale > 0.0, "more than 0")?;
    Ok(RecordedFrame {
        t_s,
        image: FrameImage::File(row.file(dir)?),
        x_m: row.number("x_px")? * metres_per_pixel,
        y_m: -row.number("y_px")? * metres_per_pixel,
        depth_m: 0.0,
        heading_rad: row.number("yaw_deg")?.to_radians(),
        scale,
        geometry: None,
        depth: None,
    })
}

fn time_of_day(text: &str) -> Option<f64> {
    let number: u32 = text.parse().ok().filter(|_| text.len() == 6)?;
    let (hours, minutes, seconds) = (number / 10_000, number / 100 % 100, number % 100);
    (hours < 24 && minutes < 60 && seconds < 61).then(|| f64::from(hours * 3600 + minutes * 60 + seconds))
}

/// The frame on the day of the one before it, or on the next if it is more than half a day earlier.
fn after(frame: RecordedFrame, midnight: f64, last_s: Option<f64>) -> RecordedFrame {
    let t_s = frame.t_s + midnight;
    let is_next_day = last_s.is_some_and(|last_s| t_s < last_s - DAY_S / 2.0);
    RecordedFrame { t_s: if is_next_day { t_s + DAY_S } else { t_s }, ..frame }
}

/// The table of a folder's poses.
fn table(dir: &Path) -> Result<PathBuf, UserError> {
    let usual = dir.join("poses.csv");
    if usual.is_file() {
        return Ok(usual);
    }
    let mut tables = Vec::new();
    for entry in std::fs::read_dir(dir).map_err(|e| UserError::file(dir, e))? {
        let name = entry.map_err(|e| UserError::file(dir, e))?.file_name();
        let name = name.to_string_lossy().into_owned();
        if name.starts_with("poses") && name.ends_with(".csv") {
            tables.push(name);
        }
    }
    match tables.as_slice() {
        [] => Err(UserError::file(&usual, "there is no such file; it tells where the images were taken")),
        [only] => Ok(dir.join(only)),
        _ => Err(UserError::file(dir, format!("which of {} counts? name it poses.csv", tables.join(", ")))),
    }
}

/// Writes a table of poses of a folder's frames, with their scales.
pub fn write_poses(path: &Path, dir: &Path, frames: &[RecordedFrame]) -> Result<(), UserError> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let failed = |e: csv::Error| UserError::Failed(format!("{}: {e}", path.display()));
    writer.write_record(METRE_COLUMNS.iter().chain(&["scale"])).map_err(failed)?;
    for frame in frames {
        let file = frame.image.file().map(|file| file.strip_prefix(dir).unwrap_or(file));
        let file = file.map_or(frame.image.to_string(), |file| file.to_string_lossy().into_owned());
        let numbers =
            [frame.x_m, frame.y_m, frame.depth_m, frame.heading_rad.to_degrees().rem_euclid(360.0), frame.scale];
        let row = [frame.t_s.to_string(), file].into_iter().chain(numbers.map(|number| number.to_string()));
        writer.write_record(row).map_err(failed)?;
    }
    let bytes = writer.into_inner().map_err(|e| UserError::Failed(format!("{}: {e}", path.display())))?;
    crate::write_whole(path, &bytes)
}

/// Writes a recording while a mission runs.
#[derive(Debug)]
pub struct Recorder {
    dir: PathBuf,
    poses: String,
    frames: u32,
}

/// Whether a file is one that a [`Recorder`] writes.
fn is_recorded(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let number = name.strip_prefix("frame-").and_then(|rest| rest.strip_suffix(".png"));
    name == "poses.csv" || number.is_some_and(|n| n.len() == 6 && n.bytes().all(|b| b.is_ascii_digit()))
}

impl Recorder {
    /// Whether a folder has a recording, or a part of one.
    pub fn has_recording(dir: &Path) -> bool {
        std::fs::read_dir(dir).is_ok_and(|entries| entries.flatten().any(|entry| is_recorded(&entry.path())))
    }

    /// Records into a folder, which is made. An earlier recording in it is removed.
    pub fn new(dir: &Path) -> Result<Self, UserError> {
        let failed = |e| UserError::file(dir, e);
        std::fs::create_dir_all(dir).map_err(failed)?;
        for entry in std::fs::read_dir(dir).map_err(failed)? {
            let path = entry.map_err(failed)?.path();
            if is_recorded(&path) {
                std::fs::remove_file(&path).map_err(|e| UserError::file(&path, e))?;
            }
        }
        let poses = METRE_COLUMNS.join(",") + "\n";
        Ok(Self { dir: dir.to_owned(), poses, frames: 0 })
    }

    /// Keeps a frame and where the vehicle believes to have taken it; returns the pose as it will be read back.
    pub fn push(&mut self, image: &RgbImage, frame: &RecordedFrame) -> Result<(), UserError> {
        let name = format!("frame-{:06}.png", self.frames);
        self.frames += 1;
        let path = self.dir.join(&name);
        image.save(&path).map_err(|e| UserError::Failed(format!("{}: {e}", path.display())))?;
        let RecordedFrame { t_s, x_m, y_m, depth_m, heading_rad, .. } = frame;
        let heading = heading_rad.to_degrees();
        let _ = writeln!(self.poses, "{t_s},{name},{x_m},{y_m},{depth_m},{heading}");
        Ok(())
    }

    pub fn finish(&self) -> Result<(), UserError> {
        crate::write_whole(&self.dir.join("poses.csv"), self.poses.as_bytes())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn open(name: &str, table: &str, text: &str) -> Result<Recording, UserError> {
        let dir = std::env::temp_dir().join(format!("scenecast-{}-recording-{name}", std::process::id()));
        let _ = std::fs::remove_dir_all(&dir);
        std::fs::create_dir_all(&dir).unwrap();
        std::fs::write(dir.join(table), text).unwrap();
        Recording::open(&dir, None, 0.5)
    }

    #[test]
    fn mosaic_positions_become_metres_and_time_passes_midnight() {
        let text = "file,time_utc_hms,x_px,y_px,yaw_deg,scale\na.tif,235950,10,20,90,0.9\nb.tif,000010,-4,8,0,1\n";
        let frames = open("mosaic", "poses_estimated.csv", text).unwrap().frames;
        let first = &frames[0];
        assert_eq!((first.t_s, first.x_m, first.y_m, first.scale), (0.0, 5.0, -10.0, 0.9));
        assert!((first.heading_rad - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
        assert_eq!((frames[1].t_s, frames[1].y_m), (20.0, -4.0));
        let bad = open("bad", "poses.csv", &text.replace("235950", "2359")).unwrap_err().to_string();
        assert!(bad.contains("poses.csv:2: time_utc_hms is \"2359\"; expected hhmmss"), "{bad}");
    }

    #[test]
    fn written_poses_are_read_back_with_their_scales() {
        let text = "t_s,file,x_m,y_m,depth_m,heading_deg\n0,a.png,1,2,3,90\n1.5,\"sub/b, c.png\",-1,2.25,3,350\n";
        let mut recording = open("written", "poses.csv", text).unwrap();
        recording.frames[1].scale = 1.02;
        let dir = recording.frames[0].image.file().unwrap().parent().unwrap().to_owned();
        let table = dir.join("placed.csv");
        write_poses(&table, &dir, &recording.frames).unwrap();
        let read = Recording::open(&dir, Some(&table), 0.5).unwrap();
        for (read, written) in read.frames.iter().zip(&recording.frames) {
            assert_eq!((&read.image, read.t_s, read.scale), (&written.image, written.t_s, written.scale));
            assert!((read.x_m, read.y_m, read.depth_m) == (written.x_m, written.y_m, written.depth_m));
            assert!((read.heading_rad - written.heading_rad).abs() < 1e-12);
        }
        let text = "t_s,file,x_m,y_m,depth_m,heading_deg,scale\n0,a.png,1,2,3,4,0\n";
        let wrong = open("scale", "poses.csv", text).unwrap_err().to_string();
        assert!(wrong.contains("poses.csv:2: scale is \"0\"; expected 0.001 to 1000"), "{wrong}");
    }

    #[test]
    fn a_place_that_no_vehicle_reaches_is_left_out_and_named() {
        let table = |x_m: fn(i32) -> f64| {
            let row = |i| format!("{},{i}.png,{},2,3,90\n", 0.5 * f64::from(i), x_m(i));
            "t_s,file,x_m,y_m,depth_m,heading_deg\n".to_owned() + &(0..20).map(row).collect::<String>()
        };
        let read = |x_m| open("spikes", "poses.csv", &table(x_m)).unwrap();
        let spiked = read(|i| if i == 7 { 400.0 } else { f64::from(i) });
        assert!(spiked.frames.len() == 19 && spiked.frames.iter().all(|frame| frame.x_m < 20.0));
        let [note] = &spiked.notes[..] else { panic!("{:?}", spiked.notes) };
        assert!(
            note.starts_with("1 of 20 poses are left out") && note.contains("poses.csv:9: [400.0, 2.0] m"),
            "{note}"
        );
        assert_eq!(read(|i| if i < 7 { 400.0 } else { f64::from(i) }).notes, [""; 0]);
        let fast = read(|i| 400.0 * f64::from(i));
        assert!(
            fast.frames.len() == 20 && fast.notes[0].contains("all are used: check times and units"),
            "{:?}",
            fast.notes
        );
    }

    #[test]
    fn a_table_in_utf_16_is_refused_by_name() {
        let text: Vec<u8> = "t_s,file\r\n0,a.png\r\n".encode_utf16().flat_map(u16::to_le_bytes).collect();
        let dir = std::env::temp_dir().join(format!("scenecast-{}-recording-utf-16", std::process::id()));
        std::fs::create_dir_all(&dir).unwrap();
        for (head, encoding) in [(&b""[..], "UTF-16LE"), (b"\xFF\xFE", "UTF-16")] {
            std::fs::write(dir.join("poses.csv"), [head, &text].concat()).unwrap();
            let error = Recording::open(&dir, None, 0.5).unwrap_err().to_string();
            assert!(error.contains(&format!("poses.csv: it is UTF-16 and not UTF-8: iconv -f {encoding} ")), "{error}");
        }
    }

    #[test]
    fn columns_are_found_by_name_and_fields_may_be_quoted() {
        let text = "\u{feff}heading_deg, file ,note,x_m,y_m,depth_m,t_s\r\n90,\"reef, east.png\",\"\",1,2,3,4.5\r\n";
        let frames = open("names", "poses.csv", text).unwrap().frames;
        assert!(frames[0].image.file().unwrap().ends_with("reef, east.png"), "{}", frames[0].image);
        assert_eq!((frames[0].t_s, frames[0].x_m, frames[0].y_m, frames[0].depth_m), (4.5, 1.0, 2.0, 3.0));
        let missing = open("missing", "poses.csv", "t_s,file,x_m,y_m\n0,a.png,1,2\n").unwrap_err().to_string();
        assert!(missing.contains("poses.csv:1: no column depth_m"), "{missing}");
        let text = "t_s,file,x_m,y_m,depth_m,heading_deg\n0,a.png,1,2,3,4\n1,b.png,nan,2,3,4\n";
        let wrong = open("wrong", "poses.csv", text).unwrap_err().to_string();
        assert!(wrong.contains("poses.csv:3: x_m is \"nan\"; expected a finite number"), "{wrong}");
    }

    #[test]
    fn a_row_with_other_fields_or_a_column_twice_is_refused() {
        let head = "t_s,file,x_m,y_m,depth_m,heading_deg";
        for (name, row, count) in [("fewer", "1,b.png,1,2,3", 5), ("more", "1,b.png,1,5,2,3,4", 7)] {
            let wrong = open(name, "poses.csv", &format!("{head}\n0,a.png,1,2,3,4\n{row}\n")).unwrap_err().to_string();
            let expected = format!("poses.csv:3: the row has {count} fields; the first line names 6 columns");
            assert!(wrong.contains(&expected), "{wrong}");
        }
        let wrong = open("twice", "poses.csv", &format!("{head},x_m\n0,a.png,1,2,3,4,5\n")).unwrap_err().to_string();
        assert!(wrong.contains("poses.csv:1: two columns x_m, the columns 3 and 7"), "{wrong}");
        assert!(open("notes", "poses.csv", &format!("{head},note,note\n0,a.png,1,2,3,4,,\n")).is_ok());
    }

    #[test]
    fn a_file_elsewhere_or_a_negative_depth_is_refused() {
        let refused = |name: &str, row: &str| {
            let text = format!("t_s,file,x_m,y_m,depth_m,heading_deg\n0,a.png,1,2,3,4\n{row}\n");
            open(name, "poses.csv", &text).unwrap_err().to_string()
        };
        assert!(refused("up", "1,../b.png,1,2,3,4").contains("poses.csv:3: file is \"../b.png\""));
        assert!(refused("root", "1,/etc/passwd,1,2,3,4").contains("poses.csv:3: file is"));
        assert!(refused("height", "1,b.png,1,2,-3,4").contains("poses.csv:3: depth_m is -3"));
    }

    #[test]
    fn a_folder_without_poses_is_named() {
        let error = open("none", "other.csv", "").unwrap_err().to_string();
        assert!(error.contains("poses.csv: there is no such file"), "{error}");
    }
}
