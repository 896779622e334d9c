//! The mission, the vehicle, the processes, and ROS 2.

use super::key::section;
use crate::rule::{ANY, range};
use crate::setting::{
    HostPort, OperatorScript, PageOrigin, Remap, RestoreOrders, RosName, RosTransport, WorldKind, ZenohEndpoint,
};
use scenecast_core::LatLon;
use std::net::IpAddr;
use std::path::PathBuf;

section! {
    /// The mission, the same at both ends.
    mission: Mission {
        /// Name of the mission, for people.
        name: String = "rehearsal".into(), ANY, [Auv Asv Scenario];
        /// Number of the mission, the same at both ends. Frames of another mission are dropped.
        id: u32 = 1, range(0.0, 4_294_967_295.0, ""), [Auv Asv Scenario];
        /// Latitude and longitude of the origin of the world frame (x = y = 0), the same at both ends. With [0.0, 0.0]
        /// the vehicle does not know the origin, and the surface uses the place of its GPS receiver once that has agreed with itself for
        /// 5 s.
        origin_deg: Option<LatLon> = None, range(-180.0, 180.0, "deg"), [Auv Asv Scenario];
    }
}

section! {
    /// The vehicle of this file, or the vehicle that the surface works with.
    vehicle: VehicleSection {
        /// Acoustic address of the vehicle. The surface has address 0.
        address: u8 = 1, range(1.0, 14.0, ""), [Auv Asv Scenario];
        /// Name of the vehicle, for people.
        name: String = "auv-1".into(), ANY, [Auv Asv Scenario];
    }
}

section! {
    /// The surface and its orders.
    surface: SurfaceSection {
        /// Name of the surface, at most 12 letters and digits, by which a vehicle names it to another surface with the same
        /// key. Empty: the name of the computer.
        name: String = String::new(), ANY, [Asv Scenario];
        /// People, ship and cruise, as reports name and cite them, such as "A. Berg, RV Alkor, cruise AL512".
        credit: String = String::new(), ANY, [Asv Scenario];
        /// What the surface does when a vehicle has lost the orders that it had received. ask: it shows them, and sends them
        /// again when an operator confirms it; auto: it sends them again by itself. An order to resume is never sent again.
        restore: RestoreOrders = RestoreOrders::Ask, ANY, [Asv Scenario];
        /// Age after which an abort, or an order to resume, that has not arrived is sent no more, until an operator confirms it. 0: it is
        /// sent until it arrives.
        abort_lifetime_s: f64 = 120.0, range(0.0, 1e6, "s"), [Asv Scenario];
    }
}

section! {
    /// The operator of a rehearsal.
    operator: Operator {
        /// Orders that the rehearsal gives. scripted: two utilities and some exemplar requests at fixed times;
        /// fenced: the same orders, within a fence and limits.
        script: OperatorScript = OperatorScript::Scripted, ANY, [Scenario];
    }
}

section! {
    /// The sea floor of a rehearsal.
    world: WorldSection {
        /// Sea floor of a rehearsal without a mosaic. reef: 120 x 80 m of sand, rubble, seagrass, corals and a wreck, seen
        /// through water; patches: 26 x 18 m drawn from the scene model's own generative process.
        kind: WorldKind = WorldKind::Reef, ANY, [Scenario];
    }
}

section! {
    /// The operator's page.
    console: Console {
        /// Address and port of the page. Empty: no page.
        listen: Option<HostPort> = HostPort::parse("127.0.0.1:8460"), ANY, [Asv];
        /// File of the tokens that the page and scripts must present (scenecast key token): lines of role, name and token,
        /// the role being viewer, operator or administrator; or a single token, for administrators. It is required for
        /// every listen address except loopback addresses.
        token_file: Option<PathBuf> = None, ANY, [Asv];
        /// Host name under which other machines open the page. Empty: they use the address.
        host: String = String::new(), ANY, [Asv];
        /// Origins of the page behind a proxy that encrypts, as in "https://survey.example.org". The page under its own address
        /// needs none.
        origins: Vec<PageOrigin> = Vec::new(), ANY, [Asv];
    }
}

section! {
    /// The processes.
    runtime: Runtime {
        /// Folder for the state that must survive a restart, and for the operator's map.
        state_dir: PathBuf = "state".into(), ANY, [Auv Asv];
        /// Seed of the scene model. The same recording with the same seed gives the same map.
        seed: u64 = 1, range(0.0, 9e15, ""), [Auv];
        /// Mission seconds per wall-clock second, for rehearsals with processes.
        time_scale: f64 = 1.0, range(0.01, 1000.0, ""), [Auv Asv];
    }
}

section! {
    /// The record of the mission: a bag of rosbag2 in MCAP.
    record: Record {
        /// Whether the mission is recorded.
        enabled: bool = true, ANY, [Auv Asv Scenario];
        /// Folder in which each mission gets a folder of its own, named by the vehicle or the surface and the time. Empty: the
        /// folder "records" in runtime.state_dir.
        folder: Option<PathBuf> = None, ANY, [Auv Asv Scenario];
        /// Size at which the next file of a record begins, megabytes.
        part_mb: u64 = 64, range(1.0, 1e5, "MB"), [Auv Asv Scenario];
        /// Size of one mission's record above which its oldest file is removed, megabytes.
        quota_mb: u64 = 1024, range(2.0, 1e7, "MB"), [Auv Asv Scenario];
    }
}

section! {
    /// ROS 2 by DDS and, in builds with the feature `zenoh`, by rmw_zenoh.
    ros2: Ros2 {
        /// Whether the process publishes its map and its state to ROS 2. A camera.source of ROS 2 is independent of it.
        enabled: bool = false, ANY, [Auv Asv];
        /// What the robot uses: DDS, as rmw_fastrtps_cpp and rmw_cyclonedds_cpp do, or Zenoh, as rmw_zenoh_cpp does, which
        /// needs a build with the feature zenoh. "both" joins the two side by side.
        transport: RosTransport = RosTransport::Dds, ANY, [Auv Asv];
        /// Domain, as in ROS_DOMAIN_ID.
        domain: u8 = 0, range(0.0, 232.0, ""), [Auv Asv];
        /// Addresses of this machine whose networks DDS uses, such as "127.0.0.1". Empty: all networks.
        networks: Vec<IpAddr> = Vec::new(), ANY, [Auv Asv];
        /// Router of Zenoh, by which nodes of rmw_zenoh find each other.
        zenoh_router: ZenohEndpoint = ZenohEndpoint::parse("tcp/localhost:7447").unwrap(), ANY, [Auv Asv];
        /// Namespace of the topics. The surface publishes those of each vehicle below its name.
        namespace: RosName = RosName::parse("/scenecast").unwrap(), ANY, [Auv Asv];
        /// Other names for topics, with their whole names, as in "/scenecast/map:=/map".
        remaps: Vec<Remap> = Vec::new(), ANY, [Auv Asv];
        /// Name under which the surface takes orders from ROS 2, as an operator, who must have command. ROS 2 does not
        /// know who sends: whoever reaches its networks may give orders. Empty: no orders are taken.
        principal: String = String::new(), ANY, [Asv];
    }
}
