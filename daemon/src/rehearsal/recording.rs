//! Recorded missions: images and where they were taken.

use crate::auv::Area;
use crate::problem::Problem;
use image::RgbImage;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// A camera frame of a recorded mission.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordedFrame {
    /// Mission time, seconds.
    pub t_s: f64,
    /// The image's file.
    pub file: PathBuf,
    /// Where the camera believed to be: metres east and north.
    pub x_m: f64,
    /// Metres north.
    pub y_m: f64,
    /// Depth below the surface, metres.
    pub depth_m: f64,
    /// Heading clockwise from north, radians.
    pub heading_rad: f64,
}

impl RecordedFrame {
    /// Reads the image.
    pub fn image(&self) -> Result<RgbImage, Problem> {
        let image = image::open(&self.file).map_err(|e| Problem::file(&self.file, e))?;
        Ok(image.to_rgb8())
    }
}

/// A folder with images and `poses.csv`.
///
/// `poses.csv` has a header line, then `t_s,file,x_m,y_m,depth_m,heading_deg` for each frame, in order of time.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    /// The frames, in order of time.
    pub frames: Vec<RecordedFrame>,
}

impl Recording {
    /// Reads `DIR/poses.csv`; complaints name the line.
    pub fn open(dir: &Path) -> Result<Self, Problem> {
        let path = dir.join("poses.csv");
        let text = std::fs::read_to_string(&path).map_err(|e| Problem::file(&path, e))?;
        let mut frames: Vec<RecordedFrame> = Vec::new();
        for (i, line) in text.lines().enumerate().skip(1).filter(|(_, l)| !l.trim().is_empty()) {
            let place = format!("{}:{}", path.display(), i + 1);
            let frame = parse(dir, line).ok_or_else(|| {
                Problem::Input(format!("{place}: expected t_s,file,x_m,y_m,depth_m,heading_deg with finite numbers"))
            })?;
            if frames.last().is_some_and(|last| last.t_s > frame.t_s) {
                return Err(Problem::Input(format!("{place}: the time goes back")));
            }
            frames.push(frame);
        }
        if frames.is_empty() {
            return Err(Problem::file(&path, "there are no frames"));
        }
        Ok(Self { frames })
    }

    /// The folder of a `frames:DIR` source.
    pub fn folder(source: &str) -> Result<&Path, Problem> {
        let dir = source.strip_prefix("frames:").filter(|d| !d.is_empty());
        dir.map(Path::new).ok_or_else(|| Problem::Input(format!("camera.source = {source:?}: it takes frames:DIR")))
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
    Some(RecordedFrame { t_s, file: dir.join(file), x_m, y_m, depth_m, heading_rad: heading_deg.to_radians() })
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
    pub fn new(dir: &Path) -> Result<Self, Problem> {
        std::fs::create_dir_all(dir).map_err(|e| Problem::file(dir, e))?;
        let poses = "t_s,file,x_m,y_m,depth_m,heading_deg\n".to_owned();
        Ok(Self { dir: dir.to_owned(), poses, frames: 0 })
    }

    /// Keeps a frame and where the vehicle believes to have taken it; returns the pose as it will be read back.
    pub fn push(&mut self, image: &RgbImage, frame: &RecordedFrame) -> Result<(), Problem> {
        let name = format!("frame-{:06}.png", self.frames);
        self.frames += 1;
        let path = self.dir.join(&name);
        image.save(&path).map_err(|e| Problem::Failed(format!("{}: {e}", path.display())))?;
        let RecordedFrame { t_s, x_m, y_m, depth_m, heading_rad, .. } = frame;
        let heading = heading_rad.to_degrees();
        let _ = writeln!(self.poses, "{t_s},{name},{x_m},{y_m},{depth_m},{heading}");
        Ok(())
    }

    /// Writes `poses.csv`.
    pub fn finish(&self) -> Result<(), Problem> {
        crate::picture::write_whole(&self.dir.join("poses.csv"), self.poses.as_bytes())
    }
}
