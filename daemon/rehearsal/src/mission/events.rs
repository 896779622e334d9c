//! What happens in a mission, event by event.

use super::{Mission, STEP_S, SURFACE, VEHICLE, pose_of};
use crate::docked::{self, Docked};
use scenecast_core::UserError;
use scenecast_files::RecordedFrame;
use scenecast_motion::Motion;
use scenecast_protocol::directive::SlotId;
use scenecast_protocol::map::{LabelGrid, LayerReplica};
use scenecast_protocol::time::Instant;
use scenecast_surface::SurfaceOutput;
use scenecast_vehicle::VehicleOutput;
use sim_channel::{NodePosition, ReceptionOutcome};
use std::time::Duration;

impl Mission {
    pub(super) fn next_event(&self) -> Option<Instant> {
        let links = [
            self.vehicle.poll_timeout().filter(|_| self.transmitting[0].is_none()),
            self.surface.poll_timeout(self.now).filter(|_| self.transmitting[1].is_none()),
        ];
        let modems = self.docked.as_ref().and_then(Docked::poll_timeout);
        // A wake-up that has passed led to no frame: it waits for another event.
        let links = links.into_iter().flatten().map(|(at, _)| at).filter(|&at| at > self.now);
        let script = self.script.poll_timeout().filter(|_| self.ended.is_none());
        let regular = [self.times.look, self.times.step, self.times.frame];
        let fix = (self.config.navigation.fix_period_s > 0.0).then_some(self.times.fix);
        let channel = self.channel.poll_timeout().map(Instant::from);
        links
            .chain(self.transmitting.into_iter().flatten())
            .chain(regular)
            .chain(script)
            .chain(fix)
            .chain(channel)
            .chain(modems)
            .min()
    }

    pub(super) fn handle_timeouts(&mut self) -> Result<(), UserError> {
        let now = self.now;
        for (node, ends_at) in self.transmitting.into_iter().enumerate() {
            if ends_at.is_some_and(|at| at <= now) {
                self.transmitting[node] = None;
                if node == 0 {
                    self.vehicle.handle_transmit_outcome(now)
                } else {
                    self.surface.handle_transmit_outcome(now)
                }
            }
        }
        while let Some(arrival) = self.channel.poll_arrival(now.into()) {
            self.log.handle_fate(&arrival);
            if let ReceptionOutcome::Delivered { bytes, .. } = &arrival.outcome {
                if arrival.to == SURFACE {
                    self.heard_bits += self.modem.bits_on_air(bytes.len());
                }
                if arrival.to == VEHICLE {
                    self.vehicle.handle_frame(bytes, now)
                } else {
                    self.surface.handle_frame(bytes, now)
                }
            }
        }
        self.handle_modems();
        if now >= self.times.step {
            self.times.step = self.times.step + Duration::from_secs_f64(STEP_S);
            self.step();
        }
        if now >= self.times.frame {
            self.camera()?;
        }
        if now >= self.times.fix && self.config.navigation.fix_period_s > 0.0 {
            self.times.fix = self.times.fix + Duration::from_secs_f64(self.config.navigation.fix_period_s);
            self.fix();
        }
        if self.ended.is_none() {
            self.script.handle_timeout(&mut self.surface, self.address, now);
        }
        if now >= self.times.look {
            self.times.look = self.times.look + Duration::from_secs(1);
            self.tell_position();
            self.look();
        }
        Ok(())
    }

    /// Lets both ends speak and carries out what they ask for.
    pub(super) fn pump(&mut self) {
        while let Some(output) = self.vehicle.poll_output() {
            match output {
                VehicleOutput::Persist => self.vehicle.handle_persisted(),
                VehicleOutput::Waypoint(to) => {
                    let navigator = self.vehicle.navigator();
                    let from = navigator.to_world(navigator.position());
                    self.legs.push((from.xy(), navigator.to_world(to).xy()));
                    self.motion.set_target(Some(to.xy()));
                }
                VehicleOutput::Hold => self.motion.set_target(None),
                VehicleOutput::Surface => self.motion.come_up(),
                VehicleOutput::Tune(settings) => self.mapper.tune(&settings),
                VehicleOutput::Applied(applied) => {
                    if applied.id == SlotId::Fence {
                        self.legs_before_fence = self.legs.len();
                    }
                    self.applied.push(applied);
                }
                VehicleOutput::Fixed(..) => {}
            }
        }
        while let Some(output) = self.surface.poll_output() {
            self.picture_version += u64::from(matches!(output, SurfaceOutput::MapChanged(_)));
            self.events.push(output);
        }
        self.note_issued();
        if self.docked.is_some() {
            return self.speak_through_modems();
        }
        if self.transmitting[0].is_none()
            && let Some(t) = self.vehicle.poll_transmit(self.now)
        {
            self.transmit(0, t.bytes, t.kind.name());
        }
        if self.transmitting[1].is_none()
            && let Some(t) = self.surface.poll_transmit(self.now)
        {
            self.transmit(1, t.bytes, t.kind.name());
        }
    }

    fn transmit(&mut self, node: usize, bytes: Vec<u8>, kind: &'static str) {
        let airtime = self.modem.airtime(bytes.len());
        self.audits[node].record(self.modem.bits_on_air(bytes.len()), self.now);
        let from = if node == 0 { VEHICLE } else { SURFACE };
        let n = bytes.len();
        let transmission = self.channel.transmit(from, bytes, airtime, self.now.into());
        self.log.handle_sent(transmission, node == 0, n, kind, self.now.as_secs_f64());
        self.transmitting[node] = Some(self.now + airtime);
    }

