//! Targets that go out, and what the autopilot reports about them.

use super::echo::Report;
use super::message::Said;
use super::{BRIDGED, Mavlink, Pose, moved, units};
use scenecast_core::{LatLon, TangentPlane};
use scenecast_protocol::time::Instant;

/// The last target that was sent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Sent {
    /// North and east in the autopilot's own frame, metres.
    Local(f64, f64),
    Global(LatLon),
}

fn degrees((lat, lon): (i32, i32)) -> LatLon {
    LatLon { lat_deg: f64::from(lat) / 1e7, lon_deg: f64::from(lon) / 1e7 }
}

impl Sent {
    /// Metres east and north from the autopilot's position to the target.
    fn way(self, pose: &Pose) -> Option<(f64, f64)> {
        match self {
            Self::Local(north, east) => {
                pose.local.map(|[at_north, at_east, _]| (east - f64::from(at_east), north - f64::from(at_north)))
            }
            Self::Global(place) => pose.place.map(|at| TangentPlane::new(degrees(at)).to_plane(place)),
        }
    }
}

impl Mavlink {
    pub(super) fn send_target(&mut self, now: Instant) {
        let Some(pose) = self.pose.filter(|p| now.since(p.heard) < BRIDGED) else { return };
        // Depths of targets count from the autopilot's own zero. While that is in doubt, the last target stays.
        let Some(zero_m) = self.tray.depth_zero_m() else { return };
        match (pose.local, self.goal) {
            (Some(at), Some(goal)) => {
                let down = goal.depth_m.map_or(at[2], |d| (d + zero_m) as f32);
                self.stay = None;
                self.send_local([at[0] + goal.north_m as f32, at[1] + goal.east_m as f32, down], now);
            }
            (Some(at), None) => {
                let stay = *self.stay.get_or_insert(at);
                self.send_local(stay, now);
            }
            (None, goal) => {
                let Some(at) = pose.place else { return };
                let (east, north) = goal.map_or((0.0, 0.0), |g| (g.east_m, g.north_m));
                let depth = goal.and_then(|g| g.depth_m).map_or(pose.depth_m, |d| d + zero_m);
                let place = moved(degrees(at), east, north);
                self.sent = Some(Sent::Global(place));
                let (lat, lon) = units(place);
                self.say(&Said::Global(lat, lon, -depth as f32), now);
            }
        }
        self.tray.count("targets");
        self.echo.handle_target(now);
    }

    fn send_local(&mut self, place: [f32; 3], now: Instant) {
        self.sent = Some(Sent::Local(f64::from(place[0]), f64::from(place[1])));
        self.say(&Said::Local(place), now);
    }

    /// The autopilot's target in its own frame: north and east.
    pub(super) fn handle_local_target(&mut self, told: Option<[f32; 2]>, now: Instant) {
        let Some(Sent::Local(north, east)) = self.sent else { return };
        let off =
            |[told_north, told_east]: [f32; 2]| (f64::from(told_north) - north).hypot(f64::from(told_east) - east);
        self.handle_report(Report::Target(told.map(off)), now);
    }

    pub(super) fn handle_global_target(&mut self, told: Option<(i32, i32)>, now: Instant) {
        let Some((at, (east, north))) = self.pose.and_then(|pose| pose.place.zip(self.sent?.way(&pose))) else {
            return;
        };
        let plane = TangentPlane::new(degrees(at));
        let off = |told| {
            let (told_east, told_north) = plane.to_plane(degrees(told));
            (told_east - east).hypot(told_north - north)
        };
        self.handle_report(Report::Target(told.map(off)), now);
    }

    pub(super) fn handle_distance(&mut self, told_m: u16, now: Instant) {
        let Some((east, north)) = self.pose.and_then(|pose| self.sent?.way(&pose)) else { return };
        self.handle_report(Report::Distance { told_m: f64::from(told_m), given_m: east.hypot(north) }, now);
    }

    fn handle_report(&mut self, report: Report, now: Instant) {
        if let Some(note) = self.echo.handle_report(report, now) {
            self.tray.note(note);
        }
    }
}
