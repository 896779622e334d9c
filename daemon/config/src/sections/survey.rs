//! The survey, the vehicle's navigation, autopilots and the localisation relay.

use super::key::section;
use crate::rule::{ANY, ports, range};
use crate::setting::{AutopilotKind, GpsPort, LegDirection, NavigationSource, StartMode};
use scenecast_core::{Area, PortAddress};
use scenecast_protocol::directive::{AtEnd, PlannerKind, Reaction};
use std::path::PathBuf;

section! {
    /// The survey.
    survey: Survey {
        /// Mission time at which the survey ends. 0: never.
        duration_s: f64 = 1200.0, range(0.0, 1e7, "s"), [Auv Scenario];
        /// Speed over ground. At the surface, this key and the others of the survey and of the camera are for dry runs only: the
        /// vehicle does not tell them.
        speed_m_s: f64 = 0.5, range(0.01, 10.0, "m/s"), [Auv Asv Scenario];
        /// Height of the camera above the sea floor.
        altitude_m: f64 = 4.0, range(0.1, 100.0, "m"), [Auv Scenario];
        /// Depth of the sea floor.
        depth_m: f64 = 20.0, range(0.0, 11_000.0, "m"), [Auv Scenario];
        /// West, south, east and north limits in the world. All 0: the limits of the recording
        /// or of the rehearsal's mosaic; of the world "reef", 30 x 25 m in its middle; for a dry run of the surface, those of the
        /// fence or of the map.
        area_m: Option<Area> = None, range(-1e6, 1e6, "m"), [Auv Asv Scenario];
        /// Least overlap of camera frames on neighbouring legs, in percent of a frame's width across the track. Registration
        /// needs 10 % of overlap to close loops between legs. Legs are never further apart than nine tenths of a frame's
        /// shorter side, so that 30 % changes nothing for a frame of 4:3, and brings the legs of a square one closer.
        leg_overlap_percent: f64 = 30.0, range(0.0, 90.0, "%"), [Auv Asv Scenario];
        /// Direction of the straight legs. shortest: the one in which a pass takes less, by the area, the fence and the areas to stay
        /// out of; east-west and north-south, as a current or a slope may ask for.
        legs: LegDirection = LegDirection::Shortest, ANY, [Auv Asv Scenario];
        /// File of a fence for a vehicle that has no orders from before its start: GeoJSON, as scenecast ctl fence set takes
        /// it. Empty: none.
        fence_file: Option<PathBuf> = None, ANY, [Auv];
        /// What a vehicle does that has no orders from before its start, and no survey.fence_file. hold: it holds until the
        /// operator orders it to resume; free: it surveys.
        start: StartMode = StartMode::Hold, ANY, [Auv];
        /// Planner of the vehicle's path once the operator has sent a utility. The operator may choose another.
        planner: PlannerKind = PlannerKind::Horizon, ANY, [Auv Asv Scenario];
        /// What an adaptive survey does once no look pays any more. repeat: it explores the rest of the area, then looks at
        /// the favoured labels again; explore: it explores the rest, then holds; hold: it holds. The operator may choose
        /// another.
        at_end: AtEnd = AtEnd::Repeat, ANY, [Auv Asv Scenario];
        /// Distance that planned paths keep from the fence and from keep-outs, to allow for the
        /// vehicle's size, turns and drift.
        clearance_m: f64 = 1.0, range(0.0, 1000.0, "m"), [Auv Asv Scenario];
        /// Longest silence of the surface before the reaction in survey.on_silence, unless the operator sets
        /// another limit. 0: no limit.
        max_silence_s: f64 = 0.0, range(0.0, 1e6, "s"), [Auv Scenario];
        /// Reaction to silence of the surface, unless the operator sets another reaction.
        on_silence: Reaction = Reaction::Return, ANY, [Auv Scenario];
        /// Reaction outside the fence, in a keep-out or outside a depth band, unless
        /// the operator sets another reaction.
        on_breach: Reaction = Reaction::Return, ANY, [Auv Scenario];
        /// Reaction to an abort, unless the operator sets another reaction.
        on_abort: Reaction = Reaction::Surface, ANY, [Auv Scenario];
    }
}

section! {
    /// The vehicle's navigation.
    navigation: Navigation {
        /// Source of the vehicle's pose. Empty: the autopilot, or the recording of the camera. tum:FILE: a file of poses with
        /// the times of the images. dvl:HOST:PORT: the dead reckoning of a Doppler velocity log of Water Linked (A50, A125),
        /// which begins at the origin of the map; the port is 16171. ros2:TOPIC: odometry of ROS 2 in a frame of east, north,
        /// up. tf:WORLD#VEHICLE: the transforms of ROS 2 on /tf and /tf_static between a frame of east, north, up and that of
        /// the vehicle, as in tf:map#base_link. The autopilot, if there is one, then only follows waypoints.
        source: NavigationSource = NavigationSource::Autopilot, ANY, [Auv];
        /// Heading of the vehicle at the last reset of the velocity log's dead reckoning, clockwise from north.
        dvl_heading_deg: f64 = 0.0, range(-360.0, 360.0, "degrees"), [Auv];
        /// Silence of the source after which it counts as stalled; a velocity log is then connected to again.
        timeout_s: f64 = 5.0, range(0.5, 600.0, "s"), [Auv];
        /// Longest time between two poses within which the pose of an image is interpolated. Poses that come once a second
        /// need 1.5 s or more.
        max_gap_s: f64 = 2.0, range(0.01, 60.0, "s"), [Auv];
        /// Drift of dead reckoning, in percent of the distance travelled.
        drift_percent: f64 = 1.0, range(0.0, 50.0, "%"), [Auv Scenario];
        /// Standard deviation of the vehicle's position at the start of the survey. It limits how far the first
        /// fixes may move the map.
        start_sigma_m: f64 = 1.0, range(0.0, 100_000.0, "m"), [Auv Scenario];
        /// Time between two position fixes. 0: no fixes.
        fix_period_s: f64 = 10.0, range(0.0, 3600.0, "s"), [Scenario];
        /// Standard deviation of a fix.
        fix_sigma_m: f64 = 0.5, range(0.0, 100.0, "m"), [Scenario];
    }
}

