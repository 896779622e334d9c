//! The plot as a PNG.

use super::{Anchor, CHARACTER, Canvas, Colour};
use embedded_graphics::mono_font::{MonoTextStyle, ascii::FONT_9X18_BOLD};
use embedded_graphics::pixelcolor::BinaryColor;
use embedded_graphics::prelude::{DrawTarget, OriginDimensions, Pixel, Point, Size};
use embedded_graphics::text::Baseline;
use embedded_graphics::text::renderer::TextRenderer;
use image::{ImageFormat, Rgb, RgbImage};
use std::convert::Infallible;
use std::io::Cursor;

#[derive(Debug)]
pub struct Raster {
    image: RgbImage,
}

impl Raster {
    pub fn new(width: u32, height: u32) -> Self {
        Self { image: RgbImage::from_pixel(width, height, Rgb([255; 3])) }
    }

    pub fn finish(self) -> image::ImageResult<Vec<u8>> {
        let mut png = Cursor::new(Vec::new());
        self.image.write_to(&mut png, ImageFormat::Png)?;
        Ok(png.into_inner())
    }

    /// Paints the pixels of a box in proportion to their cover by a shape; `depth` is the distance of
    /// a point inside its edge.
    fn shape(&mut self, from: (f64, f64), to: (f64, f64), colour: Colour, depth: impl Fn(f64, f64) -> f64) {
        let pixels = |a: f64, b: f64, length: u32| {
            let low = (a.min(b) - 2.0).clamp(0.0, f64::from(length));
            low as u32..(a.max(b) + 2.0).clamp(0.0, f64::from(length)) as u32
        };
        for y in pixels(from.1, to.1, self.image.height()) {
            for x in pixels(from.0, to.0, self.image.width()) {
                let cover = (depth(f64::from(x) + 0.5, f64::from(y) + 0.5) + 0.5).clamp(0.0, 1.0);
                let pixel = self.image.get_pixel_mut(x, y);
                for (value, ink) in pixel.0.iter_mut().zip(colour) {
                    *value = (f64::from(*value) + (f64::from(ink) - f64::from(*value)) * cover).round() as u8;
                }
            }
        }
    }
}

impl Canvas for Raster {
    fn line(&mut self, from: (f64, f64), to: (f64, f64), width: f64, colour: Colour) {
        let (along, length) = ((to.0 - from.0, to.1 - from.1), (to.0 - from.0).hypot(to.1 - from.1));
        let away = |x: f64, y: f64| {
            let share = ((x - from.0) * along.0 + (y - from.1) * along.1) / (length * length).max(1e-9);
            let share = share.clamp(0.0, 1.0);
            (x - from.0 - share * along.0).hypot(y - from.1 - share * along.1)
        };
        self.shape(from, to, colour, |x, y| width / 2.0 - away(x, y));
    }

    fn disc(&mut self, (x, y): (f64, f64), radius: f64, colour: Colour) {
        let (from, to) = ((x - radius, y - radius), (x + radius, y + radius));
        self.shape(from, to, colour, |u, v| radius - (u - x).hypot(v - y));
    }

    fn ring(&mut self, (x, y): (f64, f64), radius: f64, colour: Colour) {
        let (from, to) = ((x - radius, y - radius), (x + radius, y + radius));
        self.shape(from, to, colour, |u, v| 1.0 - ((u - x).hypot(v - y) - radius).abs());
    }

    fn text(&mut self, (x, y): (f64, f64), anchor: Anchor, colour: Colour, text: &str) {
        let width = text.chars().count() as f64 * CHARACTER.0;
        let left = match anchor {
            Anchor::Start => x,
            Anchor::Middle => x - width / 2.0,
            Anchor::End => x - width,
        };
        let mut page = TextPage { image: &mut self.image, ink: Rgb(colour) };
        let style = MonoTextStyle::new(&FONT_9X18_BOLD, BinaryColor::On);
        let Ok(_) = style.draw_string(text, Point::new(left as i32, y as i32), Baseline::Middle, &mut page);
    }
}

/// The image as a target of the font's pixels.
struct TextPage<'a> {
    image: &'a mut RgbImage,
    ink: Rgb<u8>,
}

impl OriginDimensions for TextPage<'_> {
    fn size(&self) -> Size {
        Size::new(self.image.width(), self.image.height())
    }
}

impl DrawTarget for TextPage<'_> {
    type Color = BinaryColor;
    type Error = Infallible;

    fn draw_iter<I: IntoIterator<Item = Pixel<BinaryColor>>>(&mut self, pixels: I) -> Result<(), Infallible> {
        for Pixel(at, colour) in pixels {
            let place = u32::try_from(at.x).ok().zip(u32::try_from(at.y).ok());
            if let Some(pixel) =
                place.and_then(|(x, y)| self.image.get_pixel_mut_checked(x, y)).filter(|_| colour.is_on())
            {
                *pixel = self.ink;
            }
        }
        Ok(())
    }
}
