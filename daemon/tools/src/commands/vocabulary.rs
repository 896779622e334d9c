//! `scenecast vocabulary`

use crate::progress::Progress;
use clap::{Args, Subcommand};
use image::RgbImage;
use scene_model::words::WordConfig;
use scenecast_core::UserError;
use scenecast_files::read_image;
use scenecast_files::write_whole;
use scenecast_scoring::train_vocabulary;
use std::cell::RefCell;
use std::path::{Path, PathBuf};

/// Train the vocabulary that turns images into visual words.
#[derive(Debug, Subcommand)]
pub enum Vocabulary {
    Train(Train),
}

/// Train a vocabulary on a folder of images
///
/// A vocabulary holds the typical tones and the spread of colours and textures, to which visual words are related. Use images
/// of a similar site, with the same camera and light. Words then have the same meaning in every mission from its first frame.
/// The built-in vocabulary adapts to the first frames of each mission instead. Set scene.vocabulary of the vehicle to the
/// file, or use scenecast scene run --vocabulary. Images named *_label are skipped.
#[derive(Debug, Args)]
#[command(after_help = "Example: scenecast vocabulary train --images last-dive --out reef.vocabulary")]
pub struct Train {
    /// Folder of PNG, JPEG or TIFF images
    #[arg(long, value_name = "DIR")]
    images: PathBuf,
    /// Edge of a map cell in pixels of the images
    #[arg(long, value_name = "PIXELS", default_value_t = 25.0, allow_negative_numbers = true)]
    cell_px: f32,
    /// File to write
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
        let files = images_of(&self.images)?;
        let problem = RefCell::new(None);
        let progress = RefCell::new((Progress::new("vocabulary"), 0));
        let read = |file: &PathBuf| {
            let (shown, count) = &mut *progress.borrow_mut();
            *count += 1;
            shown.show(f64::from(*count) / (2 * files.len()) as f64);
            let image = read_usable(file, self.cell_px);
            image.map_err(|e| *problem.borrow_mut() = Some(e)).ok().map(|image| (image, self.cell_px))
        };
        // The first image that cannot be read ends the work.
        let measures = train_vocabulary(&WordConfig::default(), || files.iter().map_while(read));
        drop(progress);
        if let Some(problem) = problem.into_inner() {
            return Err(problem);
        }
        let bytes = scene_model::vocabulary::save(&measures);
        write_whole(&self.out, &bytes)?;
        let words = measures.config().vocabulary_size();
        println!("{}: {words} words from {} images", self.out.display(), files.len());
        Ok(())
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

/// The images of a folder by name.
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
