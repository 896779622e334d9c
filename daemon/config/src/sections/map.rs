//! The map's stream, the camera and the scene model.

use super::key::section;
use crate::rule::{ANY, range};
use crate::setting::{
    BandRange, BirthRule, CalibrationSource, CameraSource, CameraStamps, Debounce, DepthSource, LabelSource, LayerName,
    MapCells, SceneLabels, Votes,
};
use scenecast_protocol::map_codec::Codec;
use std::collections::BTreeMap;
use std::path::PathBuf;

section! {
    /// The stream of the map to the surface.
    map: Map {
        /// Codec of map chunks. auto takes the smaller result for each chunk.
        codec: Codec = Codec::Auto, ANY, [Auv Scenario];
        /// Time for which a new value of a cell must be stable before it is sent, if the operator already has a value
        /// of that cell. A cell that changes repeatedly must be stable for up to eight times as long. 0: no delay. auto:
        /// as long as the backlog takes at the budget, at most 60 s, and no longer than something else waits; this holds
        /// for labels only.
        debounce_s: Debounce = Debounce::Automatic, range(0.0, 600.0, "s"), [Auv Scenario];
        /// Longest backlog, in seconds of the budget, that is sent in plain order. A longer backlog is sent coarse to
        /// fine: every fourth cell in both directions first. 0: never coarse to fine.
        coarse_after_s: f64 = 0.0, range(0.0, 86_400.0, "s"), [Auv Scenario];
        /// Cells that are sent. fine: every cell; coarse: every fourth cell in both directions. The cells of the scene
        /// model do not change. An order of the operator has precedence.
        cells: MapCells = MapCells::Fine, ANY, [Auv Scenario];
        /// Layers that may be sent beside the labels; the glossary defines each. A layer without a share is sent as a background stream, if link.background lists it.
        layers: Vec<LayerName> = LayerName::all().collect(), ANY, [Auv Scenario];
        /// Minimum share of each layer within the map's share of link.shares while labels wait too. The shares add up
        /// to 100 % or less. 0: spare capacity only.
        layer_shares: BTreeMap<LayerName, u8> = BTreeMap::new(), range(0.0, 100.0, "%"), [Auv Scenario];
        /// Step of the depth layer, rounded to tenths of a metre. The layer has 254 steps around survey.depth_m.
        depth_step_m: f64 = 0.5, range(0.1, 25.5, "m"), [Auv Scenario];
    }
}

