//! Places camera frames by the images, or by odometry and compass, and finds whether the camera is as configured.

use scenecast_config::Config;
use scenecast_registration::{CameraFinding, FrameInput, GeometryCheck, Placed, Registrar, Tally};

/// Standard deviation of the position after a gap in dead reckoning, metres.
const GAP_SIGMA_M: f64 = 3.0;

/// A frame's place by the registration.
#[derive(Debug, Clone, PartialEq)]
pub struct FoundFrame {
    pub placed: Placed,
    /// Frames that closed a loop since the mission's start.
    pub closed: u32,
    /// Whether images place frames; otherwise the registration was switched off.
    pub is_on: bool,
}

/// Places camera frames by the images, or by odometry and compass.
pub(super) struct FramePlacer {
    /// `None` as long as no frame was to be placed by images.
    registrar: Option<Registrar>,
    /// Whether images place the frames; otherwise odometry and compass do.
    is_on: bool,
    /// Whether the camera is as configured, by the next frames; `None` unless that is asked, and once it was told.
    geometry: Option<GeometryCheck>,
    is_configured: bool,
    /// A registration that has placed no frame.
    fresh: Registrar,
}

impl FramePlacer {
    pub(super) fn new(config: &Config) -> Self {
        let fresh = Registrar::new(config.navigation.drift_percent / 100.0).with_loops(config.registration.loops);
        let is_on = config.registration.enabled;
        Self { registrar: is_on.then(|| fresh.clone()), is_on, geometry: None, is_configured: is_on, fresh }
    }

    /// Switches the registration on or off; `None`: as configured.
    pub(super) fn switch(&mut self, is_on: Option<bool>) {
        self.is_on = is_on.unwrap_or(self.is_configured);
        if self.is_on {
            self.registrar.get_or_insert_with(|| self.fresh.clone());
        }
    }

    /// The state of the registration as bytes, if there is one.
    pub(super) fn save(&self) -> Option<Vec<u8>> {
        self.registrar.as_ref().map(Registrar::save)
    }

    /// Continues a registration of a checkpoint, if it has one.
    pub(super) fn restore(&mut self, kept: Option<Registrar>) {
        self.registrar = kept.or(self.registrar.take());
    }

    /// `None` as long as no frame was to be placed by images.
    pub(super) fn place(&mut self, input: &FrameInput<'_>) -> Option<FoundFrame> {
        let registrar = self.registrar.as_mut()?;
        if let Some(geometry) = &mut self.geometry {
            geometry.handle_frame(input);
        }
        let placed = if self.is_on { registrar.handle_frame(input) } else { registrar.handle_unmatched_frame(input) };
        Some(FoundFrame { closed: registrar.tally().looped, is_on: self.is_on, placed })
    }

    pub(super) fn handle_gap(&mut self) {
        self.registrar.iter_mut().for_each(|registrar| registrar.handle_gap(GAP_SIGMA_M));
    }

    /// The finding, once the first frames and odometry have shown it.
    pub(super) fn poll_finding(&mut self, metres_per_pixel: f64) -> Option<CameraFinding> {
        let geometry = self.geometry.as_mut()?;
        let finding = geometry.poll_finding(metres_per_pixel);
        self.geometry.take_if(|geometry| geometry.is_complete());
        finding
    }

    /// The next frames are to show whether the camera is as configured.
    pub(super) fn check_camera(&mut self) {
        self.geometry = Some(GeometryCheck::default());
    }

    /// The finding by all frames so far, if they have shown it and it was not told.
    pub(super) fn last_finding(&self, metres_per_pixel: f64) -> Option<CameraFinding> {
        Some(self.geometry.as_ref()?.geometry()?.finding(metres_per_pixel))
    }

    pub(super) fn tally(&self) -> Option<Tally> {
        self.registrar.as_ref().map(Registrar::tally)
    }
}
