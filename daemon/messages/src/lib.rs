//! ROS 2 messages as Rust structs: the standard ones that robots send and viewers show, and those of scenecast. No IO.
//!
//! Each message is written once. Its struct, its message definition (`.msg`), its DDS type name and its RIHS01 type hash
//! come from that text. [`encode`] and [`decode`] give the bytes that DDS, rmw_zenoh, rosbag2 (`cdr`) and the WebSocket of
//! viewers carry. The structs also implement serde's traits, by which `ros2-client` writes the same bytes.
//!
//! ```
//! use scenecast_messages::{Message, decode, encode, std_msgs::Header};
//!
//! let header = Header { frame_id: "map".to_owned(), ..Default::default() };
//! let bytes = encode(&header);
//! assert_eq!(bytes, [0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 4, 0, 0, 0, b'm', b'a', b'p', 0]);
//! assert_eq!(decode::<Header>(&bytes).unwrap(), header);
//! assert_eq!(Header::DEFINITION.dds_name(), "std_msgs::msg::dds_::Header_");
//! ```

mod catalogue;
mod cdr;
pub mod contents;
mod definition;
mod field;
mod message;
mod standard;

pub mod scenecast_msgs;
pub mod sensor_msgs;

pub use catalogue::{CATALOGUE, Entry};
pub use cdr::{CdrError, decode, encode};
pub use definition::{Constant, Definition, Field, Kind, Primitive};
pub use field::Byte;
pub use message::Message;
pub use standard::{
    builtin_interfaces, diagnostic_msgs, geometry_msgs, grid_map_msgs, nav_msgs, rcl_interfaces, rosgraph_msgs,
    std_msgs, tf2_msgs,
};
