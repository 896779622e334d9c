//! Calibrations in the YAML that ROS writes (`camera_calibration`, `camera_calibration_parsers`), and the topic `camera_info`,
//! where it publishes them.

use crate::MAX_PIXELS;
use scenecast_messages::sensor_msgs::CameraInfo;

/// A file that is no calibration: the line, counted from 1, and the cause.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{line}: {cause}")]
pub struct CalibrationFileError {
    line: usize,
    cause: CalibrationFileFault,
}

#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
enum CalibrationFileFault {
    #[error("{name} is {text:?}; expected a number of pixels")]
    Pixels { name: String, text: String },
    #[error("{text:?} in {key} is no number")]
    Number { key: String, text: String },
    #[error("{key} has more than {MAX_NUMBERS} numbers")]
    TooMany { key: String },
    #[error("{key} has {found} numbers; expected {expected}")]
    Count { key: String, found: usize, expected: usize },
    #[error("there is no camera_matrix with its data")]
    NoMatrix,
}

/// Most numbers of a matrix.
const MAX_NUMBERS: usize = 64;

/// Reads `image_width`, `image_height`, `distortion_model`, and the `data` of `camera_matrix`, `distortion_coefficients`,
/// `rectification_matrix` and `projection_matrix`. Lists are `[a, b]`, also over several lines, or lines of `- a`. Other keys
/// are ignored.
///
/// # Errors
/// A value that is no number, or a matrix of another size.
pub fn read_calibration(text: &str) -> Result<CameraInfo, CalibrationFileError> {
    let mut reader = Reader::default();
    for (index, line) in text.lines().enumerate() {
        reader.handle_line(line).map_err(|cause| CalibrationFileError { line: index + 1, cause })?;
    }
    let line = text.lines().count();
    reader.finish().map_err(|cause| CalibrationFileError { line, cause })
}

#[derive(Default)]
struct Reader {
    info: CameraInfo,
    /// The key at the left margin.
    key: String,
    /// Numbers of the list that is open, and whether its bracket is.
    list: Option<(Vec<f64>, bool)>,
    has_matrix: bool,
}

impl Reader {
    fn handle_line(&mut self, line: &str) -> Result<(), CalibrationFileFault> {
        let line = line.split(" #").next().unwrap_or_default();
        let text = line.trim();
        if text.is_empty() || text.starts_with('#') || text.starts_with("---") || text.starts_with('%') {
            return Ok(());
        }
        if self.list.as_ref().is_some_and(|(_, is_open)| *is_open) {
            return self.handle_numbers(text);
        }
        if let Some(item) = text.strip_prefix("- ").filter(|_| self.list.is_some()) {
            return self.push(item.trim());
        }
        self.end_list()?;
        let Some((name, value)) = text.split_once(':') else { return Ok(()) };
        let (name, value) = (name.trim(), value.trim());
        if line.starts_with([' ', '\t']) {
            if name == "data" {
                self.list = Some((Vec::new(), value.starts_with('[')));
                return if value.is_empty() { Ok(()) } else { self.handle_numbers(value.trim_start_matches('[')) };
            }
            return Ok(());
        }
        self.key = name.to_owned();
        match name {
            "image_width" => self.info.width = pixels(name, value)?,
            "image_height" => self.info.height = pixels(name, value)?,
            "distortion_model" => self.info.distortion_model = value.trim_matches(['"', '\'']).to_owned(),
            _ => {}
        }
        Ok(())
    }

    /// Numbers of a list in brackets.
    fn handle_numbers(&mut self, text: &str) -> Result<(), CalibrationFileFault> {
        let (numbers, is_end) = text.split_once(']').map_or((text, false), |(numbers, _)| (numbers, true));
        for number in numbers.split(',').map(str::trim).filter(|number| !number.is_empty()) {
            self.push(number)?;
        }
        if is_end { self.end_list() } else { Ok(()) }
    }

