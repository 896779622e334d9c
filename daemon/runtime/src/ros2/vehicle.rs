//! The vehicle's end.

use crate::equipment::LabelHealth;
use scenecast_config::Config;
use scenecast_core::UserError;
use scenecast_host::VehicleHost;
use scenecast_sensors::CameraTally;

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

    /// Hands the state over, a few times a second; `camera` is what became of the images of the camera, `labels` what
    /// became of the items of other programs.
    pub fn publish(
        &mut self,
        host: &VehicleHost,
        camera: Option<&CameraTally>,
        labels: impl FnOnce() -> Option<LabelHealth>,
    ) {
        #[cfg(feature = "ros2")]
        if let Some(on) = &mut self.on {
            on.publish(host, camera, labels);
        }
        #[cfg(not(feature = "ros2"))]
        let _ = (host, camera, labels);
    }
}

#[cfg(feature = "ros2")]
mod on {
    use crate::equipment::{LabelHealth, RecentFaults};
    use scenecast_config::Config;
    use scenecast_core::UserError;
    use scenecast_drivers::autopilot::{self, Counters};
    use scenecast_host::VehicleHost;
    use scenecast_messages::contents::Health;
    use scenecast_messages::diagnostic_msgs::DiagnosticStatus;
    use scenecast_protocol::wire::VehicleMode;
    use scenecast_ros2::{VehicleMap, VehicleOutlet, VehicleView, start_vehicle};
    use scenecast_sensors::{CameraFault, CameraTally};
    use scenecast_vehicle::Vehicle;
    use std::time::{Duration, Instant};

    /// Minimum time between two views.
    const VIEW_INTERVAL: Duration = Duration::from_millis(200);

    pub(super) struct On {
        outlet: VehicleOutlet,
        cell_m: f64,
        last: Option<Instant>,
        camera: SensorHealth,
        navigation: SensorHealth,
    }

    impl On {
        pub fn start(config: &Config) -> Result<Self, UserError> {
            let outlet = start_vehicle(&config.ros2)?;
            let cell_m = scenecast_config::cell_m(config);
            let [camera, navigation] = [(); 2].map(|()| SensorHealth::default());
            Ok(Self { outlet, cell_m, last: None, camera, navigation })
        }

        pub fn publish(
            &mut self,
            host: &VehicleHost,
            tally: Option<&CameraTally>,
            labels: impl FnOnce() -> Option<LabelHealth>,
        ) {
            if self.last.is_some_and(|last| last.elapsed() < VIEW_INTERVAL) {
                return;
            }
            let now = Instant::now();
            self.last = Some(now);
            let vehicle = host.vehicle();
            let mut health = health(vehicle).to_vec();
            health.extend(host.autopilot().map(|(state, counters)| autopilot_health(state, &counters)));
            if let Some(tally) = tally {
                let faults = |of| tally.iter().filter(move |(fault, _)| fault.is_of_navigation() == of);
                let images = format!("{} images mapped, {} dropped", tally.matched, tally.dropped());
                health.push(self.camera.part("camera", images, faults(false), now));
                health.push(self.navigation.part(
                    "navigation",
                    "the source of the poses".to_owned(),
                    faults(true),
                    now,
                ));
            }
            health.extend(labels().map(label_health));
            self.outlet.offer(view(vehicle, health, self.outlet.wants_map().then_some(self.cell_m)));
        }
    }

    /// The state, with the map if the edge of its cells is given.
    fn view(vehicle: &Vehicle, health: Vec<Health>, cell_m: Option<f64>) -> VehicleView {
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
            health,
            map_version,
            map,
        }
    }

    /// Grows with each change of the labels or of a layer.
    fn version(vehicle: &Vehicle) -> u64 {
        vehicle.map_version() + vehicle.layers().map(|layer| layer.version()).sum::<u64>()
    }

    fn autopilot_health(state: autopilot::Health, counters: &Counters) -> Health {
        let level = match state {
            autopilot::Health::InCommand => DiagnosticStatus::OK,
            autopilot::Health::NotInCommand => DiagnosticStatus::WARN,
            autopilot::Health::Awaited | autopilot::Health::Silent => DiagnosticStatus::ERROR,
        };
        let values = counters.iter().map(|(name, n)| (*name, n.to_string())).collect();
        Health { level, part: "autopilot", message: state.name().to_owned(), values }
    }

    fn label_health(labels: LabelHealth) -> Health {
        let LabelHealth { taken, refused, last_refusal, is_failing, is_missing } = labels;
        let message = match (is_missing, &last_refusal) {
            (true, _) => "a source is missing: the log has the reason".to_owned(),
            (false, Some(refusal)) if is_failing => format!("refused: {refusal}"),
            _ => format!("{taken} items taken, {refused} refused"),
        };
        let level = if is_failing { DiagnosticStatus::WARN } else { DiagnosticStatus::OK };
        let mut values = vec![("taken", taken.to_string()), ("refused", refused.to_string())];
        values.extend(last_refusal.map(|refusal| ("last_refusal", refusal)));
        Health { level, part: "labels", message, values }
    }

    /// A sensor whose faults are new for a while after each of them.
    #[derive(Default)]
    struct SensorHealth {
        recent: RecentFaults,
    }

    impl SensorHealth {
        fn part(
            &mut self,
            part: &'static str,
            message: String,
            faults: impl Iterator<Item = (CameraFault, u64)>,
            now: Instant,
        ) -> Health {
            let faults: Vec<_> = faults.collect();
            let count = faults.iter().map(|(_, n)| n).sum();
            let level = if self.recent.handle(count, now) { DiagnosticStatus::WARN } else { DiagnosticStatus::OK };
            let values = faults.into_iter().map(|(fault, n)| (fault.name(), n.to_string())).collect();
            Health { level, part, message, values }
        }
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
