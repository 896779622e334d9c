//! `sensor_msgs/msg/Image` of classes.

use super::time;
use crate::{Content, Item, Raster, Refusal};
use scenecast_messages::sensor_msgs::Image;
use scenecast_protocol::map::MAX_CLASS;

/// A segmented image without a pose: the value of a pixel of `mono8` or `8UC1` is its class, 255 is unknown.
///
/// # Errors
///
/// Another encoding, sizes that contradict each other, class 254.
pub fn item_of_image(image: &Image) -> Result<Item, Refusal> {
    if !matches!(image.encoding.as_str(), "mono8" | "8UC1") {
        let text = format!("the encoding {:?}: mono8 and 8UC1 are taken, whose value is the class", image.encoding);
        return Err(Refusal::Message(text));
    }
    let (width, height, step) = (image.width, image.height, image.step as usize);
    Raster::<u8>::check(width, height)?;
    let needed = (height as usize - 1).checked_mul(step).and_then(|bytes| bytes.checked_add(width as usize));
    if step < width as usize || needed.is_none_or(|needed| image.data.len() < needed) {
        return Err(Refusal::RawLength(image.data.len(), width, height));
    }
    let rows = image.data.chunks(step).take(height as usize);
    let values: Vec<u8> = rows.flat_map(|row| row.iter().take(width as usize)).copied().collect();
    if let Some(&class) = values.iter().find(|&&class| class > MAX_CLASS && class != u8::MAX) {
        return Err(Refusal::Class(class));
    }
    let classes = Raster { width, height, values };
    let content = Content::Image { pose: None, metres_per_pixel: None, classes };
    Ok(Item { time: time(&image.header), classes: Vec::new(), content })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ItemTime;
    use scenecast_messages::builtin_interfaces::Time;

    #[test]
    fn rows_with_padding_become_a_raster() {
        let mut image = Image { height: 2, width: 2, encoding: "mono8".to_owned(), step: 3, ..Image::default() };
        image.header.stamp = Time::from_nanos(1_700_000_000_500_000_000);
        image.data = vec![1, 255, 99, 3, 4];
        let item = item_of_image(&image).unwrap();
        assert_eq!(item.time, ItemTime::Unix(1_700_000_000.5));
        assert!(
            matches!(&item.content, Content::Image { classes, pose: None, .. } if classes.values == [1, 255, 3, 4])
        );
        let said = |image: &Image| item_of_image(image).unwrap_err().to_string();
        assert!(said(&Image { encoding: "rgb8".to_owned(), ..image.clone() }).contains("\"rgb8\": mono8"));
        assert!(said(&Image { step: 1, ..image.clone() }).contains("not those of 2 x 2"));
        assert!(said(&Image { step: u32::MAX, ..image.clone() }).contains("not those"));
        assert!(said(&Image { height: 0, ..image.clone() }).contains("2 x 0"));
        image.data[4] = 254;
        assert!(said(&image).contains("class 254"));
    }
}
