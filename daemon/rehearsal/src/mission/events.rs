//! The events of a mission, in the order of their handling.

use super::Mission;
use super::camera::NextFrame;
use super::logbook::{EndEvent, FramePoses, STEP_S};
use crate::modem_rig::{SURFACE, VEHICLE};
use scene_model::project::{Pose, View};
use scenecast_core::UserError;
use scenecast_files::{FrameImage, RecordedFrame};
use scenecast_host::{CameraPose, FrameEvent, SurfaceHostEvent, VehicleHostEvent};
use scenecast_protocol::time::Instant;
use scenecast_registration::CameraFinding;
use scenecast_surface::SurfaceOutput;
use scenecast_vehicle::Frame;
use sim_channel::NodePosition;
use std::time::Duration;

/// After the survey the next frame of the camera is due so late that none is taken.
const NO_FRAME: Duration = Duration::from_secs(3600);

impl Mission {
    pub(super) fn next_event(&self) -> Instant {
        let now = self.times.now;
        let hosts = [self.vehicle.poll_timeout(now), self.surface.poll_timeout(now)];
        let script = self.script.poll_timeout().filter(|_| self.times.ended.is_none());
        let others = hosts.into_iter().chain([script, self.carrier.poll_timeout()]).flatten();
        others.chain(self.labels_due()).chain([self.times.next_event()]).min().unwrap_or(now)
    }

    pub(super) fn handle_timeouts(&mut self) -> Result<(), UserError> {
        let now = self.times.now;
        self.carrier.deliver(self.vehicle.link_mut(), self.surface.link_mut(), now);
        if self.times.takes_step() {
            self.step();
        }
        if now >= self.times.frame {
            self.take_frame()?;
        }
        self.handle_labels();
        if self.times.takes_fix() {
            self.fix();
        }
        if self.times.ended.is_none() {
            self.script.handle_timeout(self.surface.surface_mut(), self.address, now);
        }
        if self.times.takes_look() {
            let sentences = self.anchored.report();
            self.surface.handle_gps(sentences.as_bytes(), now);
            self.look();
        }
        Ok(())
    }

    /// Acts on the hosts' events and carries their bytes.
    pub(super) fn pump(&mut self) {
        self.handle_host_events();
        if let Some(view) = self.surface.surface().view(self.address) {
            self.logbook.note_issued(&view);
        }
        let now = self.times.now;
        self.carrier.write(VEHICLE, || self.vehicle.poll_output(now), now);
        self.carrier.write(SURFACE, || self.surface.poll_output(now), now);
        self.handle_host_events();
    }

    fn handle_host_events(&mut self) {
        while let Some(event) = self.vehicle.poll_event() {
            self.handle_vehicle_event(event);
        }
        while let Some(event) = self.surface.poll_event() {
            match event {
                SurfaceHostEvent::Role(output) => {
                    if matches!(output, SurfaceOutput::MapChanged(_)) {
                        self.meters.note_operator_change();
                    }
                    self.logbook.outputs.push(output);
                }
                SurfaceHostEvent::Frame(event) => {
                    if let FrameEvent::Received { frame, .. } = &event {
                        self.logbook.received_bits += self.surface.link().profile().bits_on_air(frame.len());
                    }
                    self.carrier.log_event(SURFACE, &event, self.times.now);
                    self.logbook.note_event(|| EndEvent::Surface(event), self.times.now);
                }
                SurfaceHostEvent::Following(..) | SurfaceHostEvent::Pilot(_) => {}
            }
        }
    }

    fn handle_vehicle_event(&mut self, event: VehicleHostEvent) {
        self.logbook.note_event(|| EndEvent::Vehicle(event.clone()), self.times.now);
        match event {
            VehicleHostEvent::Persist => self.vehicle.handle_persisted(),
            VehicleHostEvent::Waypoint(to) => {
                self.logbook.note_waypoint(self.vehicle.vehicle(), to);
                self.motion.set_target(Some(to.xy()));
            }
            VehicleHostEvent::Hold => self.motion.set_target(None),
            VehicleHostEvent::Surface => self.motion.come_up(),
            VehicleHostEvent::Tune(settings) => self.mapper.tune(&settings),
            VehicleHostEvent::Applied(applied) => self.logbook.note_applied(applied),
            VehicleHostEvent::Frame(event) => self.carrier.log_event(VEHICLE, &event, self.times.now),
            VehicleHostEvent::Fixed(..)
            | VehicleHostEvent::SurveyEnded
            | VehicleHostEvent::Pilot(_)
            | VehicleHostEvent::Note(_) => {}
        }
    }

    fn step(&mut self) {
        let now = self.times.now;
        if self.camera.is_recorded() || self.times.ended.is_some() {
            return;
        }
        if let Some(sighting) = self.anchored.poll_sighting(now) {
            self.surface.handle_usbl(self.address, &sighting, now);
        }
        self.vehicle.steer(now);
        self.pump();
        let navigator = self.vehicle.vehicle().navigator();
        let o = self.motion.step(navigator.position().xy(), STEP_S);
        let depth = self.motion.depth_m(navigator.depth_m(), self.survey_depth_m(), STEP_S);
        self.vehicle.handle_odometry(o.dx_m, o.dy_m, o.heading_rad, depth, now);
        self.place_vehicle();
    }

