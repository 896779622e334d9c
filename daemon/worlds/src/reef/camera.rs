//! The camera that looks down at the reef through water.

use super::Reef;
use super::fields::Colour;
use super::optics::{self, Optics};
use super::tiles::Tiles;
use image::RgbImage;

/// A frame to be taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// The place below the camera, metres east and north.
    pub x_m: f64,
    pub y_m: f64,
    /// Direction of the frame's top, clockwise from north.
    pub heading_rad: f64,
    /// Height above the sea floor: the water in between takes and adds light.
    pub altitude_m: f64,
    /// Columns and rows of the frame.
    pub width_px: u32,
    pub height_px: u32,
    /// Number of the moment. Snow and noise differ from moment to moment.
    pub moment: u64,
}

/// Nodes of the floor are so many pixels apart: the lens and the water blur what is smaller.
const BLUR: f64 = 1.35;

/// A camera over a reef. It draws the sea floor that it sees and keeps the latest of it, at most 50 MB.
#[derive(Clone, Debug)]
pub struct ReefCamera {
    reef: Reef,
    metres_per_pixel: f64,
    tiles: Tiles,
}

impl ReefCamera {
    /// A camera whose pixels measure `metres_per_pixel` on the sea floor, at least a millimetre.
    #[must_use]
    pub fn new(reef: Reef, metres_per_pixel: f64) -> Self {
        let metres_per_pixel = metres_per_pixel.max(0.001);
        Self { reef, metres_per_pixel, tiles: Tiles::new((metres_per_pixel * BLUR) as f32) }
    }

    #[must_use]
    pub fn reef(&self) -> &Reef {
        &self.reef
    }

    /// The frame of a view: the same reef and view give the same frame, bit for bit.
    pub fn frame(&mut self, view: &View) -> RgbImage {
        let optics = Optics::new(view, self.metres_per_pixel, &self.reef);
        let mut image = RgbImage::new(view.width_px, view.height_px);
        let mut above = vec![[0.0; 3]; view.width_px as usize];
        self.look(view, |v, row| {
            let line = &mut image.as_mut()[3 * v * row.len()..][..3 * row.len()];
            optics.expose(v, row, &mut above, line.as_chunks_mut().0);
        });
        optics::render_colour(&mut image, self.reef.water.saturation);
        image
    }

    /// The view as if there were no water, light, snow and noise of the camera, as display values.
    pub fn clear_frame(&mut self, view: &View) -> RgbImage {
        let mut light = Vec::with_capacity(view.width_px as usize * view.height_px as usize);
        self.look(view, |_, row| light.extend_from_slice(row));
        optics::develop(&light, view.width_px, view.height_px)
    }

    /// Calls `see` with each row of pixels from the top: its number and the light of the sea floor.
    fn look(&mut self, view: &View, mut see: impl FnMut(usize, &[Colour])) {
        let pitch = f64::from(self.tiles.pitch_m());
        let (width, height) = (view.width_px, view.height_px);
        let (half_w, half_h) = (f64::from(width) / 2.0, f64::from(height) / 2.0);
        // From pixels to nodes.
        let (sin, cos) = view.heading_rad.sin_cos();
        let (sin, cos) = (sin * self.metres_per_pixel / pitch, cos * self.metres_per_pixel / pitch);
        let reach = |a: f64, b: f64| (half_w * a.abs() + half_h * b.abs()).ceil() as i32 + 2;
        let (reach_x, reach_y) = (reach(cos, sin), reach(sin, cos));
        let (sin, cos) = (sin as f32, cos as f32);
        // Nodes are half a pitch from the lines between them.
        let (cx, cy) = (view.x_m / pitch - 0.5, view.y_m / pitch - 0.5);
        let (nx, ny) = (cx.floor(), cy.floor());
        let (at_x, at_y) = (nx as i32, ny as i32);
        let window =
            self.tiles.window(&self.reef, [at_x - reach_x, at_y - reach_y], [at_x + reach_x + 1, at_y + reach_y + 1]);
        let window = window.seen_from(at_x, at_y);
        let (fx, fy) = ((cx - nx) as f32, (cy - ny) as f32);
        let mut line = vec![[0.0; 3]; width as usize];
        for v in 0..height {
            let ahead = (half_h - f64::from(v) - 0.5) as f32;
            let (x, y) = (fx + sin * ahead, fy + cos * ahead);
            for (u, light) in line.iter_mut().enumerate() {
                let right = u as f32 + 0.5 - half_w as f32;
                *light = window.at(x + cos * right, y - sin * right);
            }
            see(v as usize, &line);
        }
    }
}
