//! The package `sensor_msgs`.

use crate::geometry_msgs::{Quaternion, Vector3};
use crate::message::messages;
use crate::std_msgs::Header;

messages! {
    package "sensor_msgs";

    /// An image without compression. Its stamp is the time of exposure.
    message Image {
        header: Header,
        height: u32,
        width: u32,
        /// Channels and depth, such as rgb8, mono16 or bayer_rggb8.
        encoding: String,
        is_bigendian: u8,
        /// Bytes of a row.
        step: u32,
        /// height * step bytes.
        data: Vec<u8>,
    }

    /// A compressed image.
    message CompressedImage {
        header: Header,
        /// The codec, such as jpeg; image_transport writes more than that: rgb8; jpeg compressed bgr8.
        format: String,
        data: Vec<u8>,
    }

    /// A part of an image, in pixels.
    message RegionOfInterest {
        x_offset: u32,
        y_offset: u32,
        height: u32,
        width: u32,
        do_rectify: bool,
    }

    /// The calibration of a camera.
    message CameraInfo {
        header: Header,
        height: u32,
        width: u32,
        distortion_model: String,
        /// Parameters of the distortion model.
        d: Vec<f64>,
        /// Intrinsic matrix of the distorted image, row by row.
        k: [f64; 9],
        /// Rectification matrix, row by row.
        r: [f64; 9],
        /// Projection matrix of the rectified image, row by row.
        p: [f64; 12],
        binning_x: u32,
        binning_y: u32,
        roi: RegionOfInterest,
    }

    /// Whether a receiver of satellite navigation has a fix.
    message NavSatStatus {
        status: i8,
        service: u16,
    }
    constants {
        int8 STATUS_UNKNOWN: i8 = -2;
        int8 STATUS_NO_FIX: i8 = -1;
        int8 STATUS_FIX: i8 = 0;
        int8 STATUS_SBAS_FIX: i8 = 1;
        int8 STATUS_GBAS_FIX: i8 = 2;
        uint16 SERVICE_UNKNOWN: u16 = 0;
        uint16 SERVICE_GPS: u16 = 1;
        uint16 SERVICE_GLONASS: u16 = 2;
        uint16 SERVICE_COMPASS: u16 = 4;
        uint16 SERVICE_GALILEO: u16 = 8;
    }

    /// A position in WGS 84.
    message NavSatFix {
        header: Header,
        status: NavSatStatus,
        /// Degrees north.
        latitude: f64,
        /// Degrees east.
        longitude: f64,
        /// Metres above the ellipsoid; NaN without one.
        altitude: f64,
        /// Of east, north and up, m2, row by row.
        position_covariance: [f64; 9],
        position_covariance_type: u8,
    }
    constants {
        uint8 COVARIANCE_TYPE_UNKNOWN: u8 = 0;
        uint8 COVARIANCE_TYPE_APPROXIMATED: u8 = 1;
        uint8 COVARIANCE_TYPE_DIAGONAL_KNOWN: u8 = 2;
        uint8 COVARIANCE_TYPE_KNOWN: u8 = 3;
    }

    /// One quantity of the points of a cloud.
    message PointField {
        name: String,
        /// Bytes from the start of a point.
        offset: u32,
        datatype: u8,
        count: u32,
    }
    constants {
        uint8 INT8: u8 = 1;
        uint8 UINT8: u8 = 2;
        uint8 INT16: u8 = 3;
        uint8 UINT16: u8 = 4;
        uint8 INT32: u8 = 5;
        uint8 UINT32: u8 = 6;
        uint8 FLOAT32: u8 = 7;
        uint8 FLOAT64: u8 = 8;
    }

    /// A cloud of points.
    message PointCloud2 {
        header: Header,
        /// 1 for a cloud without rows.
        height: u32,
        width: u32,
        fields: Vec<PointField>,
        is_bigendian: bool,
        /// Bytes of a point.
        point_step: u32,
        /// Bytes of a row.
        row_step: u32,
        data: Vec<u8>,
        /// Whether no point is invalid.
        is_dense: bool,
    }

    /// Attitude, rates of turn in rad/s and accelerations in m/s2.
    message Imu {
        header: Header,
        orientation: Quaternion,
        orientation_covariance: [f64; 9],
        angular_velocity: Vector3,
        angular_velocity_covariance: [f64; 9],
        linear_acceleration: Vector3,
        linear_acceleration_covariance: [f64; 9],
    }
}
