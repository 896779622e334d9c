//! ROS 2 by DDS.

use crate::key::section;
use crate::rule::{ANY, range};
use crate::setting::{Remap, RosName};
use std::net::IpAddr;

section! {
    /// ROS 2 by DDS.
    ros2: Ros2 {
        /// Whether the process publishes its map and its state to ROS 2. A camera.source of ROS 2 is independent of it.
        enabled: bool = false, ANY, [Auv Asv];
        /// Domain of DDS, as in ROS_DOMAIN_ID.
        domain: u8 = 0, range(0.0, 232.0, ""), [Auv Asv];
        /// Addresses of this machine whose networks DDS uses, such as "127.0.0.1". Empty: all networks.
        networks: Vec<IpAddr> = Vec::new(), ANY, [Auv Asv];
        /// Namespace of the topics. The surface publishes those of each vehicle below its name.
        namespace: RosName = RosName::parse("/scenecast").unwrap(), ANY, [Auv Asv];
        /// Other names for topics, with their whole names, as in "/scenecast/map:=/map".
        remaps: Vec<Remap> = Vec::new(), ANY, [Auv Asv];
        /// Name under which the surface takes orders from ROS 2, as an operator, who must have command. DDS does not know
        /// who sends: whoever reaches its networks may give orders. Empty: no orders are taken.
        principal: String = String::new(), ANY, [Asv];
    }
}