    fn note_issued(&mut self) {
        let Some(view) = self.surface.view(self.address) else { return };
        for slot in view.slots() {
            self.issued.entry((slot.id, slot.version)).or_insert(slot.issued);
        }
    }

    fn step(&mut self) {
        if self.recording.is_some() || self.ended.is_some() {
            return;
        }
        if let Some(sighting) = self.anchored.poll_sighting(self.now) {
            self.surface.handle_usbl(self.address, &sighting, self.now);
        }
        self.vehicle.steer(self.now);
        self.pump();
        let o = self.motion.step(self.vehicle.navigator().position().xy(), STEP_S);
        let depth = self.motion.depth_m(self.vehicle.navigator().depth_m(), self.survey_depth_m(), STEP_S);
        self.vehicle.handle_odometry(o.dx_m, o.dy_m, o.heading_rad, depth, self.now);
        self.place_vehicle();
    }

    fn true_place(&self) -> NodePosition {
        NodePosition::new(self.motion.x_m, self.motion.y_m, self.vehicle.navigator().depth_m())
    }

    pub(super) fn place_vehicle(&mut self) {
        let place = self.true_place();
        self.channel.place(VEHICLE, place);
        if let Some(docked) = &mut self.docked {
            docked.place(docked::VEHICLE, place);
        }
    }

    fn survey_depth_m(&self) -> f64 {
        (self.config.survey.depth_m - self.config.survey.altitude_m).max(0.0)
    }

    /// Whether the sea floor is out of the camera's sight.
    fn is_high(&self) -> bool {
        self.recording.is_none() && self.vehicle.navigator().depth_m() < self.survey_depth_m() - 1.0
    }

    fn camera(&mut self) -> Result<(), UserError> {
        if self.ended.is_some() {
            self.times.frame = self.now + Duration::from_secs(3600);
            return Ok(());
        }
        if self.is_high() {
            self.times.frame = self.times.frame + Duration::from_secs_f64(1.0 / self.config.camera.rate_hz);
            return Ok(());
        }
        let (image, scale) = match &self.recording {
            Some(recording) => {
                let Some(frame) = recording.frames.get(self.next_recorded) else {
                    self.end_survey();
                    return Ok(());
                };
                if Instant::from_secs_f64(frame.t_s) > self.now {
                    self.times.frame = Instant::from_secs_f64(frame.t_s);
                    return Ok(());
                }
                self.next_recorded += 1;
                self.vehicle.set_pose(frame.x_m, frame.y_m, frame.heading_rad, frame.depth_m, self.now);
                (frame.image()?, frame.scale)
            }
            None => {
                self.times.frame = self.times.frame + Duration::from_secs_f64(1.0 / self.config.camera.rate_hz);
                let Motion { x_m, y_m, heading_rad, .. } = self.motion;
                let camera = &self.config.camera;
                (self.world.view(x_m, y_m, heading_rad, camera.width_px, camera.height_px), 1.0)
            }
        };
        self.see(&image, scale)
    }

    fn see(&mut self, image: &image::RgbImage, scale: f64) -> Result<(), UserError> {
        let t_s = self.now.as_secs_f64();
        let pose = pose_of(&self.vehicle);
        if let Some(recorder) = &mut self.recorder {
            let heading_rad = self.vehicle.navigator().heading_rad();
            let depth_m = self.vehicle.navigator().depth_m();
            let (x_m, y_m, file) = (pose.x, pose.y, Default::default());
            let frame = RecordedFrame { t_s, file, x_m, y_m, depth_m, heading_rad, scale };
            recorder.push(image, &frame)?;
        }
        if !self.mapper.takes(t_s) {
            return Ok(());
        }
        self.track.push((pose.x, pose.y));
        let update = self.mapper.handle_frame(image, &pose, scale, t_s);
        self.vehicle.handle_map(&update, self.now);
        self.vehicle.handle_exemplars(self.mapper.gallery());
        if self.vehicle.map_version() != self.map_version {
            self.map_version = self.vehicle.map_version();
            self.png_full_bytes +=
                scenecast_core::label_picture::encode(self.vehicle.map()).map_or(0, |png| png.len() as u64);
        }
        self.update = Some(update);
        Ok(())
    }

    /// The surface's head asks where the vehicle is.
    fn fix(&mut self) {
        if self.recording.is_some() || self.ended.is_some() {
            return;
        }
        let range_m = self.channel.range_m(SURFACE, VEHICLE).unwrap_or(0.0);
        let travel = Duration::from_secs_f64(range_m / self.config.channel.sound_speed_m_s);
        self.anchored.range(&self.true_place(), travel, self.now);
    }

    /// A second has passed for the surface's instruments.
    fn tell_position(&mut self) {
        let said = self.anchored.say();
        self.surface.handle_gps(said.as_bytes(), self.now);
    }

    pub(super) fn look(&mut self) {
        let Some(operator) = self.surface.map(self.address) else { return };
        let versions = (self.vehicle.map_version(), self.picture_version);
        self.meter.look(self.vehicle.map(), operator, versions, self.now);
        let (view, nothing) = (self.surface.view(self.address), LabelGrid::default());
        for layer in self.vehicle.layers() {
            let kind = layer.scale().kind();
            let heard = view.and_then(|v| v.layer(kind));
            let versions = (layer.version(), heard.map_or(0, LayerReplica::version));
            let meter = self.layer_meters.entry(kind).or_default();
            meter.look(layer.target(), heard.map_or(&nothing, |h| h.levels().shown()), versions, self.now);
        }
    }
}
