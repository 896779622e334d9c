//! Random and damaged bytes through every reader of images, distances, calibrations and poses.

use image::{ExtendedColorType, ImageEncoder, RgbImage};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{RngCore, SeedableRng};
use scenecast_messages::sensor_msgs::{CameraInfo, Image, PointCloud2, PointField};
use scenecast_messages::tf2_msgs::TFMessage;
use scenecast_messages::{Message, decode, encode};
use scenecast_sensors::{
    BitDepth, Calibration, DepthMessage, DvlReport, ImageStream, TransformTree, own_stamp, read_calibration, rgb_of,
};

/// Inputs of the usual run; SCENECAST_SENSOR_INPUTS=10000000 is the long one.
const INPUTS: u64 = 60_000;

const DVL: [&str; 2] = [
    r#"{"type":"velocity","format":"json_v3.1","time":106.3,"vx":-3.7e-05,"vy":5.6e-05,"vz":-2.2e-05,"fom":0.0001,"altitude":0.49,"velocity_valid":true,"status":0,"time_of_validity":1638191471563017,"time_of_transmission":1638191471752336}"#,
    r#"{"type":"position_local","format":"json_v3.1","ts":49056.809,"x":12.43,"y":64.61,"z":1.76,"std":0.001,"roll":0.6,"pitch":0.1,"yaw":173.6,"status":0}"#,
];

const CALIBRATION: &str = "image_width: 6\nimage_height: 4\ncamera_name: a\ncamera_matrix:\n  rows: 3\n  cols: 3\n  data: [5.0, 0, 3, 0, 5, 2, 0, 0, 1]\ndistortion_model: plumb_bob\ndistortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [0.1, -0.02,\n    0.001, 0, 0]\n";

fn picture(encoder: impl FnOnce(&mut Vec<u8>) -> image::ImageResult<()>) -> Vec<u8> {
    let mut bytes = Vec::new();
    encoder(&mut bytes).unwrap();
    bytes
}

/// A PNG, a JPEG and a PPM, one after the other.
fn pictures() -> Vec<Vec<u8>> {
    let image = RgbImage::from_fn(6, 4, |x, y| image::Rgb([x as u8 * 40, y as u8 * 60, 7]));
    let png = |out: &mut Vec<u8>| {
        image::codecs::png::PngEncoder::new(out).write_image(image.as_raw(), 6, 4, ExtendedColorType::Rgb8)
    };
    let jpeg = |out: &mut Vec<u8>| {
        image::codecs::jpeg::JpegEncoder::new(out).write_image(image.as_raw(), 6, 4, ExtendedColorType::Rgb8)
    };
    let ppm = [b"P6\n# stamp=3.5\n6 4\n255\n", &image.as_raw()[..]].concat();
    vec![picture(png), picture(jpeg), ppm]
}

fn raw(encoding: &str, bytes: u32) -> Image {
    let data = vec![9; (6 * 4 * bytes) as usize];
    Image { width: 6, height: 4, step: 6 * bytes, encoding: encoding.to_owned(), data, ..Image::default() }
}

fn cloud() -> PointCloud2 {
    let field = |(name, offset): (&str, u32)| PointField { name: name.to_owned(), offset, datatype: 7, count: 1 };
    let fields = [("x", 0), ("y", 4), ("z", 8)].map(field).into();
    let data = [0.1_f32, -0.1, 2.0].iter().flat_map(|m| m.to_le_bytes()).collect();
    PointCloud2 { width: 1, height: 1, fields, point_step: 12, row_step: 12, data, ..PointCloud2::default() }
}

/// Overwrites, inserts or removes a few bytes; some of the new ones are small, as lengths are.
fn damage(bytes: &[u8], random: &mut Xoshiro256PlusPlus) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    for _ in 0..random.next_u64() % 5 {
        let at = (random.next_u64() % (bytes.len() as u64 + 1)) as usize;
        let byte = random.next_u64() as u8 >> (random.next_u64() % 8);
        match random.next_u64() % 5 {
            0 => bytes.insert(at, byte),
            1 if at < bytes.len() => drop(bytes.remove(at)),
            2 => bytes.truncate(at),
            _ if at < bytes.len() => bytes[at] = byte,
            _ => {}
        }
    }
    bytes
}

/// Good inputs, and the state that outlives one input.
struct Bench {
    random: Xoshiro256PlusPlus,
    pictures: Vec<Vec<u8>>,
    images: Vec<Vec<u8>>,
    infos: Vec<Vec<u8>>,
    cloud: Vec<u8>,
    transforms: Vec<u8>,
    stream: ImageStream,
    /// Bytes that the stream was given and has not returned.
    streamed: usize,
    bits: BitDepth,
    tree: TransformTree,
    camera: Calibration,
}

