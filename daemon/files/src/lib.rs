//! Files of scenecast: images, recorded missions and vocabularies are read; results are written whole or not at all.
//!
//! Internal to scenecast. The crate reads and writes files; it uses no clock and no network.

mod bag;
mod bag_recording;
mod class_names;
mod configured;
mod frame_image;
mod geojson;
mod images;
mod label_folder;
mod recording;
mod tum_folder;
mod tum_recording;
mod vocabulary;
mod whole;

pub use bag::Bag;
pub use bag_recording::{BagTiming, BagTopics};
pub use class_names::read_class_names;
pub use configured::{configured_calibration, configured_mounting, configured_recording, open_bag};
pub use frame_image::FrameImage;
pub use geojson::{AreaShape, CoordinateFrame, FenceShapes, read_areas, read_fence};
pub use images::{read_classes, read_image};
pub use label_folder::{FolderItem, LabelFolder};
pub use recording::{DepthFile, RecordedFrame, Recorder, Recording, write_poses};
pub use tum_folder::{TUM_UNITS_PER_M, TumFolder, TumFrame, read_depth, tum_camera};
pub use tum_recording::TumOptions;
pub use vocabulary::{configured_vocabulary, read_vocabulary};
pub use whole::{sync_folder, write_whole};
