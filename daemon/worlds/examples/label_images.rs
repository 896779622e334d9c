//! Labels all images of a folder with one scene model, so that a letter means the same ground in every image.
//!
//! `cargo run -p scenecast-worlds --example label_images -- DIR`; without a folder it labels three procedural sea floors.

use std::collections::BTreeMap;
use std::error::Error;

use image::RgbImage;
use scene_model::topics::FlatCell;
use scene_model::{DownCamera, Pose, SceneConfig, SceneModel, TopicId, WordConfig, WordExtractor};

/// Cells in a row of each image; a cell is a square of 1 m in the model's world.
const COLUMNS: u32 = 48;
/// Distance between the left edges of two images in that world, so that their cells are not neighbours.
const SPACING: i32 = 1000;

fn main() -> Result<(), Box<dyn Error>> {
    let images = match std::env::args().nth(1) {
        Some(folder) => read(&folder)?,
        None => (1..4)
            .map(|seed| (format!("reef {seed}"), scenecast_worlds::patches(seed, 480, 200, 50, 5).image))
            .collect(),
    };
    let mut extractor = WordExtractor::new(&WordConfig::default());
    let config = SceneConfig { cell_m: [1.0, 1.0, 1e4], max_labels: 8, ..SceneConfig::for_images() };
    let mut model = SceneModel::new(config)?;
    for (index, (_, image)) in images.iter().enumerate() {
        let (width, height) = image.dimensions();
        let cell_px = f64::from(width) / f64::from(COLUMNS);
        let words = extractor.extract(image, cell_px as f32);
        // The top left corner of the image lies at (index x SPACING, 0).
        let left = index as f64 * f64::from(SPACING);
        let middle =
            Pose { x: left + f64::from(COLUMNS) / 2.0, y: -f64::from(height) / cell_px / 2.0, ..Pose::default() };
        let camera = DownCamera { metres_per_pixel: 1.0 / cell_px, altitude_m: 0.0 };
        model.insert(index as f64, &camera.project(width, height, &middle, &words));
    }
    model.sweep(30);

    let map = model.label_map();
    let mut areas: BTreeMap<TopicId, usize> = BTreeMap::new();
    map.iter().for_each(|cell| *areas.entry(cell.topic).or_default() += 1);
    let letter = |topic| areas.keys().position(|&other| other == topic).map_or('?', |at| (b'A' + at as u8) as char);
    for (index, (name, _)) in images.iter().enumerate() {
        let of_image: Vec<FlatCell> = map.iter().copied().filter(|cell| cell.x / SPACING == index as i32).collect();
        println!("{name}: {} cells", of_image.len());
        // The map is sorted from south to north; a picture begins in the north.
        for row in of_image.chunk_by(|a, b| a.y == b.y).rev() {
            println!("  {}", row.iter().map(|cell| letter(cell.topic)).collect::<String>());
        }
    }
    for (&topic, cells) in &areas {
        let confidence = map.iter().filter(|cell| cell.topic == topic).map(|cell| cell.confidence).sum::<f32>();
        println!("{}: {cells:5} cells, mean confidence {:.2}", letter(topic), confidence / *cells as f32);
    }
    println!("{} words, perplexity {:.0} of {}", model.words(), model.perplexity(), extractor.vocabulary_size());
    Ok(())
}

fn read(folder: &str) -> Result<Vec<(String, RgbImage)>, Box<dyn Error>> {
    let mut paths: Vec<_> = std::fs::read_dir(folder)?.flatten().map(|entry| entry.path()).collect();
    paths.sort();
    let images = paths.iter().filter_map(|path| {
        let image = image::open(path).ok()?.thumbnail(480, 480).to_rgb8();
        Some((path.file_name()?.to_string_lossy().into_owned(), image))
    });
    Ok(images.collect())
}