section! {
    /// The camera.
    camera: Camera {
        /// Source of the frames. frames:DIR: images with DIR/poses.csv. bag:FILE: images and odometry that ROS 2 recorded in
        /// MCAP, a file or the folder of a bag, with #TOPIC behind it where there are several topics of images. tum:DIR: images
        /// with distances and poses in the layout of the TUM RGB-D benchmark, rgb.txt, depth.txt and groundtruth.txt. watch:DIR:
        /// images, as they are written to a folder. command:COMMAND: images that a shell command writes to its standard
        /// output, MJPEG, PNG or PPM. v4l2:DEVICE: a camera of the system, by ffmpeg. ros2:TOPIC: images of ROS 2, compressed
        /// if the name of the topic ends in /compressed. Empty: the image of the rehearsal; a vehicle at sea then has no
        /// camera frames.
        source: CameraSource = CameraSource::Rehearsal, ANY, [Auv Scenario];
        /// Time of the images of a live camera. own: the time that the image, its file name or its message gives; an image
        /// that gives none was taken camera.delay_s before its arrival. arrival: so for all images.
        stamps: CameraStamps = CameraStamps::Own, ANY, [Auv];
        /// Time between the exposure and the arrival of an image that does not give its time.
        delay_s: f64 = 0.0, range(0.0, 60.0, "s"), [Auv];
        /// Added to the times that images give, where the camera's clock differs from that of the poses.
        clock_offset_s: f64 = 0.0, range(-86_400.0, 86_400.0, "s"), [Auv];
        /// Time without an image after which a live camera counts as stalled; a command is then started again.
        timeout_s: f64 = 10.0, range(1.0, 3600.0, "s"), [Auv];
        /// Frames per second.
        rate_hz: f64 = 0.5, range(0.01, 30.0, "1/s"), [Scenario];
        /// Columns of a frame.
        width_px: u32 = 640, range(64.0, 4096.0, "pixel"), [Scenario];
        /// Rows of a frame.
        height_px: u32 = 480, range(64.0, 4096.0, "pixel"), [Scenario];
        /// Size of a pixel on the sea floor.
        metres_per_pixel: f64 = 0.01, range(0.0001, 10.0, "m"), [Auv Asv Scenario];
        /// Place of a live camera on the vehicle: metres forward, to starboard and down from the point whose pose is measured.
        mount_m: [f64; 3] = [0.0, 0.0, 0.0], range(-20.0, 20.0, "m"), [Auv];
        /// Direction of a live camera: rotation of the image's upper edge from the bow, clockwise from above; then tilt of the
        /// optical axis from straight down, towards the bow and to starboard. Roll and pitch of the vehicle are added; a frame
        /// that is tilted by more than 34 degrees in all is not mapped.
        mount_deg: [f64; 3] = [0.0, 0.0, 0.0], range(-180.0, 180.0, "deg"), [Auv];
        /// Distances of the pixels of a live camera; words are then placed at their points in space. ros2:TOPIC: depth images
        /// (16UC1 or 32FC1) registered to the rectified images. cloud:TOPIC: point clouds (PointCloud2) in the axes of the
        /// rectified camera, x to the right, y down, z ahead. They are matched with the images within 20 ms; an image without
        /// them is mapped on a flat floor. Empty: the floor is flat.
        depth: DepthSource = DepthSource::None, ANY, [Auv];
        /// Units of whole-number depth images in a metre. 0: 1000, and 5000 for a tum source.
        depth_units_per_m: f64 = 0.0, range(0.0, 1_000_000.0, "1/m"), [Auv Scenario];
        /// Calibration of the camera. Its images are rectified, and the altitude and the focal length give the size of their
        /// pixels. file:FILE: a YAML file of ROS's camera_calibration. ros2:TOPIC: CameraInfo; images from before the first one
        /// are not mapped. Empty: of a ros2 source the topic camera_info beside its images; until it is found, for at most 3 s,
        /// images are not mapped; of a bag the first usable message of that topic. none: images are not rectified.
        calibration: CalibrationSource = CalibrationSource::Beside, ANY, [Auv Scenario];
        /// Camera matrix fx, fy, cx, cy of images without distortion, in place of camera.calibration. All 0: not known.
        matrix: [f64; 4] = [0.0; 4], range(-1_000_000.0, 1_000_000.0, "pixel"), [Auv Scenario];
        /// Bits of the levels in images of 16 bits a channel, 8 to 16: 10, 12 or 14 for cameras that leave the upper bits at 0. 0,
        /// for raw images of ROS 2: the least number of bits that holds the levels of all images so far.
        bits: u8 = 16, range(0.0, 16.0, ""), [Auv Scenario];
        /// Whether frames are corrected for a light that depends on the place in the frame alone: lamps, the lens, the water
        /// between. It is learnt from the first 500 frames. Exemplars show the frame as it is.
        flat_field: bool = true, ANY, [Auv Scenario];
    }
}

