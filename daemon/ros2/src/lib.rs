//! ROS 2 by DDS and, in builds with the feature `zenoh`, by rmw_zenoh, without a ROS installation.
//!
//! A [`RosNode`] has threads of its own. It hands received messages over in an [`Inbox`], which drops the oldest message when
//! it is full and counts that, so no reader delays a transport and no transport delays a reader. A [`Publisher`] never waits
//! for a peer either.
//!
//! ```no_run
//! use scenecast_config::Ros2;
//! use scenecast_ros2::{RosNode, topic};
//! use std::time::Duration;
//!
//! let node = RosNode::start(&Ros2::default(), "scenecast").unwrap();
//! let images = node.subscribe_images(&topic("/camera/image_raw").unwrap()).unwrap();
//! while images.wait(Duration::from_secs(60)) {
//!     let Some(image) = images.take_newest() else { continue };
//!     println!("{} x {}, {} dropped", image.message.width, image.message.height, images.dropped());
//! }
//! ```

mod dds;
mod inbox;
mod node;
mod stop;
#[cfg(feature = "surface")]
mod surface;
mod transport;
mod vehicle;
#[cfg(feature = "zenoh")]
mod zenoh;
#[cfg(not(feature = "zenoh"))]
#[path = "zenoh/absent.rs"]
mod zenoh;

pub use crate::node::topic;
pub use crate::vehicle::VehicleMap;
pub use inbox::{Inbox, Received};
pub use node::{Publisher, RosNode};
pub use scenecast_messages::contents::valid_part;
#[cfg(feature = "surface")]
pub use surface::{SurfaceOutlet, start_surface};
pub use transport::{Peers, Qos, Transport};
pub use vehicle::{VehicleOutlet, VehicleView, start_vehicle};
