//! Pose, path, plan and position of one vehicle.

use super::stamps::Stamps;
use crate::node::{Publisher, RosNode};
use crate::transport::Qos;
use scenecast_console::state::{MissionState, StatusReport, VehicleState};
use scenecast_core::{LatLon, TangentPlane, UserError};
use scenecast_messages::geometry_msgs::PoseWithCovarianceStamped;
use scenecast_messages::nav_msgs::Path;
use scenecast_messages::sensor_msgs::NavSatFix;
use scenecast_outlets::{Place, WORLD_FRAME, fix, header, path, pose};

/// What depends on the last report of a vehicle.
pub(super) struct StateTopics {
    pose: Publisher<PoseWithCovarianceStamped>,
    path: Publisher<Path>,
    plan: Publisher<Path>,
    fix: Publisher<NavSatFix>,
    /// The mission time of the report that was published last.
    last_s: Option<f64>,
}

impl StateTopics {
    pub fn new(node: &RosNode, part: &str) -> Result<Self, UserError> {
        let topic = |name: &str| node.own_topic(&format!("{part}/{name}"));
        Ok(Self {
            pose: node.publisher(&topic("pose")?, Qos::Reliable(10))?,
            path: node.publisher(&topic("path")?, Qos::Reliable(1))?,
            plan: node.publisher(&topic("plan")?, Qos::Reliable(1))?,
            fix: node.publisher(&topic("fix")?, Qos::Reliable(10))?,
            last_s: None,
        })
    }

    /// Publishes each report once, in the world frame, for those who subscribe.
    pub fn publish(&mut self, mission: &MissionState, vehicle: &VehicleState, stamps: &Stamps) {
        let Some(status) = vehicle.status.as_ref().filter(|status| self.last_s != Some(status.at_s)) else { return };
        self.last_s = Some(status.at_s);
        let stamp = stamps.at(status.at_s);
        let shift = vehicle.map.placement.as_ref().map_or((0.0, 0.0), |p| (p.east_m, p.north_m));
        let place = place(status, shift, stamps);
        if self.pose.subscribers() > 0 {
            self.pose.publish(pose(&place, status.pose.sigma_m, WORLD_FRAME));
        }
        let at = |s: f64, (east, north): (f64, f64)| Place {
            stamp: stamps.at(s),
            position_m: [east + shift.0, north + shift.1, place.position_m[2]],
            heading_rad: 0.0,
        };
        if self.path.subscribers() > 0 {
            let track: Vec<Place> = vehicle.track.iter().map(|&(s, east, north)| at(s, (east, north))).collect();
            self.path.publish(path(&track, header(stamp.clone(), WORLD_FRAME)));
        }
        if self.plan.subscribers() > 0 {
            let waypoints = status.plan.waypoint.iter().chain(&status.plan.path);
            let plan: Vec<Place> = waypoints.map(|&waypoint| at(status.at_s, waypoint)).collect();
            self.plan.publish(path(&plan, header(stamp.clone(), WORLD_FRAME)));
        }
        let origin = mission.mission.origin.and_then(|o| LatLon::new(o.lat_deg, o.lon_deg));
        if let Some(origin) = origin.filter(|_| self.fix.subscribers() > 0) {
            let [east, north, _] = place.position_m;
            let on_earth = TangentPlane::new(origin).to_place(east, north);
            self.fix.publish(fix(on_earth, status.pose.sigma_m, header(stamp, WORLD_FRAME)));
        }
    }
}

fn place(status: &StatusReport, shift_m: (f64, f64), stamps: &Stamps) -> Place {
    let pose = &status.pose;
    Place {
        stamp: stamps.at(status.at_s),
        position_m: [pose.x_m + shift_m.0, pose.y_m + shift_m.1, pose.z_m],
        heading_rad: pose.heading_deg.to_radians(),
    }
}
