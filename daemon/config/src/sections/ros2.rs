//! ROS 2 by DDS and by rmw_zenoh.

use crate::key::section;
use crate::rule::{ANY, range};
use crate::setting::{Remap, RosName, RosTransport, ZenohEndpoint};
use std::net::IpAddr;

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
