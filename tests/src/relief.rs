//! A made-up sea floor with a block on it, as an RGB-D camera sees it.

use std::fmt::Write as _;
use std::path::Path;

/// Size of the images, pixels.
const SIZE: (u32, u32) = (240, 180);
/// fx, fy, cx and cy.
pub const RELIEF_CAMERA: [f64; 4] = [200.0, 200.0, 120.0, 90.0];
/// Up is positive: the camera, the floor and the top of the block, metres.
const CAMERA_Z: f64 = -10.0;
const FLOOR_Z: f64 = -14.0;
const TOP_Z: f64 = -12.5;
/// West, south, east and north of the block, metres.
const BLOCK: [f64; 4] = [2.5, 2.0, 5.5, 4.0];
/// Depth units per metre, as in the TUM benchmark.
const UNITS_PER_M: f64 = 5000.0;

/// Whether a place is on the block; `None` near its edge.
pub fn is_on_block(x: f64, y: f64, margin_m: f64) -> Option<bool> {
    let [west, south, east, north] = BLOCK;
    let inside = (x - west).min(east - x).min(y - south).min(north - y);
    (inside.abs() >= margin_m).then_some(inside > 0.0)
}

/// Depth of the sea floor below the surface, metres.
pub fn relief_depth_m(is_on_block: bool) -> f64 {
    if is_on_block { -TOP_Z } else { -FLOOR_Z }
}

/// Writes three lanes of a camera that looks ahead by 12 degrees and rolls, in the layout of the TUM benchmark.
pub fn write_relief(dir: &Path) {
    std::fs::create_dir_all(dir).unwrap();
    let (mut rgb, mut depth, mut truth) = (String::new(), String::new(), String::new());
    for i in 0..18u32 {
        let (lane, step) = (i / 6, i % 6);
        let place = [1.5 + 2.5 * f64::from(lane), f64::from(step), CAMERA_Z];
        let roll = if i % 2 == 0 { 0.1 } else { -0.06 };
        let tilt = Tilt { ahead: 0.21, roll };
        let (mut colours, mut metres) = (image::RgbImage::new(SIZE.0, SIZE.1), Vec::new());
        for (u, v, colour) in colours.enumerate_pixels_mut() {
            let [fx, fy, cx, cy] = RELIEF_CAMERA;
            let ray = [(f64::from(u) + 0.5 - cx) / fx, (f64::from(v) + 0.5 - cy) / fy, 1.0];
            let (distance, at) = hit(place, tilt.turned(ray));
            *colour = paint(at);
            metres.push((distance * UNITS_PER_M).round() as u16);
        }
        colours.save(dir.join(format!("c{i}.png"))).unwrap();
        let distances: image::ImageBuffer<image::Luma<u16>, _> =
            image::ImageBuffer::from_raw(SIZE.0, SIZE.1, metres).unwrap();
        distances.save(dir.join(format!("d{i}.png"))).unwrap();
        let time = f64::from(i) * 2.0;
        let [x, y, z] = place;
        let [qx, qy, qz, qw] = tilt.quaternion();
        let _ = writeln!(rgb, "{time:.6} c{i}.png");
        let _ = writeln!(depth, "{time:.6} d{i}.png");
        let _ = writeln!(truth, "{time:.6} {x} {y} {z} {qx} {qy} {qz} {qw}");
    }
    for (name, text) in [("rgb.txt", rgb), ("depth.txt", depth), ("groundtruth.txt", truth)] {
        std::fs::write(dir.join(name), text).unwrap();
    }
}

/// A camera that heads north: first turned about its heading, then ahead.
struct Tilt {
    ahead: f64,
    roll: f64,
}

impl Tilt {
    /// A vector of the camera's axes in east, north, up.
    fn turned(&self, [right, down, along]: [f64; 3]) -> [f64; 3] {
        let (x, y, z) = (right, -down, -along);
        let (sin, cos) = self.roll.sin_cos();
        let (x, z) = (cos * x + sin * z, cos * z - sin * x);
        let (sin, cos) = self.ahead.sin_cos();
        [x, cos * y - sin * z, sin * y + cos * z]
    }

    fn quaternion(&self) -> [f64; 4] {
        let ((sa, ca), (sr, cr)) = ((self.ahead / 2.0).sin_cos(), (self.roll / 2.0).sin_cos());
        // The product of the turns about east and north, times half a turn about east.
        let [x, y, z, w] = [sa * cr, ca * sr, sa * sr, ca * cr];
        [w, z, -y, -x]
    }
}

/// The distance in lengths of the ray, and the first place that it meets.
fn hit(from: [f64; 3], ray: [f64; 3]) -> (f64, [f64; 3]) {
    let at = |share: f64| [0, 1, 2].map(|i| from[i] + share * ray[i]);
    let [west, south, east, north] = BLOCK;
    let bounds = [(west, east), (south, north), (FLOOR_Z, TOP_Z)];
    let (mut enter, mut leave) = (0.0_f64, f64::INFINITY);
    for (i, (low, high)) in bounds.into_iter().enumerate() {
        let (a, b) = ((low - from[i]) / ray[i], (high - from[i]) / ray[i]);
        enter = enter.max(a.min(b));
        leave = leave.min(a.max(b));
    }
    let floor = (FLOOR_Z - from[2]) / ray[2];
    let share = if enter < leave && enter < floor { enter } else { floor };
    (share, at(share))
}

/// The block is red, the floor grey, both mottled.
fn paint([x, y, z]: [f64; 3]) -> image::Rgb<u8> {
    let spot = |metres: f64| (metres / 0.05).floor() as i64 as u64;
    let mixed = spot(x).wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ spot(y).wrapping_mul(0xC2B2_AE3D_27D4_EB4F);
    let noise = ((mixed.wrapping_mul(0x1656_67B1_9E37_79F9) >> 58) as u8) / 2;
    let is_block = z > FLOOR_Z + 0.01;
    image::Rgb(if is_block { [170 + noise, 50 + noise, 40] } else { [80 + noise, 100 + noise, 110 + noise] })
}