section! {
    /// The scene model.
    scene: Scene {
        /// Edge of a map cell, the same at both ends. 0: 25 pixels of the camera.
        cell_m: f64 = 0.0, range(0.0, 1000.0, "m"), [Auv Asv Scenario];
        /// Weight of topics that are common elsewhere in the map, against those of the neighbouring cells.
        alpha: f64 = 0.01, range(1e-9, 1e3, ""), [Auv Scenario];
        /// Prior count of each visual word in each topic.
        beta: f64 = 0.1, range(1e-9, 1e3, ""), [Auv Scenario];
        /// Weight of a new topic.
        gamma: f64 = 1e-4, range(1e-12, 1e3, ""), [Auv Scenario];
        /// Interpretation of gamma. literal: gamma, as in the paper; collapsed: gamma divided by the size of the
        /// vocabulary; rost: alpha times gamma divided by the size of the vocabulary, as in the program ROST.
        birth: BirthRule = BirthRule::Literal, ANY, [Auv Scenario];
        /// The labels of the map. topics: the topics of the visual words, as in the paper; habitats: cells that look alike over all
        /// their sights, in whatever order they were seen. alpha, beta and gamma are those of topics.
        labels: SceneLabels = SceneLabels::Habitats, ANY, [Auv Scenario];
        /// Maximum number of labels at a time. Habitats have no more than the sea floor calls for, and an order changes their maximum during
        /// a mission (2 to 32). Of topics, 32 show more of a reef than 16 for a third more bits.
        max_labels: u32 = 16, range(2.0, 254.0, ""), [Auv Scenario];
        /// Words that are resampled per second of mission time.
        refine_words_per_s: u32 = 250_000, range(0.0, 1e8, "1/s"), [Auv Scenario];
        /// Maximum rate of camera frames into the scene model. The first frame of each interval
        /// is used. 0: every frame.
        frames_per_s: f64 = 0.0, range(0.0, 30.0, "1/s"), [Auv Scenario];
        /// Maximum number of words that are kept in a cell.
        max_words_per_cell: u32 = 200, range(8.0, 60_000.0, ""), [Auv Scenario];
        /// File of a vocabulary (scenecast vocabulary train), learnt from images or from annotated images of a similar
        /// site. Empty: the built-in vocabulary.
        vocabulary: Option<PathBuf> = None, ANY, [Auv Scenario];
        /// Mission time between two checkpoints of the scene model. A restarted vehicle continues from the
        /// last one. 0: no checkpoints.
        checkpoint_s: f64 = 60.0, range(0.0, 86_400.0, "s"), [Auv];
        /// File of a table of scenecast tune, from which "fit to budget" takes settings of the scene model. Empty: the
        /// built-in table, measured on procedural sea floors.
        tuning_table: Option<PathBuf> = None, ANY, [Asv];
    }
}

section! {
    /// Labels of another program in place of those of the scene model.
    labels: Labels {
        /// Where the labels come from. Empty: the scene model. dir:FOLDER: files NAME.json and NAME.png; socket:HOST:PORT
        /// and socket:/PATH: programs that connect and send the same; ros2:/TOPIC: a topic of ROS 2 with messages
        /// OccupancyGrid (whole grids), or Image (segmented images) if #Image follows. A rehearsal takes dir: alone.
        source: LabelSource = LabelSource::SceneModel, ANY, [Auv Scenario];
        /// File with names and colours of classes: the header of an item of the kind "classes". Empty: none.
        classes: Option<PathBuf> = None, ANY, [Auv Scenario];
        /// Which segmented images decide about the class of a cell: the class that most of their pixels in it have. all:
        /// every image that has shown the cell; newest: the last one. A grid decides alone.
        votes: Votes = Votes::All, ANY, [Auv Scenario];
        /// Size of a pixel of segmented images on the sea floor, for those that do not state it. 0: that of the camera.
        metres_per_pixel: f64 = 0.0, range(0.0, 100.0, "m"), [Auv Scenario];
        /// Frame of reference of grids of ROS 2, the vehicle's map frame of east, north, up; grids in another one are
        /// refused. Empty: map and odom.
        frame: String = String::new(), ANY, [Auv];
    }
}

section! {
    /// Bands of another program beside the labels, whichever gives these: depth, backscatter, uncertainty, a costmap.
    bands: Bands {
        /// Where the bands come from, as for labels.source. Empty: no source besides labels.source, which may give bands
        /// too. ros2:/TOPIC: messages GridMap, whose layers are bands, or OccupancyGrid if #OccupancyGrid follows.
        source: LabelSource = LabelSource::SceneModel, ANY, [Auv Scenario];
        /// Quantities between which a band has its 254 levels, for bands of numbers or of 16 bits. Others have a round step
        /// that is chosen from the first quantities and kept.
        ranges: Vec<BandRange> = Vec::new(), ANY, [Auv Scenario];
        /// Minimum share of each band within the map's share of link.shares while labels wait too. The shares of all
        /// layers add up to 100 % or less; a band beyond that has what is left.
        share: u8 = 8, range(0.0, 100.0, "%"), [Auv Scenario];
    }
}
