//! How close the label map comes to a known truth: mutual information by the number of sweeps, and against two baselines.
//!
//! `cargo run -p scenecast-worlds --example known_truth`

use std::error::Error;

use image::GrayImage;
use scene_model::topics::FlatCell;
use scene_model::{DownCamera, Pose, SceneConfig, SceneModel, WordConfig, WordExtractor};
use scenecast_worlds::patches;
use scenecast_worlds::scoring::{AnnotatedScene, Method, Trial, mutual_information_nats};

const WIDTH: u32 = 480;
const HEIGHT: u32 = 320;
const CELL_PX: u32 = 10;

fn main() -> Result<(), Box<dyn Error>> {
    let world = patches(6, WIDTH, HEIGHT, 50, 6);
    // The class of the pixel in the middle of a cell; in the map, y grows upwards from the lower edge of the image.
    let truth = |cell: &FlatCell| {
        let (u, v) = (cell.x as u32 * CELL_PX + CELL_PX / 2, HEIGHT - 1 - (cell.y as u32 * CELL_PX + CELL_PX / 2));
        u32::from(world.truth[(v * WIDTH + u) as usize])
    };

    let words = WordExtractor::new(&WordConfig::default()).extract(&world.image, CELL_PX as f32);
    let camera = DownCamera { metres_per_pixel: 1.0 / f64::from(CELL_PX), altitude_m: 0.0 };
    let cells = |px: u32| f64::from(px) / f64::from(CELL_PX);
    let middle = Pose { x: cells(WIDTH) / 2.0, y: cells(HEIGHT) / 2.0, ..Pose::default() };
    let mut model = SceneModel::new(SceneConfig { cell_m: [1.0, 1.0, 1e4], ..SceneConfig::for_images() })?;
    model.insert(0.0, &camera.project(WIDTH, HEIGHT, &middle, &words));

    let entropy = mutual_information_nats(model.label_map().iter().map(|cell| (truth(cell), truth(cell)))).nats;
    println!("{} cells, {} words; entropy of the truth {entropy:.3} nats", model.cells(), model.words());
    println!("sweeps     MI   normalised  labels  perplexity");
    let mut sweeps = 0;
    for more in [1, 2, 7, 20] {
        model.sweep(more);
        sweeps += more;
        let mi = mutual_information_nats(model.label_map().iter().map(|cell| (cell.topic.0, truth(cell))));
        let (labels, perplexity) = (model.labels(), model.perplexity());
        println!("{sweeps:6} {:6.3} {:12.3} {labels:7} {perplexity:11.0}", mi.nats, mi.normalised);
    }

    let classes = GrayImage::from_raw(WIDTH, HEIGHT, world.truth.clone()).ok_or("the truth has another size")?;
    let trial = Trial { labels: 16, cells_across: WIDTH / CELL_PX, sweeps: 30, seeds: 1 };
    let scene = AnnotatedScene::new(trial, &world.image, &classes, &[255])?;
    println!("\nmethod                   MI   null  excess");
    for method in Method::ALL {
        let score = scene.mean_score(method)?;
        let (mi, null) = (score.mutual_information_nats, score.null_mutual_information_nats);
        println!("{:20} {mi:6.3} {null:6.3} {:7.3}", method.name(), score.excess_nats);
    }
    Ok(())
}
