//! Images with their annotations in the same folder.

use image::{GrayImage, RgbImage};
use scenecast_core::UserError;
use scenecast_files::{read_classes, read_image};
use scenecast_worlds::scoring::{Annotations, TrialError};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

const SUFFIX: &str = "_label.png";
const EXTENSIONS: [&str; 5] = ["jpg", "jpeg", "png", "tif", "tiff"];

/// The files of an image and of the classes of its pixels.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pair {
    image: PathBuf,
    classes: PathBuf,
}

/// An image and the classes of its pixels, of one size.
pub struct AnnotatedImage {
    pub image: RgbImage,
    pub classes: GrayImage,
}

impl Pair {
    /// The name of the image without its folder and extension.
    pub fn name(&self) -> String {
        self.image.file_stem().unwrap_or_default().to_string_lossy().into_owned()
    }

    pub fn read(&self) -> Result<AnnotatedImage, UserError> {
        let image = read_image(&self.image)?.to_rgb8();
        let (width, height) = image.dimensions();
        let classes = GrayImage::from_raw(width, height, read_classes(&self.classes, (width, height))?)
            .ok_or_else(|| UserError::file(&self.classes, "has another number of pixels than its header states"))?;
        Ok(AnnotatedImage { image, classes })
    }

    /// Reads both, and the annotations of cells of `cell_px` pixels without the classes in `ignore`. At least one cell
    /// must be annotated.
    pub fn read_cells(&self, cell_px: impl Fn(u32) -> f32, ignore: &[u8]) -> Result<AnnotatedCells, UserError> {
        let AnnotatedImage { image, classes } = self.read()?;
        let cell_px = cell_px(image.width());
        let (width, height) = image.dimensions();
        if (width.min(height) as f32) < cell_px {
            let cause = format!("{width} x {height} pixels are less than a cell of {cell_px}");
            return Err(UserError::file(&self.image, cause));
        }
        let annotations = Annotations::new(&classes, (width, height), cell_px, ignore);
        let annotations = annotations.map_err(|e| self.refused(e.into()))?;
        if annotations.cells().is_none() {
            return Err(self.refused(TrialError::NoClasses));
        }
        Ok(AnnotatedCells { image, cell_px, annotations })
    }

    /// The error with the file that it is about.
    pub fn refused(&self, error: TrialError) -> UserError {
        let of_classes = matches!(error, TrialError::Annotations(_) | TrialError::NoClasses);
        UserError::file(if of_classes { &self.classes } else { &self.image }, error)
    }
}

/// An image with the classes of its cells.
pub struct AnnotatedCells {
    pub image: RgbImage,
    /// Edge of a cell, pixels.
    pub cell_px: f32,
    pub annotations: Annotations,
}

/// Every `NAME_label.png` of a folder with the image `NAME`, by name; one without an image or with two is refused.
pub fn pairs(dir: &Path) -> Result<Vec<Pair>, UserError> {
    let mut images: BTreeMap<String, Vec<PathBuf>> = BTreeMap::new();
    let mut labels: BTreeMap<String, PathBuf> = BTreeMap::new();
    for entry in std::fs::read_dir(dir).map_err(|e| UserError::file(dir, e))? {
        let path = entry.map_err(|e| UserError::file(dir, e))?.path();
        let file = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        if let Some(name) = file.strip_suffix(SUFFIX) {
            labels.insert(name.to_owned(), path);
        } else if EXTENSIONS.contains(&extension.as_str()) {
            let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            images.entry(name).or_default().push(path);
        }
    }
    if labels.is_empty() {
        return Err(UserError::file(
            dir,
            "no NAME_label.png; each belongs to an image NAME.jpg, .png or .tif beside it",
        ));
    }
    let pair = |(name, classes): (String, PathBuf)| match images.remove(&name).unwrap_or_default().as_slice() {
        [image] => Ok(Pair { image: image.clone(), classes }),
        [] => Err(UserError::file(&classes, format!("no image {name}.jpg, .png or .tif beside it"))),
        [one, other, ..] => {
            let (one, other) = (one.display(), other.display());
            Err(UserError::file(&classes, format!("two images could be meant: {one} and {other}")))
        }
    };
    labels.into_iter().map(pair).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(name: &str, files: &[&str]) -> PathBuf {
        let dir = std::env::temp_dir().join(format!("scenecast-{}-pairs-{name}", std::process::id()));
        let _ = std::fs::remove_dir_all(&dir);
        std::fs::create_dir_all(&dir).unwrap();
        files.iter().for_each(|file| std::fs::write(dir.join(file), "").unwrap());
        dir
    }

    #[test]
    fn each_annotation_finds_its_image_of_any_format() {
        let files = ["b.TIF", "b_label.png", "a.jpg", "a_label.png", "alone.png", "legend.txt"];
        let found = pairs(&folder("kinds", &files)).unwrap();
        let names: Vec<String> =
            found.iter().map(|pair| pair.image.file_name().unwrap().to_string_lossy().into_owned()).collect();
        assert_eq!(names, ["a.jpg", "b.TIF"]);
    }

    #[test]
    fn an_annotation_without_exactly_one_image_is_refused() {
        let refusal = |name: &str, files: &[&str]| pairs(&folder(name, files)).unwrap_err().to_string();
        assert!(refusal("none", &["a.jpg"]).contains("no NAME_label.png"));
        assert!(refusal("orphan", &["a_label.png"]).contains("a_label.png: no image a.jpg"));
        assert!(refusal("twice", &["a_label.png", "a.jpg", "a.png"]).contains("two images"));
    }
}
