//! `scenecast scene register`

use crate::progress::Progress;
use clap::Args;
use scenecast_core::{UserError, errln, outln};
use scenecast_files::{RecordedFrame, Recording, write_poses};
use scenecast_protocol::coordinates::MapPoint;
use scenecast_registration::{
    CameraFinding, CameraGeometry, CameraImage, FrameGraph, FrameInput, FramePose, GeometryCheck, Registrar, Tally,
};
use std::path::PathBuf;

/// Place the frames of a recorded dive by their overlap, all at once.
///
/// The vehicle places each frame once, by what it knows by then. After the dive, this command matches the frames again in
/// the same way, and then places all of them by all matches. It writes a table of poses with which scenecast scene run
/// --source frames:DIR --poses FILE maps the dive anew.
#[derive(Debug, Args)]
#[command(after_help = "Example: scenecast scene register --frames dive7 --out dive7-placed.csv")]
pub struct Register {
    /// Folder of downward images with poses.csv
    #[arg(long, value_name = "DIR")]
    frames: PathBuf,
    /// Table of the new poses to write, replaced if it exists
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Size of a pixel on the ground
    #[arg(long, value_name = "M", default_value_t = 0.01, allow_negative_numbers = true)]
    metres_per_pixel: f64,
    /// Drift of the recorded poses, in percent of the distance travelled
    #[arg(long, value_name = "PERCENT", default_value_t = 1.0, allow_negative_numbers = true)]
    drift: f64,
    /// Print JSON instead of a line
    #[arg(long)]
    json: bool,
}

/// The frames that could be read, where each was placed when it came in, and all matches.
#[derive(Default)]
struct PlacedFrames<'a> {
    frames: Vec<&'a RecordedFrame>,
    poses: Vec<FramePose>,
    graph: FrameGraph,
    tally: Tally,
    geometry: Option<CameraGeometry>,
    unreadable: Vec<String>,
}

impl Register {
    pub fn run(self) -> Result<(), UserError> {
        let within =
            |name: &str, value: f64, least: f64, most: f64, allowed: &str| match (least..=most).contains(&value) {
                true => Ok(()),
                false => Err(UserError::Input(format!("--{name} {value} is not allowed; allowed: {allowed}"))),
            };
        within("metres-per-pixel", self.metres_per_pixel, 1e-6, 1e3, "0.000001 to 1000 m")?;
        within("drift", self.drift, 0.0, 50.0, "0 to 50 %")?;
        let recording = Recording::open(&self.frames, None, self.metres_per_pixel)?;
        recording.notes.iter().for_each(|note| errln!("{note}"));
        let placed = self.place(&recording)?;
        if let [first, ..] = placed.unreadable.as_slice() {
            errln!("{} frames that cannot be read are left out; the first: {first}", placed.unreadable.len());
        }
        if let Some(geometry) = placed.geometry {
            let (CameraFinding::AsConfigured(text) | CameraFinding::Wrong(text)) =
                geometry.finding(self.metres_per_pixel);
            errln!("{text}");
        }
        if placed.geometry.is_some_and(|geometry| geometry.is_mirrored.is_none()) {
            errln!("the vehicle turns too little to show whether the images are mirrored");
        }
        let solved = placed.graph.solve();
        let frames = placed.frames.iter().zip(&solved).map(|(frame, pose)| {
            let (x_m, y_m) = pose.at().xy();
            let scale = frame.scale * pose.scale();
            RecordedFrame { x_m, y_m, heading_rad: pose.heading_rad, scale, ..(*frame).clone() }
        });
        write_poses(&self.out, &self.frames, &frames.collect::<Vec<_>>())?;
        self.print(&placed, rms_m(&placed.poses, &solved));
        Ok(())
    }

    /// Places the frames one after the other, as the vehicle does.
    fn place<'a>(&self, recording: &'a Recording) -> Result<PlacedFrames<'a>, UserError> {
        let mut registrar = Registrar::new(self.drift / 100.0);
        let (mut placed, mut geometry) = (PlacedFrames::default(), GeometryCheck::default());
        let mut progress = Progress::new("frames");
        for (i, frame) in recording.frames.iter().enumerate() {
            progress.show(i as f64 / recording.frames.len() as f64);
            let image = match frame.image.read() {
                Ok(image) => image,
                Err(error) => {
                    placed.unreadable.push(error.to_string());
                    continue;
                }
            };
            let pixels = CameraImage::rgb(image.width() as usize, image.height() as usize, image.as_raw());
            let wrong_size =
                || UserError::Input(format!("{}: the image is too small or too large to be registered", frame.image));
            let input = FrameInput {
                image: pixels.ok_or_else(wrong_size)?,
                metres_per_pixel: self.metres_per_pixel * frame.scale,
                dead_reckoned: MapPoint::new(frame.x_m, frame.y_m),
                compass_rad: frame.heading_rad,
            };
            geometry.handle_frame(&input);
            let found = registrar.handle_frame(&input);
            placed.graph.add(&found);
            placed.poses.push(found.pose);
            placed.frames.push(frame);
        }
        if placed.frames.is_empty() {
            return Err(UserError::file(&self.frames, "no frame can be read"));
        }
        placed.tally = registrar.tally();
        placed.geometry = geometry.geometry();
        Ok(placed)
    }

    fn print(&self, placed: &PlacedFrames<'_>, moved_m: f64) {
        let Tally { frames, chained, looped, loops, contradicted, unseen, .. } = placed.tally;
        if self.json {
            let out = self.out.display().to_string();
            let all = serde_json::json!({
                "frames": frames, "chained": chained, "looped": looped, "loops": loops, "contradicted": contradicted,
                "metres_per_pixel_by_images": placed.geometry.map(|geometry| self.metres_per_pixel / geometry.size_ratio),
                "unseen": unseen, "unreadable": placed.unreadable.len(), "moved_rms_m": moved_m, "out": out,
            });
            return outln!("{all}");
        }
        outln!(
            "{frames} frames: {chained} matched with the frame before, {looped} with earlier tracks ({loops} matches, \
             {contradicted} not used), {unseen} by odometry alone"
        );
        outln!(
            "{}: the frames lie {moved_m:.3} m (root mean square) from where each was placed when it came in",
            self.out.display()
        );
    }
}

/// The root mean square distance of two tracks, metres.
fn rms_m(a: &[FramePose], b: &[FramePose]) -> f64 {
    let squares = a.iter().zip(b).map(|(a, b)| a.at().distance_m(b.at()).powi(2));
    (squares.sum::<f64>() / a.len().max(1) as f64).sqrt()
}
