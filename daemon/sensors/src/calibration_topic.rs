//! Where ROS publishes the calibration of a camera.

/// The topic `camera_info` in the namespace of a topic of images, and whether these are rectified by their name, as those of
/// `image_proc`.
pub fn camera_info_beside(images: &str) -> (String, bool) {
    let images = images.strip_suffix("/compressed").unwrap_or(images);
    let (namespace, name) = images.rsplit_once('/').unwrap_or(("", images));
    let topic = if namespace.is_empty() && !images.starts_with('/') { String::new() } else { format!("{namespace}/") };
    (format!("{topic}camera_info"), name.starts_with("image_rect"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_calibration_is_beside_the_images() {
        for (images, info, is_rectified) in [
            ("/camera/image_raw", "/camera/camera_info", false),
            ("/stereo/left/image_rect_color/compressed", "/stereo/left/camera_info", true),
            ("/image", "/camera_info", false),
            ("image_rect", "camera_info", true),
        ] {
            assert_eq!(camera_info_beside(images), (info.to_owned(), is_rectified), "{images}");
        }
    }
}
