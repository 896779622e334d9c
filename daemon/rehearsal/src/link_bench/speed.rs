//! The speed of the link's code on one core of this machine.

use super::bench::{BenchVehicle, LinkBench, LinkSetting, auv, surface};
use super::opaque::OpaqueReplica;
use crate::virtual_time::VirtualTime;
use scenecast_host::LinkHost;
use scenecast_protocol::link::SurfaceLink;
use scenecast_protocol::mac::ModemProfile;
use scenecast_protocol::time::Instant;
use sim_channel::LossModel;
use std::collections::BTreeMap;
use std::time::Duration;

/// Bytes that always wait at the vehicle under load.
const LOAD: usize = 20_000;

/// Measurements of one run on this machine; they differ from run to run.
#[derive(Debug, Clone, Copy)]
pub struct Speed {
    /// Frames sent and received a second, both ends on one core, 64 bytes each.
    pub small_frames_per_s: f64,
    pub frames_per_s: f64,
    /// Seconds that an hour of virtual time under load takes with 64-byte frames, the simulated channel included.
    pub hour_s: f64,
}

/// Measures this machine for some seconds.
pub fn measure_speed() -> Speed {
    let setting = LinkSetting::new(1000.0, 64, LossModel::Independent { probability: 0.1 });
    let mut bench = LinkBench::under_load(&setting, 1);
    let began = std::time::Instant::now();
    bench.run(Duration::from_secs(3600));
    let hour_s = began.elapsed().as_secs_f64();
    Speed { small_frames_per_s: frames_per_s(64), frames_per_s: frames_per_s(256), hour_s }
}

fn frames_per_s(frame_bytes: usize) -> f64 {
    let mut wire = Wire::new(frame_bytes);
    wire.run(Duration::from_secs(120));
    let (frames, began) = (wire.frames, std::time::Instant::now());
    while began.elapsed() < Duration::from_secs(1) {
        wire.run(Duration::from_secs(60));
    }
    (wire.frames - frames) as f64 / began.elapsed().as_secs_f64()
}

/// Two ends under load; a frame arrives at the end of its airtime.
struct Wire {
    now: Instant,
    surface: LinkHost<SurfaceLink<OpaqueReplica>>,
    vehicle: BenchVehicle,
    modem: ModemProfile,
    /// Frames on air, by their end and whether the surface sent them.
    on_air: BTreeMap<(Instant, bool), Vec<u8>>,
    frames: u64,
}

impl Wire {
    fn new(frame_bytes: usize) -> Self {
        let setting = LinkSetting::new(0.0, frame_bytes, LossModel::None);
        let now = Instant::ZERO;
        let mut vehicle = BenchVehicle::new(&setting, auv(), 1, now);
        vehicle.load = Some(LOAD);
        let surface = surface(&setting, 2, now);
        Self { now, surface, vehicle, modem: setting.modem(), on_air: BTreeMap::new(), frames: 0 }
    }

    fn run(&mut self, duration: Duration) {
        let until = self.now + duration;
        while self.now < until {
            self.pump();
            self.now = self.next_event();
            self.handle_frames();
        }
    }

    fn pump(&mut self) {
        while self.surface.end_mut().poll_event().is_some() {}
        while let Some(bytes) = self.surface.poll_output(self.now) {
            self.put_on_air(true, bytes);
        }
        self.vehicle.handle_news(self.now);
        while let Some(bytes) = self.vehicle.host.poll_output(self.now) {
            self.put_on_air(false, bytes);
        }
        while self.surface.poll_event().is_some() || self.vehicle.host.poll_event().is_some() {}
    }

    fn put_on_air(&mut self, by_surface: bool, bytes: Vec<u8>) {
        self.frames += 1;
        self.on_air.insert((self.now + self.modem.airtime(bytes.len()), by_surface), bytes);
    }

    fn next_event(&self) -> Instant {
        let hosts = [self.vehicle.host.poll_timeout(self.now), self.surface.poll_timeout(self.now)];
        hosts.into_iter().flatten().min().unwrap_or(self.now + Duration::from_millis(200))
    }

    fn handle_frames(&mut self) {
        self.surface.handle_timeout(self.now);
        self.vehicle.host.handle_timeout(self.now);
        while let Some(entry) = self.on_air.first_entry().filter(|e| e.key().0 <= self.now) {
            let ((_, by_surface), bytes) = entry.remove_entry();
            match by_surface {
                true => self.vehicle.host.handle_bytes(&bytes, self.now),
                false => self.surface.handle_bytes(&bytes, self.now),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_on_a_wire_use_nearly_all_of_its_capacity() {
        let mut wire = Wire::new(256);
        wire.run(Duration::from_secs(600));
        let share = wire.frames as f64 * 256.0 * 8.0 / 10_000.0 / 600.0;
        assert!((0.8..1.2).contains(&share), "{share}");
        assert!(wire.surface.end().vehicle(auv()).is_some_and(|v| v.replica().useful_bytes() > 400_000.0));
    }
}
