//! `scenecast vocabulary`

use crate::annotated_images::{AnnotatedCells, pairs};
use crate::progress::Progress;
use clap::{Args, Subcommand};
use image::RgbImage;
use scene_model::words::{Measures, WordConfig, WordExtractor};
use scenecast_core::{UserError, errln, outln};
use scenecast_files::read_image;
use scenecast_files::write_whole;
use scenecast_worlds::scoring::{ClassStatistics, MIN_CLASS_CELLS, train_vocabulary};
use std::cell::RefCell;
use std::path::{Path, PathBuf};

/// Train the vocabulary that turns images into visual words.
#[derive(Debug, Subcommand)]
pub enum Vocabulary {
    Train(Train),
}

/// Train a vocabulary on images, annotated images, or both
///
/// From --images, a vocabulary learns the typical tones and the spread of colours and textures, to which visual words are
/// related. Use images of a similar site, with the same camera and light. Words then have the same meaning in every
/// mission from its first frame. Without them, tones and spread adapt to the first frames of each mission, as those of the
/// built-in vocabulary do. Images named *_label are skipped.
///
/// From --annotations, it learns in which directions the annotated classes differ, and adds 256 words for places along
/// these directions, about nine in a cell. Each NAME_label.png (grey or indexed, pixel value = class) belongs to the image
/// NAME.jpg, .png or .tif of the same size; a class has the same number in all images. Each image is compared with its own
/// tones and spread. Classes with fewer than 20 cells are left out; at least two classes must remain.
///
/// Set scene.vocabulary of the vehicle to the file, or use scenecast scene run --vocabulary.
#[derive(Debug, Args)]
#[command(after_help = "Example: scenecast vocabulary train --images last-dive --out reef.vocabulary
Example: scenecast vocabulary train --annotations annotated-reefs --out reef.vocabulary")]
#[command(group(clap::ArgGroup::new("source").required(true).multiple(true).args(["images", "annotations"])))]
pub struct Train {
    /// Folder of PNG, JPEG or TIFF images
    #[arg(long, value_name = "DIR")]
    images: Option<PathBuf>,
    /// Folder of images with NAME_label.png beside them
    #[arg(long, value_name = "DIR")]
    annotations: Option<PathBuf>,
    /// Classes of annotations that are ignored, separated by commas
    #[arg(long, value_name = "CLASSES", value_delimiter = ',', default_value = "255", requires = "annotations")]
    ignore: Vec<u8>,
    /// Edge of a map cell in pixels of the images
    #[arg(long, value_name = "PIXELS", default_value_t = 25.0, allow_negative_numbers = true)]
    cell_px: f32,
    /// Vocabulary file to write, replaced if it exists
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

impl Vocabulary {
    pub fn run(self) -> Result<(), UserError> {
        match self {
            Self::Train(train) => train.run(),
        }
    }
}

impl Train {
    fn run(self) -> Result<(), UserError> {
        if !(4.0..=1000.0).contains(&self.cell_px) {
            return Err(UserError::Input(format!("--cell-px {}: it takes 4 to 1000 pixels", self.cell_px)));
        }
        let mut sources = Vec::new();
        let mut measures = WordExtractor::new(&WordConfig::default()).measures();
        if let Some(dir) = &self.images {
            let files = images_of(dir)?;
            measures = self.measures(&files)?;
            sources.push(format!("{} images", files.len()));
        }
        if let Some(dir) = &self.annotations {
            let (statistics, images) = self.statistics(dir)?;
            for (class, cells) in statistics.rare_classes() {
                errln!(
                    "scenecast: class {class} is left out: {cells} annotated cells, at least {MIN_CLASS_CELLS} are needed"
                );
            }
            let discriminant = statistics.discriminant().map_err(|e| UserError::file(dir, e))?;
            measures = measures.with_discriminant(Some(discriminant));
            sources.push(format!("{images} annotated images with {} classes", statistics.usable_classes()));
        }
        write_whole(&self.out, &scene_model::vocabulary::save(&measures))?;
        outln!("{}: {} words from {}", self.out.display(), measures.vocabulary_size(), sources.join(" and "));
        Ok(())
    }

    /// The tones, means and deviations of a set of images.
    fn measures(&self, files: &[PathBuf]) -> Result<Measures, UserError> {
        let error = RefCell::new(None);
        let progress = RefCell::new((Progress::new("vocabulary"), 0));
        let read = |file: &PathBuf| {
            let (shown, count) = &mut *progress.borrow_mut();
            *count += 1;
            shown.show(f64::from(*count) / (2 * files.len()) as f64);
            let image = read_usable(file, self.cell_px);
            image.map_err(|e| *error.borrow_mut() = Some(e)).ok().map(|image| (image, self.cell_px))
        };
        // The first unreadable image ends the training.
        let measures = train_vocabulary(&WordConfig::default(), || files.iter().map_while(read));
        error.into_inner().map_or(Ok(measures), Err)
    }