    fn push(&mut self, text: &str) -> Result<(), CalibrationFileFault> {
        let key = || self.key.clone();
        let number = text.parse();
        let number: f64 = number.map_err(|_| CalibrationFileFault::Number { key: key(), text: text.to_owned() })?;
        let Some((numbers, _)) = &mut self.list else { return Ok(()) };
        if numbers.len() >= MAX_NUMBERS {
            return Err(CalibrationFileFault::TooMany { key: key() });
        }
        numbers.push(number);
        Ok(())
    }

    fn end_list(&mut self) -> Result<(), CalibrationFileFault> {
        let Some((numbers, _)) = self.list.take() else { return Ok(()) };
        let (key, found) = (self.key.clone(), numbers.len());
        let wrong = |expected| CalibrationFileFault::Count { key, found, expected };
        match self.key.as_str() {
            "camera_matrix" => {
                self.info.k = numbers.as_slice().try_into().map_err(|_| wrong(9))?;
                self.has_matrix = true;
            }
            "rectification_matrix" => self.info.r = numbers.as_slice().try_into().map_err(|_| wrong(9))?,
            "projection_matrix" => self.info.p = numbers.as_slice().try_into().map_err(|_| wrong(12))?,
            "distortion_coefficients" => self.info.d = numbers,
            _ => {}
        }
        Ok(())
    }

    fn finish(mut self) -> Result<CameraInfo, CalibrationFileFault> {
        self.end_list()?;
        match self.has_matrix {
            true => Ok(self.info),
            false => Err(CalibrationFileFault::NoMatrix),
        }
    }
}

fn pixels(name: &str, text: &str) -> Result<u32, CalibrationFileFault> {
    let number = text.parse().ok().filter(|number| (1..=MAX_PIXELS).contains(number));
    number.ok_or_else(|| CalibrationFileFault::Pixels { name: name.to_owned(), text: text.to_owned() })
}

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
    use proptest::prelude::*;

    const FILE: &str = "\
image_width: 640
image_height: 480
camera_name: narrow_stereo
camera_matrix:
  rows: 3
  cols: 3
  data: [438.783367, 0.0, 305.593336,
         0.0, 437.302876, 243.738352, 0.0, 0.0, 1.0]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [-0.361976, 0.110510, 0.001014, 0.000505, 0.0]
rectification_matrix:
  data:
  - 1
  - 0
  - 0
  - 0
  - 1
  - 0
  - 0
  - 0
  - 1
projection_matrix:
  rows: 3
  cols: 4
  data: [393.653800, 0.0, 322.797939, 0.0, 0.0, 393.653800, 241.090902, 0.0, 0.0, 0.0, 1.0, 0.0]
";

    #[test]
    fn the_file_of_a_calibration_is_read() {
        let info = read_calibration(FILE).unwrap();
        assert_eq!((info.width, info.height, info.distortion_model.as_str()), (640, 480, "plumb_bob"));
        assert_eq!((info.k[0], info.k[5], info.d[1]), (438.783367, 243.738352, 0.110510));
        assert_eq!((info.r[8], info.p[6]), (1.0, 241.090902));
        assert!(crate::Calibration::of_info(&info, false).is_ok());
    }

    #[test]
    fn errors_name_the_line() {
        let text = |from: &str, to: &str| read_calibration(&FILE.replace(from, to)).unwrap_err().to_string();
        assert_eq!(
            text("image_width: 640", "image_width: wide"),
            "1: image_width is \"wide\"; expected a number of pixels"
        );
        assert_eq!(text("437.302876", "x"), "8: \"x\" in camera_matrix is no number");
        assert_eq!(text(", 0.0, 0.0, 1.0]", ", 0.0, 0.0]"), "8: camera_matrix has 8 numbers; expected 9");
        assert!(text("camera_matrix", "matrix").contains("there is no camera_matrix"));
    }

    proptest! {
        #[test]
        fn any_text_is_a_calibration_or_an_error(text in "(camera_matrix:\n|  data: \\[|[0-9., \\]\n-]{0,9}|- 1\n|.{0,9}\n){0,30}") {
            let _ = read_calibration(&text);
        }
    }

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
