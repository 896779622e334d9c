//! Files of scenecast: images, recorded missions and vocabularies are read; results are written whole or not at all.
//!
//! Internal to scenecast. The crate reads and writes files; it uses no clock and no network.

mod bag;
mod bag_recording;
mod configured;
mod geojson;
mod images;
mod json_file;
mod label_folder;
mod pose_table;
mod record;
mod recording;
mod tum_recording;
mod whole;

pub use crate::images::{DepthFile, read_depth};
pub use bag::Bag;
pub use bag::stream::HOW_TO_RECOVER;
pub use bag_recording::{BagTiming, BagTopics};
pub use configured::{
    configured_calibration, configured_mounting, configured_recording, configured_vocabulary, open_bag, read_vocabulary,
};
pub use geojson::{AreaShape, CoordinateFrame, FenceShapes, read_areas, read_fence};
pub use images::{FrameImage, own_scale_m, read_classes, read_image, unread_emptiness};
pub use label_folder::{FolderItem, LabelFolder, read_class_names};
pub use record::{
    FrameFate, FrameTimes, MissionClock, MissionSpeed, RecordEntry, RecordFile, RecordLimits, RecordWriter,
    RecordedFrames, RecordedLink, RecordedMessage, RecoveredPart, SentFrame, StateTime, is_record, mission_records,
    read_record, recover,
};
pub use recording::{RecordedFrame, Recorder, Recording, write_poses};
pub use tum_recording::{NumberFault, TUM_UNITS_PER_M, TumFolder, TumFrame, TumOptions, finite_number, tum_camera};
pub use whole::{sync_folder, write_whole};