impl Bench {
    fn new() -> Self {
        let info = read_calibration(CALIBRATION).unwrap();
        let of_model = |model: &str, count| CameraInfo {
            distortion_model: model.to_owned(),
            d: vec![0.01; count],
            ..info.clone()
        };
        let infos = [of_model("plumb_bob", 5), of_model("rational_polynomial", 8), of_model("equidistant", 4)];
        let images = [("rgb8", 3), ("mono16", 2), ("bayer_rggb16", 2), ("uyvy", 2), ("32FC1", 4), ("16UC1", 2)];
        let mut transforms = TFMessage { transforms: vec![Default::default(); 2] };
        for (transform, frames) in transforms.transforms.iter_mut().zip([("map", "odom"), ("odom", "base")]) {
            (transform.header.frame_id, transform.child_frame_id) = (frames.0.to_owned(), frames.1.to_owned());
            (transform.header.stamp.sec, transform.transform.rotation.w) = (5, 1.0);
        }
        Self {
            random: Xoshiro256PlusPlus::seed_from_u64(18),
            pictures: pictures(),
            images: images.iter().map(|(name, bytes)| encode(&raw(name, *bytes))).collect(),
            infos: infos.iter().map(encode).collect(),
            cloud: encode(&cloud()),
            transforms: encode(&transforms),
            stream: ImageStream::default(),
            streamed: 0,
            bits: BitDepth::of_setting(0),
            tree: TransformTree::new("map", "base"),
            camera: Calibration::of_info(&info, false).unwrap(),
        }
    }

    fn pick(&mut self, from: usize) -> usize {
        (self.random.next_u64() % from as u64) as usize
    }

    fn message<M: Message>(&mut self, good: &[u8]) -> Option<M> {
        decode(&damage(good, &mut self.random)).ok()
    }

    /// One input; returns whether something was read from it.
    fn run(&mut self) -> bool {
        let kind = self.pick(8);
        match kind {
            0 => {
                let (at, size) = (self.pick(3), (6, 4));
                let bytes = damage(&self.pictures[at].clone(), &mut self.random);
                let _ = own_stamp(&bytes);
                scenecast_sensors::decode(&bytes, BitDepth::Fixed(12)).is_ok_and(|image| image.dimensions() == size)
            }
            1 => {
                let at = self.pick(3);
                let bytes = damage(&self.pictures[at].clone(), &mut self.random);
                self.stream.handle_bytes(&bytes);
                self.streamed += bytes.len();
                let mut is_read = false;
                while let Some(image) = self.stream.poll_image() {
                    is_read = true;
                    assert!(!image.is_empty() && image.len() <= self.streamed, "an image has bytes of the stream");
                    self.streamed -= image.len();
                }
                is_read
            }
            2 => {
                let at = self.pick(self.images.len());
                let image = self.message::<Image>(&self.images[at].clone());
                image.is_some_and(|image| rgb_of(&image, &mut self.bits).is_ok())
            }
            3 => {
                let at = self.pick(self.images.len());
                let image = self.message::<Image>(&self.images[at].clone());
                image.is_some_and(|image| self.reads(DepthMessage::Image(image)))
            }
            4 => {
                let cloud = self.message::<PointCloud2>(&self.cloud.clone());
                cloud.is_some_and(|cloud| self.reads(DepthMessage::Cloud(cloud)))
            }
            5 => {
                let at = self.pick(self.infos.len());
                let info = self.message::<CameraInfo>(&self.infos[at].clone());
                info.is_some_and(|info| {
                    Calibration::of_info(&info, false).is_ok_and(|lens| lens.rectify(RgbImage::new(6, 4)).is_ok())
                })
            }
            6 => {
                let message = self.message::<TFMessage>(&self.transforms.clone());
                let mut all = message.into_iter().flat_map(|message| message.transforms);
                all.all(|transform| self.tree.handle(&transform, false).is_ok())
            }
            _ => {
                let at = self.pick(2);
                let line = damage(DVL[at].as_bytes(), &mut self.random);
                let text = damage(CALIBRATION.as_bytes(), &mut self.random);
                read_calibration(&String::from_utf8_lossy(&text)).is_ok()
                    || DvlReport::all_of(&line).iter().any(Result::is_ok)
            }
        }
    }

    fn reads(&self, message: DepthMessage) -> bool {
        message.read(&self.camera.camera(), (6, 4), 1000.0).is_ok()
    }
}

#[test]
fn random_and_damaged_sensor_bytes_never_panic() {
    let inputs = std::env::var("SCENECAST_SENSOR_INPUTS").ok().and_then(|n| n.parse().ok()).unwrap_or(INPUTS);
    let mut bench = Bench::new();
    let read = (0..inputs).filter(|_| bench.run()).count() as u64;
    println!("{inputs} inputs, {read} of them were read");
    // Otherwise the inputs would be refused before they reach most of the code.
    assert!(read > inputs / 10 && read < inputs * 9 / 10, "{read} of {inputs} were read");
}
