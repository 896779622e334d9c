//! All messages, for those who handle them by name.

use crate::cdr::{CdrError, decode, encode};
use crate::definition::Definition;
use crate::message::Message;
use crate::{
    builtin_interfaces, diagnostic_msgs, geometry_msgs, grid_map_msgs, nav_msgs, rcl_interfaces, rosgraph_msgs,
    scenecast_msgs, sensor_msgs, std_msgs, tf2_msgs,
};

/// One message, without its Rust type.
#[derive(Debug, Clone, Copy)]
pub struct Entry {
    pub definition: &'static Definition,
    /// Decodes bytes and encodes the result.
    pub recode: fn(&[u8]) -> Result<Vec<u8>, CdrError>,
}

const fn entry<M: Message>() -> Entry {
    Entry { definition: M::DEFINITION, recode: |bytes| decode::<M>(bytes).map(|message| encode(&message)) }
}

macro_rules! catalogue {
    ($($package:ident: $($name:ident)*;)*) => {
        /// Every message of this crate.
        pub const CATALOGUE: &[Entry] = &[$($(entry::<$package::$name>(),)*)*];
    };
}

catalogue! {
    builtin_interfaces: Time Duration;
    std_msgs: Header Text ColorRGBA MultiArrayDimension MultiArrayLayout Float32MultiArray;
    geometry_msgs: Point Point32 Polygon Vector3 Quaternion Pose PoseStamped PoseWithCovariance PoseWithCovarianceStamped
        Transform TransformStamped Twist TwistWithCovariance;
    sensor_msgs: Image CompressedImage RegionOfInterest CameraInfo NavSatStatus NavSatFix PointField PointCloud2 Imu;
    nav_msgs: MapMetaData OccupancyGrid Odometry Path;
    tf2_msgs: TFMessage;
    rosgraph_msgs: Clock;
    rcl_interfaces: Log;
    diagnostic_msgs: KeyValue DiagnosticStatus DiagnosticArray;
    grid_map_msgs: GridMapInfo GridMap;
    scenecast_msgs: Frame MapVersion CameraFrame MapCells LabelTree Order OrderStatus Exemplar Link Event LabelUtility Utility Fence Hold Abort;
}
