//! The vehicle's end.

use scenecast_config::Config;
use scenecast_core::UserError;
use scenecast_host::VehicleHost;

/// ROS 2 on the vehicle, if it is switched on.
pub(crate) struct VehicleRos2 {
    #[cfg(feature = "ros2")]
    on: Option<on::On>,
}

impl VehicleRos2 {
    /// # Errors
    ///
    /// The thread does not start, or the build has no ROS 2.
    pub fn start(config: &Config) -> Result<Self, UserError> {
        let is_enabled = super::is_enabled(config)?;
        #[cfg(not(feature = "ros2"))]
        let _ = is_enabled;
        Ok(Self {
            #[cfg(feature = "ros2")]
            on: is_enabled.then(|| on::On::start(config)).transpose()?,
        })
    }

    /// Hands the state over, a few times a second.
    pub fn publish(&mut self, host: &VehicleHost) {
        #[cfg(feature = "ros2")]
        if let Some(on) = &mut self.on {
            on.publish(host.vehicle());
        }
        #[cfg(not(feature = "ros2"))]
        let _ = host;
    }
}

#[cfg(feature = "ros2")]
mod on {
    use scenecast_config::Config;
    use scenecast_core::UserError;
    use scenecast_messages::diagnostic_msgs::DiagnosticStatus;
    use scenecast_outlets::Health;
    use scenecast_protocol::wire::VehicleMode;
    use scenecast_ros2::{VehicleMap, VehicleOutlet, VehicleView, start_vehicle};
    use scenecast_vehicle::Vehicle;
    use std::time::{Duration, Instant};

    /// Minimum time between two views.
    const VIEW_INTERVAL: Duration = Duration::from_millis(200);

    pub(super) struct On {
        outlet: VehicleOutlet,
        cell_m: f64,
        last: Option<Instant>,
    }

    impl On {
        pub fn start(config: &Config) -> Result<Self, UserError> {
            let outlet = start_vehicle(&config.ros2)?;
            Ok(Self { outlet, cell_m: scenecast_config::cell_m(config), last: None })
        }

        pub fn publish(&mut self, vehicle: &Vehicle) {
            if self.last.is_some_and(|last| last.elapsed() < VIEW_INTERVAL) {
                return;
            }
            self.last = Some(Instant::now());
            self.outlet.offer(view(vehicle, self.outlet.wants_map().then_some(self.cell_m)));
        }
    }

    /// The state, with the map if the edge of its cells is given.
    fn view(vehicle: &Vehicle, cell_m: Option<f64>) -> VehicleView {
        let navigator = vehicle.navigator();
        let at = navigator.position();
        let plan = vehicle.waypoint().into_iter().chain(vehicle.path().points.iter().copied());
        let map_version = version(vehicle);
        let map = cell_m.map(|cell_m| VehicleMap {
            version: map_version,
            cell_m,
            labels: vehicle.map().clone(),
            layers: vehicle.layers().map(|l| (l.descriptor().clone(), l.target().clone())).collect(),
        });
        VehicleView {
            position_m: [at.x_m, at.y_m, -navigator.depth_m()],
            heading_rad: navigator.heading_rad(),
            sigma_m: navigator.sigma_m(),
            plan: plan.map(|p| [p.x_m, p.y_m]).collect(),
            health: health(vehicle).into(),
            map_version,
            map,
        }
    }

    /// Grows with each change of the labels or of a layer.
    fn version(vehicle: &Vehicle) -> u64 {
        vehicle.map_version() + vehicle.layers().map(|layer| layer.version()).sum::<u64>()
    }

    fn health(vehicle: &Vehicle) -> [Health; 2] {
        let (mode, reason) = vehicle.mode();
        let (is_refused, refusals) = vehicle.disk_refusals();
        let is_unusual = matches!(mode, VehicleMode::Abort | VehicleMode::Surface | VehicleMode::Return);
        let message = match reason.name() {
            Some(reason) => format!("{mode:?}: {reason}"),
            None => format!("{mode:?}"),
        };
        let level = match (is_refused, is_unusual) {
            (true, _) => DiagnosticStatus::ERROR,
            (false, true) => DiagnosticStatus::WARN,
            (false, false) => DiagnosticStatus::OK,
        };
        let navigator = vehicle.navigator();
        let values = vec![
            ("sigma_m", format!("{:.2}", navigator.sigma_m())),
            ("depth_m", format!("{:.2}", navigator.depth_m())),
            ("fixes", vehicle.fixes_applied().to_string()),
            ("disk_refusals", refusals.to_string()),
        ];
        let state = Health { level, part: "vehicle", message, values };
        let stats = vehicle.stats();
        let values = vec![
            ("budget_bps", vehicle.budget_bps().to_string()),
            ("frames_sent", stats.frames_sent.to_string()),
            ("frames_received", stats.frames_received.to_string()),
            ("frames_lost", stats.frames_lost.to_string()),
            ("frames_dropped", stats.dropped.values().sum::<u64>().to_string()),
        ];
        let message = match vehicle.is_converged() {
            true => "the surface has everything",
            false => "data waits",
        };
        let link = Health { level: DiagnosticStatus::OK, part: "link", message: message.to_owned(), values };
        [state, link]
    }
}
