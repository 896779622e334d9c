//! The camera of a rehearsal: a view of the simulated sea floor, or a recording.

use crate::world::World;
use image::RgbImage;
use scenecast_config::{CameraSource, Config};
use scenecast_core::{Area, UserError};
use scenecast_files::{RecordedFrame, Recorder, Recording};
use scenecast_motion::Motion;
use scenecast_protocol::time::Instant;
use std::path::Path;

/// The next frame of the camera.
pub(super) enum NextFrame {
    /// The recording has ended.
    Over,
    /// The next recorded frame is due at this moment.
    DueAt(Instant),
    /// A recorded frame that is due now.
    Recorded(RecordedFrame),
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
}

impl Camera {
    /// Plays the configured recording, or else looks at `world`.
    pub(super) fn new(config: &Config, world: World, record: Option<&Path>) -> Result<Self, UserError> {
        let recording = match &config.camera.source {
            CameraSource::Rehearsal => None,
            CameraSource::Frames(dir) => Some(Recording::open(dir, config.camera.metres_per_pixel)?),
        };
        Ok(Self { world, recording, next: 0, recorder: record.map(Recorder::new).transpose()? })
    }

    /// Whether the frames are recorded ones: then the vehicle's path is recorded, too.
    pub(super) fn is_recorded(&self) -> bool {
        self.recording.is_some()
    }

    /// The survey's area: the configured one, or all that there is to see.
    ///
    /// # Errors
    /// A configured area outside of the image.
    pub(super) fn survey_area(&self, config: &Config) -> Result<Area, UserError> {
        let all = || self.recording.as_ref().map_or_else(|| self.world.area(), Recording::area);
        let area = config.survey.area_m.unwrap_or_else(all);
        if self.recording.is_none() && !overlap(&area, &self.world.area()) {
            let a = self.world.area();
            let limits = format!("{} to {} m east, {} to {} m north", a.west, a.east, a.south, a.north);
            return Err(UserError::Input(format!("survey.area_m lies outside the image, which covers {limits}")));
        }
        Ok(area)
    }

    pub(super) fn next_frame(&mut self, config: &Config, motion: &Motion, now: Instant) -> NextFrame {
        let Some(recording) = &self.recording else {
            let Motion { x_m, y_m, heading_rad, .. } = *motion;
            let camera = &config.camera;
            return NextFrame::Simulated(self.world.view(x_m, y_m, heading_rad, camera.width_px, camera.height_px));
        };
        let Some(frame) = recording.frames.get(self.next) else { return NextFrame::Over };
        let due = Instant::from_secs_f64(frame.t_s);
        if due > now {
            return NextFrame::DueAt(due);
        }
        self.next += 1;
        NextFrame::Recorded(frame.clone())
    }

    /// Records a frame, if frames are to be recorded.
    pub(super) fn record(&mut self, image: &RgbImage, frame: &RecordedFrame) -> Result<(), UserError> {
        self.recorder.as_mut().map_or(Ok(()), |recorder| recorder.push(image, frame))
    }

    /// Completes the recording.
    pub(super) fn finish_recording(&self) -> Result<(), UserError> {
        self.recorder.as_ref().map_or(Ok(()), Recorder::finish)
    }
}

fn overlap(a: &Area, b: &Area) -> bool {
    a.west < b.east && b.west < a.east && a.south < b.north && b.south < a.north
}
