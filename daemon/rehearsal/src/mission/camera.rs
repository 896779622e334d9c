//! The camera of a rehearsal: a view of the simulated sea floor, or a recording.

use super::accuracy::TrueCells;
use crate::world::World;
use image::RgbImage;
use scenecast_config::{Config, cell_m};
use scenecast_core::{Area, UserError};
use scenecast_files::{RecordedFrame, Recorder, Recording, configured_recording};
use scenecast_protocol::time::Instant;
use scenecast_worlds::{Motion, View};
use std::path::Path;
use std::sync::OnceLock;

/// The next frame of the camera.
pub(super) enum NextFrame {
    Over,
    /// The next recorded frame is due at this moment.
    DueAt(Instant),
    /// A recorded frame that is due now.
    Recorded(Box<RecordedFrame>),
    /// The simulated sea floor below the vehicle.
    Simulated(RgbImage),
}

/// The source of the camera's frames, and the recorder of them, if there is one.
pub(crate) struct Camera {
    pub(crate) world: World,
    recording: Option<Recording>,
    /// Index of the next frame of the recording.
    next: usize,
    recorder: Option<Recorder>,
    /// The truth of the survey's area, once it was needed.
    true_cells: OnceLock<TrueCells>,
}

impl Camera {
    /// Plays the configured recording, or else views `world`.
    pub(super) fn new(config: &Config, world: World, record: Option<&Path>) -> Result<Self, UserError> {
        if config.camera.source.is_live() {
            let what = "camera.source: a live camera cannot be rehearsed; allowed are frames:DIR, tum:DIR and bag:FILE";
            return Err(UserError::Input(what.to_owned()));
        }
        let recording = configured_recording(config)?;
        let recorder = record.map(Recorder::new).transpose()?;
        Ok(Self { world, recording, next: 0, recorder, true_cells: OnceLock::new() })
    }

    /// What could not be read of the recording.
    pub(super) fn recording_notes(&self) -> &[String] {
        self.recording.as_ref().map_or(&[], |recording| &recording.notes)
    }

    /// Whether the frames, and so the vehicle's path, come from a recording.
    pub(super) fn is_recorded(&self) -> bool {
        self.recording.is_some()
    }

    /// The survey's area: the configured one, or else that of the recording or of the sea floor.
    ///
    /// # Errors
    /// The configured area is outside of the sea floor.
    pub(crate) fn survey_area(&self, config: &Config) -> Result<Area, UserError> {
        let all = || self.recording.as_ref().map_or_else(|| self.world.survey_area(), Recording::area);
        let area = config.survey.area_m.unwrap_or_else(all);
        if self.recording.is_none() && !overlap(&area, &self.world.area()) {
            let a = self.world.area();
            let limits = format!("{} to {} m east, {} to {} m north", a.west, a.east, a.south, a.north);
            return Err(UserError::Input(format!("survey.area_m lies outside the sea floor, which covers {limits}")));
        }
        Ok(area)
    }

    /// The true classes of the survey's area; `None` if they are not known.
    pub(super) fn true_cells(&self, config: &Config) -> Option<&TrueCells> {
        let area = self.survey_area(config).ok().filter(|_| self.world.is_annotated())?;
        Some(self.true_cells.get_or_init(|| TrueCells::new(&self.world, &area, cell_m(config))))
    }

    /// The next frame of a vehicle with the given motion and depth.
    pub(super) fn next_frame(&mut self, config: &Config, motion: &Motion, depth_m: f64, now: Instant) -> NextFrame {
        let Some(recording) = &self.recording else {
            let Motion { x_m, y_m, heading_rad, .. } = *motion;
            let camera = &config.camera;
            let (width_px, height_px) = (camera.width_px, camera.height_px);
            let altitude_m = self.world.depth_m(config.survey.depth_m, x_m, y_m) - depth_m;
            let moment = (now.as_secs_f64() * 1000.0) as u64;
            let view = View { x_m, y_m, heading_rad, altitude_m, width_px, height_px, moment };
            return NextFrame::Simulated(self.world.view(&view));
        };
        let Some(frame) = recording.frames.get(self.next) else { return NextFrame::Over };
        let due = Instant::from_secs_f64(frame.t_s);
        if due > now {
            return NextFrame::DueAt(due);
        }
        self.next += 1;
        NextFrame::Recorded(Box::new(frame.clone()))
    }

    /// Records a frame if the mission records frames.
    pub(super) fn record(&mut self, image: &RgbImage, frame: &RecordedFrame) -> Result<(), UserError> {
        self.recorder.as_mut().map_or(Ok(()), |recorder| recorder.push(image, frame))
    }

    pub(super) fn finish_recording(&self) -> Result<(), UserError> {
        self.recorder.as_ref().map_or(Ok(()), Recorder::finish)
    }
}

fn overlap(a: &Area, b: &Area) -> bool {
    a.west < b.east && b.west < a.east && a.south < b.north && b.south < a.north
}