    fn true_place(&self) -> NodePosition {
        NodePosition::new(self.motion.x_m, self.motion.y_m, self.vehicle.vehicle().navigator().depth_m())
    }

    pub(super) fn place_vehicle(&mut self) {
        let place = self.true_place();
        self.carrier.place(VEHICLE, place);
    }

    /// The depth at which the vehicle keeps its altitude here.
    fn survey_depth_m(&self) -> f64 {
        let floor_m = self.camera.world.depth_m(self.config.survey.depth_m, self.motion.x_m, self.motion.y_m);
        (floor_m - self.config.survey.altitude_m).max(0.0)
    }

    /// Whether the vehicle comes up, or the sea floor is out of the camera's geometry.
    fn is_high(&self) -> bool {
        let depth_m = self.vehicle.vehicle().navigator().depth_m();
        !self.camera.is_recorded() && (self.motion.is_rising() || depth_m < self.survey_depth_m() - 1.0)
    }

    fn take_frame(&mut self) -> Result<(), UserError> {
        let now = self.times.now;
        let interval = Duration::from_secs_f64(1.0 / self.config.camera.rate_hz);
        if self.times.ended.is_some() {
            self.times.frame = now + NO_FRAME;
            return Ok(());
        }
        if self.is_high() {
            self.times.frame = self.times.frame + interval;
            return Ok(());
        }
        let depth_m = self.vehicle.vehicle().navigator().depth_m();
        match self.camera.next_frame(&self.config, &self.motion, depth_m, now) {
            NextFrame::Over => self.end_survey(),
            NextFrame::DueAt(at) => self.times.frame = at,
            NextFrame::Recorded(frame) => {
                let RecordedFrame { x_m, y_m, heading_rad, depth_m, .. } = *frame;
                self.vehicle.handle_pose(CameraPose { x_m, y_m, heading_rad, depth_m }, now);
                let (image, view) = match frame.read() {
                    Ok(read) => read,
                    Err(error) => {
                        self.logbook.unreadable.get_or_insert((0, error.to_string())).0 += 1;
                        return Ok(());
                    }
                };
                self.map(&image, frame.scale, view.as_ref())?;
            }
            NextFrame::Simulated(image) => {
                self.times.frame = self.times.frame + interval;
                self.map(&image, 1.0, None)?;
            }
        }
        Ok(())
    }

    /// Records a frame and gives it to the mapper, at the pose that the vehicle estimates.
    fn map(&mut self, image: &image::RgbImage, scale: f64, view: Option<&View>) -> Result<(), UserError> {
        if self.has_foreign_labels() {
            return Ok(());
        }
        let now = self.times.now;
        let t_s = now.as_secs_f64();
        let navigator = self.vehicle.vehicle().navigator();
        let ((x_m, y_m), depth_m, heading_rad) =
            (navigator.dead_reckoned().xy(), navigator.depth_m(), navigator.heading_rad());
        let shot = FrameImage::File(Default::default());
        let (geometry, depth) = (None, None);
        let recorded = RecordedFrame { t_s, image: shot, x_m, y_m, depth_m, heading_rad, scale, geometry, depth };
        self.camera.record(image, &recorded)?;
        if !self.mapper.takes(t_s) {
            return Ok(());
        }
        let pose = Pose { x: x_m, y: y_m, z: -depth_m, yaw_rad: -heading_rad };
        let frame = Frame { image, pose, scale, view };
        let placed = self.mapper.register(&frame);
        if let Some(CameraFinding::Wrong(advice)) = self.mapper.poll_camera_finding() {
            self.logbook.camera_advice = Some(advice);
        }
        self.vehicle.handle_registration(&placed, now);
        if let Some(found) = &placed.found {
            self.logbook.graph.add(&found.placed);
        }
        self.logbook.track.push(self.vehicle.vehicle().navigator().position().xy());
        self.logbook.poses.push(FramePoses {
            true_at: (self.motion.x_m, self.motion.y_m),
            mapped_at: (placed.pose.x, placed.pose.y),
        });
        let changes = self.mapper.handle_frame(&frame.placed(&placed), t_s);
        self.vehicle.handle_changes(&changes, now);
        self.vehicle.handle_exemplars(self.mapper.shared_exemplars(), now);
        self.logbook.map.note_changes(self.vehicle.vehicle(), &changes, now);
        Ok(())
    }

    /// The surface's USBL head measures the vehicle's position.
    fn fix(&mut self) {
        if self.camera.is_recorded() || self.times.ended.is_some() {
            return;
        }
        let travel = Duration::from_secs_f64(self.carrier.range_m() / self.config.channel.sound_speed_m_s);
        self.anchored.range(&self.true_place(), travel, self.times.now);
    }

    pub(super) fn look(&mut self) {
        self.meters.look(self.vehicle.vehicle(), self.surface.surface(), self.address, self.times.now);
        self.sample_quality();
    }
}
