//! A picture that `plotters` draws on, with letters that need no font file.

use embedded_graphics::mono_font::{MonoTextStyle, ascii::FONT_9X18_BOLD};
use embedded_graphics::pixelcolor::BinaryColor;
use embedded_graphics::prelude::{DrawTarget, OriginDimensions, Pixel, Point, Size};
use embedded_graphics::text::Baseline;
use embedded_graphics::text::renderer::TextRenderer;
use image::{ImageFormat, Rgb, RgbImage};
use plotters_backend::text_anchor::{HPos, VPos};
use plotters_backend::{BackendColor, BackendCoord, BackendTextStyle, DrawingBackend, DrawingErrorKind};
use std::convert::Infallible;
use std::io::Cursor;

/// Width of a character and height of a line of text, pixels.
const CHARACTER: (u32, u32) = (9, 18);

type Drawn = Result<(), DrawingErrorKind<Infallible>>;

#[derive(Debug)]
pub struct Raster {
    image: RgbImage,
}

impl Raster {
    pub fn new(width: u32, height: u32) -> Self {
        Self { image: RgbImage::new(width, height) }
    }

    /// The picture as a PNG file.
    pub fn finish(self) -> image::ImageResult<Vec<u8>> {
        let mut png = Cursor::new(Vec::new());
        self.image.write_to(&mut png, ImageFormat::Png)?;
        Ok(png.into_inner())
    }
}

impl DrawingBackend for &mut Raster {
    type ErrorType = Infallible;

    fn get_size(&self) -> (u32, u32) {
        self.image.dimensions()
    }

    fn ensure_prepared(&mut self) -> Drawn {
        Ok(())
    }

    fn present(&mut self) -> Drawn {
        Ok(())
    }

    fn draw_pixel(&mut self, (x, y): BackendCoord, colour: BackendColor) -> Drawn {
        let place = u32::try_from(x).ok().zip(u32::try_from(y).ok());
        if let Some(pixel) = place.and_then(|(x, y)| self.image.get_pixel_mut_checked(x, y)) {
            let (r, g, b) = colour.rgb;
            for (value, ink) in pixel.0.iter_mut().zip([r, g, b]) {
                *value = (f64::from(*value) + (f64::from(ink) - f64::from(*value)) * colour.alpha).round() as u8;
            }
        }
        Ok(())
    }

    fn draw_text<S: BackendTextStyle>(&mut self, text: &str, style: &S, at: BackendCoord) -> Drawn {
        let (width, height) = self.estimate_text_size(text, style)?;
        let left = match style.anchor().h_pos {
            HPos::Left => at.0,
            HPos::Center => at.0 - width as i32 / 2,
            HPos::Right => at.0 - width as i32,
        };
        let top = match style.anchor().v_pos {
            VPos::Top => at.1,
            VPos::Center => at.1 - height as i32 / 2,
            VPos::Bottom => at.1 - height as i32,
        };
        let (r, g, b) = style.color().rgb;
        let mut page = TextPage { image: &mut self.image, ink: Rgb([r, g, b]) };
        let font = MonoTextStyle::new(&FONT_9X18_BOLD, BinaryColor::On);
        let Ok(_) = font.draw_string(text, Point::new(left, top), Baseline::Top, &mut page);
        Ok(())
    }

    fn estimate_text_size<S: BackendTextStyle>(
        &self,
        text: &str,
        _: &S,
    ) -> Result<(u32, u32), DrawingErrorKind<Infallible>> {
        Ok((text.chars().count() as u32 * CHARACTER.0, CHARACTER.1))
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
