//! Recorded missions: images and where they were taken.

use image::RgbImage;
use scenecast_core::Area;
use scenecast_core::UserError;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// A camera frame of a recorded mission.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordedFrame {
    pub t_s: f64,
    pub file: PathBuf,
    /// Where the camera believed to be: metres east and north.
    pub x_m: f64,
    pub y_m: f64,
    /// Depth below the surface, metres.
    pub depth_m: f64,
    /// Heading clockwise from north, radians.
    pub heading_rad: f64,
    /// Size of the image's pixels on the sea floor, in those of the camera's usual ones.
    pub scale: f64,
}

impl RecordedFrame {
    pub fn image(&self) -> Result<RgbImage, UserError> {
        Ok(crate::read_image(&self.file)?.to_rgb8())
    }
}

/// A folder with images and a table of their poses, in order of time: `poses.csv`, or the only `poses*.csv`.
///
/// The first line names the columns. Either they are `t_s,file,x_m,y_m,depth_m,heading_deg`; or
/// `file,time_utc_hms,x_px,y_px,yaw_deg,scale`, the place of the frame's middle in a mosaic whose rows grow downwards, in
/// its pixels, and how large the frame's pixels are in those.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    /// The frames, in order of time.
    pub frames: Vec<RecordedFrame>,
}

impl Recording {
    /// Reads the table of a folder; complaints name the line. A pixel of a mosaic is `metres_per_pixel` wide.
    pub fn open(dir: &Path, metres_per_pixel: f64) -> Result<Self, UserError> {
        let path = table(dir)?;
        let text = std::fs::read_to_string(&path).map_err(|e| UserError::file(&path, e))?;
        let in_pixels = text.lines().next().is_some_and(|head| head.split(',').any(|name| name.trim() == "x_px"));
        let mut frames: Vec<RecordedFrame> = Vec::new();
        for (i, line) in text.lines().enumerate().skip(1).filter(|(_, l)| !l.trim().is_empty()) {
            let place = format!("{}:{}", path.display(), i + 1);
            let (frame, columns) = match in_pixels {
                true => {
                    let midnight = frames.last().map_or(0.0, |last| (last.t_s / DAY_S).floor() * DAY_S);
                    let frame = of_mosaic(dir, line, metres_per_pixel).map(|f| after(f, midnight, frames.last()));
                    (frame, "file,time_utc_hms,x_px,y_px,yaw_deg,scale")
                }
                false => (parse(dir, line), "t_s,file,x_m,y_m,depth_m,heading_deg"),
            };
            let what = format!("{place}: expected {columns} with finite numbers");
            let frame = frame.ok_or(UserError::Input(what))?;
            if frames.last().is_some_and(|last| last.t_s > frame.t_s) {
                return Err(UserError::Input(format!("{place}: the time goes back")));
            }
            frames.push(frame);
        }
        if frames.is_empty() {
            return Err(UserError::file(&path, "there are no frames"));
        }
        // A time of the day says nothing of the mission's.
        let began_s = if in_pixels { frames[0].t_s } else { 0.0 };
        frames.iter_mut().for_each(|frame| frame.t_s -= began_s);
        Ok(Self { frames })
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

fn parse(dir: &Path, line: &str) -> Option<RecordedFrame> {
    let mut fields = line.split(',').map(str::trim);
    let t_s = fields.next()?;
    let file = fields.next()?;
    let number = |text: Option<&str>| text?.parse::<f64>().ok().filter(|v| v.is_finite());
    let (x_m, y_m) = (number(fields.next())?, number(fields.next())?);
    let (depth_m, heading_deg) = (number(fields.next())?, number(fields.next())?);
    let t_s = number(Some(t_s)).filter(|&t| t >= 0.0)?;
    Some(RecordedFrame {
        t_s,
        file: dir.join(file),
        x_m,
        y_m,
        depth_m,
        heading_rad: heading_deg.to_radians(),
        scale: 1.0,
    })
}

const DAY_S: f64 = 86_400.0;

/// A frame placed in a mosaic, at its time of the day.
fn of_mosaic(dir: &Path, line: &str, metres_per_pixel: f64) -> Option<RecordedFrame> {
    let mut fields = line.split(',').map(str::trim);
    let file = fields.next().filter(|name| !name.is_empty())?;
    let t_s = time_of_day(fields.next()?)?;
    let mut number = || fields.next()?.parse::<f64>().ok().filter(|v| v.is_finite());
    let (x_px, y_px, yaw_deg) = (number()?, number()?, number()?);
    let scale = number().filter(|&scale| scale > 0.0)?;
    let (x_m, y_m) = (x_px * metres_per_pixel, -y_px * metres_per_pixel);
    Some(RecordedFrame { t_s, file: dir.join(file), x_m, y_m, depth_m: 0.0, heading_rad: yaw_deg.to_radians(), scale })
}

fn time_of_day(text: &str) -> Option<f64> {
    let number: u32 = text.parse().ok().filter(|_| text.len() == 6)?;
    let (hours, minutes, seconds) = (number / 10_000, number / 100 % 100, number % 100);
    (hours < 24 && minutes < 60 && seconds < 61).then(|| f64::from(hours * 3600 + minutes * 60 + seconds))
}

/// The frame on the day of the one before it, or on the next if it is more than half a day earlier.
fn after(frame: RecordedFrame, midnight: f64, last: Option<&RecordedFrame>) -> RecordedFrame {
    let t_s = frame.t_s + midnight;
    let is_next_day = last.is_some_and(|last| t_s < last.t_s - DAY_S / 2.0);
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

/// Writes a recording while a mission runs.
#[derive(Debug)]
pub struct Recorder {
    dir: PathBuf,
    poses: String,
    frames: u32,
}

impl Recorder {
    /// Records into a folder, which is made.
    pub fn new(dir: &Path) -> Result<Self, UserError> {
        std::fs::create_dir_all(dir).map_err(|e| UserError::file(dir, e))?;
        let poses = "t_s,file,x_m,y_m,depth_m,heading_deg\n".to_owned();
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
        Recording::open(&dir, 0.5)
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
        assert!(bad.contains("poses.csv:2: expected file,time_utc_hms"), "{bad}");
    }

    #[test]
    fn a_folder_without_poses_is_named() {
        let said = open("none", "other.csv", "").unwrap_err().to_string();
        assert!(said.contains("poses.csv: there is no such file"), "{said}");
    }
}
