//! ROS 2 by DDS, without a ROS installation.
//!
//! A [`RosNode`] has threads of its own. It hands received messages over in an [`Inbox`], which drops the oldest message when
//! it is full and counts that, so no reader delays DDS and DDS delays no reader. A [`Publisher`] never waits either.
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

mod inbox;
mod map_versions;
mod names;
mod node;
mod qos;
mod stop;
mod subscribe;
#[cfg(feature = "surface")]
mod surface;
mod vehicle;
mod vehicle_map;

pub use inbox::{Inbox, Received};
pub use names::{topic, valid_part};
pub use node::{Peers, Publisher, RosNode};
pub use qos::Qos;
#[cfg(feature = "surface")]
pub use surface::{SurfaceOutlet, start_surface};
pub use vehicle::{VehicleOutlet, VehicleView, start_vehicle};
pub use vehicle_map::VehicleMap;
