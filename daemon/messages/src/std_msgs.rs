//! The package `std_msgs`.

use crate::builtin_interfaces::Time;
use crate::message::messages;

messages! {
    package "std_msgs";

    /// The time and the frame of reference of data.
    message Header {
        stamp: Time,
        frame_id: String,
    }

    /// A text.
    message Text = "String" {
        data: String,
    }

    /// A colour; each part is from 0 to 1.
    message ColorRGBA {
        r: f32,
        g: f32,
        b: f32,
        a: f32,
    }

    /// One dimension of an array.
    message MultiArrayDimension {
        label: String,
        size: u32,
        stride: u32,
    }

    /// The dimensions of an array, the outermost first.
    message MultiArrayLayout {
        dim: Vec<MultiArrayDimension>,
        data_offset: u32,
    }

    /// An array with any number of dimensions.
    message Float32MultiArray {
        layout: MultiArrayLayout,
        data: Vec<f32>,
    }
}