    /// The statistics of the classes of a folder, and the number of its annotated images.
    fn statistics(&self, dir: &Path) -> Result<(ClassStatistics, usize), UserError> {
        let pairs = pairs(dir)?;
        let (mut statistics, mut progress) = (ClassStatistics::default(), Progress::new("annotations"));
        for (index, pair) in pairs.iter().enumerate() {
            let cells = pair.read_cells(|_| self.cell_px, &self.ignore)?;
            let AnnotatedCells { image, cell_px, annotations } = cells;
            statistics.add(&ClassStatistics::of(&image, cell_px, &annotations));
            progress.show((index + 1) as f64 / pairs.len() as f64);
        }
        Ok((statistics, pairs.len()))
    }
}

fn read_usable(file: &Path, cell_px: f32) -> Result<RgbImage, UserError> {
    let image = read_image(file)?.to_rgb8();
    let (width, height) = image.dimensions();
    if (width.min(height) as f32) < cell_px {
        return Err(UserError::file(file, format!("{width} x {height} pixels are less than a cell of {cell_px}")));
    }
    Ok(image)
}

/// The images of a folder, sorted by name.
fn images_of(dir: &Path) -> Result<Vec<PathBuf>, UserError> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(dir).map_err(|e| UserError::file(dir, e))? {
        let path = entry.map_err(|e| UserError::file(dir, e))?.path();
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
        let is_label = path.file_stem().is_some_and(|stem| stem.to_string_lossy().ends_with("_label"));
        if ["png", "jpg", "jpeg", "tif", "tiff"].contains(&extension.as_str()) && !is_label {
            files.push(path);
        }
    }
    if files.is_empty() {
        return Err(UserError::file(dir, "no PNG, JPEG or TIFF image"));
    }
    files.sort();
    Ok(files)
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{GrayImage, Luma};
    use scenecast_worlds::patches;

    /// A folder with two annotated images of a drawn sea floor; `class` changes the classes.
    fn folder(name: &str, class: fn(u8) -> u8) -> PathBuf {
        let dir = std::env::temp_dir().join(format!("scenecast-{}-annotated-{name}", std::process::id()));
        let _ = std::fs::remove_dir_all(&dir);
        std::fs::create_dir_all(&dir).unwrap();
        for seed in 1..3 {
            let world = patches(seed, 240, 160, 60, 4);
            let classes = GrayImage::from_fn(240, 160, |x, y| Luma([class(world.truth[(y * 240 + x) as usize])]));
            world.image.save(dir.join(format!("{seed}.png"))).unwrap();
            classes.save(dir.join(format!("{seed}_label.png"))).unwrap();
        }
        dir
    }

    fn train(dir: &Path, images: bool) -> Result<Vec<u8>, String> {
        let out = dir.join("out.vocabulary");
        let images = images.then(|| dir.to_owned());
        let (annotations, ignore) = (Some(dir.to_owned()), vec![255]);
        let train = Train { images, annotations, ignore, cell_px: 12.0, out: out.clone() };
        train.run().map_err(|e| e.to_string())?;
        Ok(std::fs::read(out).unwrap())
    }

    #[test]
    fn annotations_add_the_same_words_each_time() {
        let dir = folder("words", |class| class);
        let bytes = train(&dir, false).unwrap();
        let vocabulary = scene_model::vocabulary::load(&bytes).unwrap();
        assert_eq!(vocabulary.vocabulary_size(), vocabulary.config().vocabulary_size() + 256);
        assert!(!vocabulary.are_frozen());
        assert_eq!(train(&dir, false).unwrap(), bytes);
        let both = scene_model::vocabulary::load(&train(&dir, true).unwrap()).unwrap();
        assert!(both.are_frozen() && both.discriminant() == vocabulary.discriminant());
    }

    #[test]
    fn unusable_annotations_are_refused_with_their_file() {
        let refusal = |dir: &Path| train(dir, false).unwrap_err();
        let one = refusal(&folder("one", |_| 7));
        assert!(one.contains("annotated-one: class 7 has") && one.contains("at least two classes with 20"), "{one}");
        let ignored = refusal(&folder("ignored", |_| 255));
        assert!(ignored.contains("1_label.png: no pixel is annotated"), "{ignored}");
        let dir = folder("size", |class| class);
        GrayImage::new(50, 40).save(dir.join("2_label.png")).unwrap();
        assert!(refusal(&dir).contains("2_label.png: the annotations have 50 x 40 pixels, the image has 240 x 160"));
        std::fs::remove_file(dir.join("1_label.png")).unwrap();
        std::fs::remove_file(dir.join("2_label.png")).unwrap();
        assert!(refusal(&dir).contains("annotated-size: no NAME_label.png"));
    }
}
