//! Live cameras, each on a thread of its own.
//!
//! An [`ImageSource`] waits for the images of a camera. [`LiveSource`] opens it, opens it again with back-off when it is lost,
//! and reports images and faults to the vehicle. Which image is mapped at which pose is decided by
//! [`scenecast_sensors::FrameMatcher`].

mod arrival_clock;
mod command;
mod live;
mod picture;
mod tum_poses;
mod watch;

pub use arrival_clock::ArrivalClock;
pub use command::CommandSource;
pub use live::{ImageSource, LiveSource, SourceError, SourceImage, SourceReport};
pub use picture::Picture;
pub use tum_poses::read_tum_poses;
pub use watch::WatchSource;
