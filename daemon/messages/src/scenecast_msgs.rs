//! The package `scenecast_msgs`: the messages of scenecast.
//!
//! Places are metres east, north and up of the mission's origin, in the frame of the header.

use crate::builtin_interfaces::Time;
use crate::geometry_msgs::{Point, Polygon, Pose};
use crate::message::messages;
use crate::std_msgs::Header;

messages! {
    package "scenecast_msgs";

    /// One frame of the acoustic link.
    message Frame {
        header: Header,
        /// The vehicle at the other end, or that sent it.
        vehicle: String,
        /// SENT, RECEIVED or DROPPED.
        direction: u8,
        /// Its number among those of its sender: as many low bits as are on air; 0 in a hello.
        number: u16,
        /// Bits on air.
        bits: u32,
        /// What it carries, headers not included: directive, status, fix, map, exemplar, or the name of a layer.
        contents: Vec<String>,
        /// Bits of each of them. Copies of earlier frames, and what a vehicle receives, have none.
        content_bits: Vec<u32>,
        /// The reason for which it was dropped; empty otherwise.
        reason: String,
        /// The bytes on air; empty where they are not recorded.
        data: Vec<u8>,
    }
    constants {
        uint8 SENT: u8 = 0;
        uint8 RECEIVED: u8 = 1;
        uint8 DROPPED: u8 = 2;
    }

    /// The state of a replicated map.
    message MapVersion {
        header: Header,
        vehicle: String,
        /// The epoch, in which no label number changes its meaning.
        epoch: u32,
        version: u64,
        /// Explored cells.
        cells: u32,
        /// Fingerprint of the labels.
        digest: u16,
    }

    /// A camera frame that was mapped.
    message CameraFrame {
        taken: Time,
        /// Where the camera was; by registration, where that is on.
        camera: Pose,
    }

    /// Cells of a replicated map that have changed.
    message MapCells {
        header: Header,
        vehicle: String,
        /// The epoch, in which no label number changes its meaning.
        epoch: u32,
        version: u64,
        /// The name of the layer; empty for the labels.
        layer: String,
        /// The edge of a cell, metres.
        cell_m: f64,
        /// Whether these are all cells; otherwise the others are as before.
        whole: bool,
        /// Column and row of each cell; (0, 0) lies north-east of the map's origin.
        x: Vec<i32>,
        y: Vec<i32>,
        /// The label or the level of each cell; 0 is unexplored.
        value: Vec<u8>,
        /// Camera frames after which the vehicle changed cells; none at the surface.
        frames: Vec<CameraFrame>,
        /// Of each cell, if there are frames: the index of its frame, or NO_FRAME.
        frame: Vec<u16>,
        /// How many visual words it had after that frame.
        words: Vec<u32>,
        /// How sure its label was then, 0 to 1; NaN where that is not known.
        confidence: Vec<f32>,
    }
    constants {
        uint16 NO_FRAME: u16 = 65535;
    }

    /// Which labels of a map become one at coarser cuts.
    message LabelTree {
        header: Header,
        vehicle: String,
        /// The epoch, in which no label number changes its meaning.
        epoch: u32,
        /// Merges, the closest first: the label `joins[i]` becomes one with `into[i]`, which stands for both from then on. The
        /// first n - k + 1 of n merges make the cut at k labels.
        into: Vec<u8>,
        joins: Vec<u8>,
        /// The number of labels at the cut at which they differ most clearly; 0 if that is the finest one.
        clearest: u8,
    }

    /// An order as a principal gave it.
    message Order {
        header: Header,
        vehicle: String,
        /// The name of the principal.
        principal: String,
        /// The slot of the directive, such as utility.
        slot: String,
        version: u32,
        /// The content as JSON, as the HTTP API takes it.
        content: String,
    }

    /// How far an order has come.
    message OrderStatus {
        header: Header,
        vehicle: String,
        slot: String,
        version: u32,
        status: u8,
        /// The reason of a refusal or a withdrawal; empty otherwise.
        reason: String,
        /// The time at which the order was given.
        given: Time,
    }
    constants {
        uint8 QUEUED: u8 = 0;
        uint8 ON_AIR: u8 = 1;
        uint8 RECEIVED: u8 = 2;
        uint8 APPLIED: u8 = 3;
        uint8 REFUSED: u8 = 4;
        uint8 WITHDRAWN: u8 = 5;
    }

    /// An image that shows one label, or none: then a view of the sea floor with north up.
    message Exemplar {
        header: Header,
        vehicle: String,
        epoch: u32,
        /// 1 to 254; 0 for a view of the sea floor.
        label: u8,
        /// The number of the image among those of the label.
        image: u8,
        /// The name of the label that an operator gave; empty without one.
        name: String,
        /// When it was taken; 0 where that is not known.
        taken: Time,
        /// How wide it is on the sea floor, metres; NaN where it is not known.
        width_m: f64,
        /// Its middle in the frame of the header, or in the world frame where that is empty.
        middle: Point,
        /// Whether somebody asked for it.
        requested: bool,
        /// The codec of the data: jpeg or webp.
        format: String,
        data: Vec<u8>,
    }

    /// The acoustic link at one time.
    message Link {
        header: Header,
        vehicle: String,
        /// Bits on air a second that this end may send.
        budget_bps: u32,
        /// Mean rates on air of the last minute, bit/s.
        sent_bps: f32,
        received_bps: f32,
        /// The share of the last frames that were lost, 0 to 1.
        loss: f32,
        /// Two-way travel time, s; NaN while it is unknown.
        round_trip_s: f32,
        /// Age of the last frame, s; NaN without one.
        age_s: f32,
        /// Bits that wait.
        backlog_bits: u64,
    }

    /// An event that people should know of.
    message Event {
        header: Header,
        vehicle: String,
        /// A level of rcl_interfaces/Log.
        level: u8,
        /// The part that reports it, such as link or ros2.
        source: String,
        text: String,
    }
    constants {
        uint8 INFO: u8 = 20;
        uint8 WARN: u8 = 30;
        uint8 ERROR: u8 = 40;
    }

    /// The weight of one label.
    message LabelUtility {
        /// 1 to 254.
        label: u8,
        /// -1 (avoid) to 1 (seek).
        weight: f32,
    }

    /// Order: the weights of labels. Labels that are not listed get the weight 0.
    message Utility {
        header: Header,
        labels: Vec<LabelUtility>,
        /// The weight of unexplored cells, -1 to 1.
        exploration: f32,
        /// The weight of cells that the scene model explains badly, -1 to 1.
        curiosity: f32,
    }

    /// Order: the outline that the vehicle must stay in, and those that it must stay out of.
    message Fence {
        header: Header,
        /// Without points, there is no outline to stay in.
        outline: Polygon,
        keep_outs: Vec<Polygon>,
        /// Whether return_point is set.
        has_return_point: bool,
        return_point: Point,
    }

    /// Order: hold the position, or resume the survey.
    message Hold {
        header: Header,
        hold: bool,
    }

    /// Order: abort the mission, or resume it after an abort.
    message Abort {
        header: Header,
        abort: bool,
    }
}
