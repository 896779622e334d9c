//! Exemplars as `sensor_msgs/msg/CompressedImage`.

use image::codecs::jpeg::JpegEncoder;
use scenecast_messages::sensor_msgs::CompressedImage;
use scenecast_messages::std_msgs::Header;

/// Quality of the JPEG, of 100: it costs no acoustic bits.
const QUALITY: u8 = 90;
/// The longest edge of an exemplar, pixels.
const MAX_EDGE: u32 = 1024;

/// A JPEG of an exemplar, since viewers and `image_transport` read no WebP. `None` if the bytes are no WebP without
/// transparency, or the image is larger than any exemplar.
pub fn exemplar_jpeg(webp: &[u8], header: Header) -> Option<CompressedImage> {
    let features = webp::BitstreamFeatures::new(webp)?;
    if features.width().max(features.height()) > MAX_EDGE {
        return None;
    }
    let decoded = webp::Decoder::new(webp).decode().filter(|image| !image.is_alpha())?;
    let mut data = Vec::new();
    let encoder = JpegEncoder::new_with_quality(&mut data, QUALITY);
    image::ImageEncoder::write_image(
        encoder,
        &decoded,
        decoded.width(),
        decoded.height(),
        image::ExtendedColorType::Rgb8,
    )
    .ok()?;
    Some(CompressedImage { header, format: "jpeg".to_owned(), data })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_exemplar_becomes_a_jpeg_of_the_same_colours() {
        let pixels: Vec<u8> = [200, 100, 50].repeat(32 * 16);
        let webp = webp::Encoder::from_rgb(&pixels, 32, 16).encode(80.0);
        let message = exemplar_jpeg(&webp, Header::default()).unwrap();
        assert_eq!(message.format, "jpeg");
        let again = image::load_from_memory_with_format(&message.data, image::ImageFormat::Jpeg).unwrap().to_rgb8();
        assert_eq!(again.dimensions(), (32, 16));
        let close = |a: u8, b: u8| a.abs_diff(b) <= 12;
        assert!(again.pixels().all(|p| close(p[0], 200) && close(p[1], 100) && close(p[2], 50)));
        assert_eq!(exemplar_jpeg(b"no image", Header::default()), None);
        assert_eq!(exemplar_jpeg(&webp[..webp.len() / 2], Header::default()), None);
    }
}