section! {
    /// The registration of camera frames.
    registration: Registration {
        /// Whether each frame is placed on the map by its overlap with earlier frames. Where images show no overlap,
        /// frames are placed by dead reckoning and compass, as all of them are without registration.
        enabled: bool = true, ANY, [Auv Scenario];
        /// Earlier frames, besides the one before, that each frame is compared with. More of them keep a long survey
        /// straighter, and take about 2 ms each. 0: only the frame before.
        loops: u8 = 3, range(0.0, 8.0, ""), [Auv Scenario];
    }
}

section! {
    /// The autopilot of the vehicle or of the surface vehicle.
    autopilot: Autopilot {
        /// Kind of autopilot. none: waypoints are logged only; rehearsal: a simulated vehicle; mavlink: ArduSub or
        /// ArduRover; nmea: NMEA 0183 sentences; log: the same sentences, appended to a file.
        kind: AutopilotKind = AutopilotKind::None, ANY, [Auv Asv];
        /// Port of the autopilot. udp listens, udp-to and tcp connect, and file is for kind log.
        port: Option<PortAddress> = None, ports(&["serial", "udp", "udp-to", "tcp", "file"]), [Auv Asv];
        /// MAVLink system number of the autopilot (mavlink).
        system: u8 = 1, range(1.0, 255.0, ""), [Auv Asv];
        /// MAVLink component number of the autopilot (mavlink); 0: the component whose heartbeat says that it is an ArduPilot.
        component: u8 = 0, range(0.0, 255.0, ""), [Auv Asv];
        /// Whether to arm the autopilot and to switch it to guided mode, once, and again after a restart of the autopilot under
        /// water (mavlink). Otherwise a pilot does so.
        arm: bool = false, ANY, [Auv Asv];
        /// Silence after which the autopilot counts as disconnected.
        timeout_s: f64 = 5.0, range(1.0, 600.0, "s"), [Auv Asv];
        /// Turn rate of a simulated vehicle. 0: it turns on the spot.
        turn_rate_deg_s: f64 = 0.0, range(0.0, 360.0, "deg/s"), [Auv];
        /// East and north components of a current that a simulated vehicle's sensors do not measure.
        current_m_s: [f64; 2] = [0.0, 0.0], range(-5.0, 5.0, "m/s"), [Auv];
    }
}

section! {
    /// The localisation relay: the surface measures the vehicle's position and sends it fixes.
    position: Position {
        /// Port of a GPS receiver with NMEA 0183, or of a gpsd. Empty: no fixes.
        gps: Option<GpsPort> = None, ports(&["serial", "tcp", "gpsd"]), [Asv];
        /// Port of a compass with HDT or THS sentences. Empty: the heading of the GPS receiver.
        compass: Option<PortAddress> = None, ports(&["serial", "tcp"]), [Asv];
        /// Position of the USBL head relative to the GPS antenna: forward, starboard, down.
        usbl_lever_m: [f64; 3] = [0.0, 0.0, 0.0], range(-200.0, 200.0, "m"), [Asv];
        /// Depth of the USBL head.
        usbl_depth_m: f64 = 1.0, range(0.0, 100.0, "m"), [Asv];
        /// Whether the USBL head has no compass, so that its bearings are relative to the bow.
        usbl_from_bow: bool = false, ANY, [Asv];
        /// Rotation of the USBL head relative to the bow, or the error of its compass; clockwise.
        usbl_rotation_deg: f64 = 0.0, range(-360.0, 360.0, "deg"), [Asv];
        /// Speed of sound to which ranges are corrected; modems calculate with 1500 m/s. 0: no correction.
        sound_speed_m_s: f64 = 0.0, range(0.0, 1700.0, "m/s"), [Asv];
        /// Shortest time between two fixes of a vehicle.
        fix_period_s: f64 = 10.0, range(1.0, 3600.0, "s"), [Asv];
        /// Largest standard deviation of a fix that is sent.
        max_sigma_m: f64 = 30.0, range(0.5, 63.0, "m"), [Asv];
        /// Whether the surface vehicle follows the vehicle by its autopilot.
        follow: bool = false, ANY, [Asv];
        /// Horizontal distance at which the surface vehicle follows.
        stand_off_m: f64 = 30.0, range(0.0, 5000.0, "m"), [Asv];
        /// Deviation from position.stand_off_m at which the surface vehicle begins to move.
        dead_band_m: f64 = 15.0, range(1.0, 5000.0, "m"), [Asv];
    }
}
