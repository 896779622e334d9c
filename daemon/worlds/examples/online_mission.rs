//! A survey of a procedural sea floor: each frame is labelled as it arrives, and a power cut in the middle costs no label.
//!
//! `cargo run -p scenecast-worlds --example online_mission`

use std::error::Error;

use scene_model::publish::PublishedCell;
use scene_model::{DownCamera, LabelBook, Pose, SceneConfig, SceneModel, WordConfig, WordExtractor, vocabulary};
use scenecast_worlds::{Patches, patches};

const FRAMES: u32 = 48;
/// The words to resample after each frame: about a millisecond on one core.
const WORDS_PER_FRAME: u64 = 30_000;

/// The state that a vehicle has to keep through a restart.
struct Mapper {
    extractor: WordExtractor,
    model: SceneModel,
    book: LabelBook,
}

impl Mapper {
    /// Labels one frame: four lines of twelve frames, 1 m between frames and 2 m between lines.
    fn see(&mut self, world: &Patches, frame: u32) -> Vec<PublishedCell> {
        let (left, top) = (frame % 12 * 100, frame / 12 * 200);
        let image = image::imageops::crop_imm(&world.image, left, top, 320, 240).to_image();
        let words = self.extractor.extract(&image, 25.0);
        let pose = Pose { x: f64::from(left) * 0.01, y: -f64::from(top) * 0.01, z: -12.0, yaw_rad: 0.0 };
        let camera = DownCamera { metres_per_pixel: 0.01, altitude_m: 3.0 };
        self.model.insert(f64::from(frame) * 2.0, &camera.project(320, 240, &pose, &words));
        self.model.refine(WORDS_PER_FRAME);
        self.book.publish(&self.model.label_map())
    }

    fn checkpoint(&self) -> Result<[Vec<u8>; 3], postcard::Error> {
        Ok([vocabulary::save(&self.extractor.measures()), self.model.save(), postcard::to_allocvec(&self.book)?])
    }

    fn restore([measures, model, book]: &[Vec<u8>; 3]) -> Result<Self, Box<dyn Error>> {
        let extractor = WordExtractor::from_measures(vocabulary::load(measures)?);
        Ok(Self { extractor, model: SceneModel::load(model)?, book: postcard::from_bytes(book)? })
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let world = patches(11, 1450, 850, 110, 6);
    let model = SceneModel::new(SceneConfig { cell_m: [0.25, 0.25, 1e4], seed: 3, ..SceneConfig::for_images() })?;
    let extractor = WordExtractor::new(&WordConfig::default());
    let mut mapper = Mapper { extractor, model, book: LabelBook::new(0) };
    let mut checkpoint = mapper.checkpoint()?;
    let mut map = Vec::new();
    println!("time   cells   words  topics  labels  perplexity");
    for frame in 0..FRAMES {
        map = mapper.see(&world, frame);
        if frame % 8 == 7 {
            let (model, labels) = (&mapper.model, mapper.book.labels().count());
            let (cells, words, perplexity) = (model.cells(), model.words(), model.perplexity());
            println!("{:3} s {cells:6} {words:7} {:7} {labels:7} {perplexity:11.0}", frame * 2 + 2, model.labels());
        }
        if frame == FRAMES / 2 {
            checkpoint = mapper.checkpoint()?;
        }
    }
    // The power is cut: a new process loads the last checkpoint and sees the rest of the survey once more.
    let bytes: usize = checkpoint.iter().map(Vec::len).sum();
    let mut restarted = Mapper::restore(&checkpoint)?;
    let again = (FRAMES / 2 + 1..FRAMES).map(|frame| restarted.see(&world, frame)).last().unwrap_or_default();
    let is_equal = restarted.model.save() == mapper.model.save();
    println!("restarted from {bytes} bytes of {} s; all words have the same labels: {is_equal}", FRAMES + 2);
    let differ = map.iter().filter(|cell| !again.contains(cell)).count();
    println!("{differ} of {} published cells differ: the first map after a restart evaluates all cells", map.len());
    Ok(())
}
