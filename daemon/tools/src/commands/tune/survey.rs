//! The mosaic with its annotations, and a virtual survey over it.

use crate::scene::{FrameContent, Look};
use image::{GrayImage, RgbImage};
use scene_model::project::{DownCamera, Observation, Pose};
use scene_model::topics::{Birth, SceneConfig};
use scene_model::words::{WordConfig, WordExtractor};
use scenecast_config::{BirthRule, Config, SceneLabels, WorldKind};
use scenecast_core::UserError;
use scenecast_core::tuning_table::Setting;
use scenecast_files::{read_classes, read_image};
use scenecast_worlds::Reef;
use scenecast_worlds::scoring::{Annotations, mosaic_classes};
use std::path::Path;

/// Minimum overlap of neighbouring frames and lines, as a share of a frame's edge.
const MIN_OVERLAP: f64 = 0.1;
/// Maximum number of words of a survey: 1.5 GB of memory.
const MAX_WORDS: f64 = 1e8;
const MIN_PX: u32 = 64;
/// Width and height of a sea floor of patches, and the approximate size of the patches, pixels.
const PATCHES_PX: (u32, u32, u32) = (2600, 1800, 100);

/// The inputs that all settings share.
pub struct Site<'a> {
    image: RgbImage,
    classes: GrayImage,
    ignore: &'a [u8],
    pub(super) config: &'a Config,
    crc: u32,
}

impl<'a> Site<'a> {
    pub fn load(mosaic: &Path, annotations: &Path, ignore: &'a [u8], config: &'a Config) -> Result<Self, UserError> {
        let image = read_image(mosaic)?.to_rgb8();
        let (width, height) = image.dimensions();
        if width.min(height) < MIN_PX {
            let cause = format!("the image has {width} x {height} pixels; a mosaic needs at least 64 x 64");
            return Err(UserError::file(mosaic, cause));
        }
        let classes = read_classes(annotations, image.dimensions())?;
        if classes.iter().all(|class| ignore.contains(class)) {
            return Err(UserError::file(annotations, "no pixel is annotated with a class that counts (see --ignore)"));
        }
        let sum = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
        let mut digest = sum.digest();
        digest.update(image.as_raw());
        digest.update(&classes);
        let classes = GrayImage::from_raw(width, height, classes)
            .ok_or_else(|| UserError::file(annotations, "has another number of pixels than its header states"))?;
        Ok(Self { image, classes, ignore, config, crc: digest.finalize() })
    }

    /// The procedural sea floor of `world.kind` from above, with every pixel annotated: the survey area of a reef, or
    /// patches.
    pub fn procedural(seed: u64, config: &'a Config) -> Self {
        let (image, classes) = match config.world.kind {
            WorldKind::Reef => Reef::new(seed).survey(config.camera.metres_per_pixel),
            WorldKind::Patches => {
                let (columns, rows, patch) = PATCHES_PX;
                let world = scenecast_worlds::patches(seed, columns, rows, patch, 8);
                (world.image, GrayImage::from_raw(columns, rows, world.truth).unwrap_or_default())
            }
        };
        let crc = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(image.as_raw());
        Self { image, classes, ignore: &[], config, crc }
    }

    /// 16 hexadecimal digits over all inputs of a measurement of these sites except the setting.
    pub fn fingerprint(sites: &[Self], options: &str) -> String {
        let Some(Self { config, ignore, .. }) = sites.first() else { return String::new() };
        let Config { camera, scene, survey, link, map, .. } = config;
        let rest = format!(
            "3 {options} {:?} {} {} {} {} {} {} {} {} {} {} {:?}",
            ignore,
            camera.metres_per_pixel,
            camera.width_px,
            camera.height_px,
            camera.rate_hz,
            survey.speed_m_s,
            scene.birth,
            scene.labels,
            scene.max_words_per_cell,
            link.frame_bytes,
            map.codec,
            WordConfig::default()
        );
        let images = sites.iter().fold(0, |all: u32, site| all.rotate_left(5) ^ site.crc);
        format!("{images:08x}{:08x}", crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(rest.as_bytes()))
    }
}

/// The frames of a survey, for one size of cells.
pub struct Survey<'a> {
    pub(super) config: &'a Config,
    /// The annotations of the map's cells, and the mosaic's colours as a second set of classes.
    pub(super) annotations: Annotations,
    pub(super) colours: Annotations,
    camera: DownCamera,
    pub(super) size: (u32, u32),
    frames: Vec<(Pose, FrameContent)>,
    /// Time between two frames, seconds.
    pub(super) step_s: f64,
}

impl<'a> Survey<'a> {
    pub fn new(site: &Site<'a>, cell_m: f64) -> Result<Self, UserError> {
        let config = site.config;
        let mpp = config.camera.metres_per_pixel;
        let cell_px = (cell_m / mpp) as f32;
        let (width, height) = site.image.dimensions();
        if !(1.0..=width.min(height) as f32 / 4.0).contains(&cell_px) {
            let cells = format!("cells of {cell_m} m are {cell_px} pixels of {mpp} m");
            let allowed = format!("1 to {} pixels are allowed with this mosaic", width.min(height) / 4);
            return Err(UserError::Input(format!(
                "{cells}; {allowed} (--metres-per-pixel, scene.cell_m, the grid's cell_m)"
            )));
        }
        let size = (config.camera.width_px.min(width), config.camera.height_px.min(height));
        let (corners, step_px) = corners((width, height), size, config.survey.speed_m_s / config.camera.rate_hz / mpp);
        let words = WordConfig::default();
        let per_cell = f64::from(words.colour + words.context + words.spread + words.texture + words.binary);
        let per_frame = f64::from(size.0) * f64::from(size.1) / f64::from(cell_px).powi(2) * per_cell;
        if per_frame * corners.len() as f64 > MAX_WORDS {
            let cause = format!("a survey of {} frames with {per_frame:.0} words each is too long", corners.len());
            return Err(UserError::Input(format!(
                "{cause}; raise survey.speed_m_s, lower camera.rate_hz or take larger cells"
            )));
        }
        let mut look = match config.scene.labels {
            SceneLabels::Topics => Look::Words(Box::new(WordExtractor::new(&words))),
            SceneLabels::Habitats => Look::Points,
        };
        let frame = |(left, top): (u32, u32)| {
            let view = image::imageops::crop_imm(&site.image, left, top, size.0, size.1).to_image();
            let middle = |from: u32, length: u32| (f64::from(from) + f64::from(length) / 2.0) * mpp;
            let pose = Pose { x: middle(left, size.0), y: -middle(top, size.1), z: 0.0, yaw_rad: 0.0 };
            (pose, look.at(&view, cell_px))
        };
        let frames = corners.into_iter().map(frame).collect();
        let annotations = Annotations::new(&site.classes, site.image.dimensions(), cell_px, site.ignore);
        Ok(Self {
            config,
            annotations: annotations.map_err(UserError::input)?,
            colours: mosaic_classes(&site.image, cell_px),
            camera: DownCamera { metres_per_pixel: mpp, altitude_m: 0.0 },
            size,
            frames,
            step_s: step_px * mpp / config.survey.speed_m_s,
        })
    }

    /// The frames of the camera, each with the places of its words or points; the mosaic's north-west corner is the origin of the world.
    pub fn frames(&self) -> impl Iterator<Item = (&FrameContent, Vec<Observation>)> {
        self.frames
            .iter()
            .map(|(pose, content)| (content, self.camera.project(self.size.0, self.size.1, pose, &content.as_words())))
    }

    /// Duration of the whole survey, seconds.
    pub fn duration_s(&self) -> f64 {
        self.frames.len() as f64 * self.step_s
    }

    /// The configuration of the scene model for one setting.
    pub fn scene(&self, setting: &Setting, seed: u64) -> SceneConfig {
        let scene = &self.config.scene;
        let birth = match scene.birth {
            BirthRule::Literal => Birth::Literal,
            BirthRule::Collapsed => Birth::Collapsed,
            BirthRule::Rost => Birth::Rost,
        };
        SceneConfig {
            cell_m: [setting.cell_m, setting.cell_m, 1e4],
            alpha: setting.alpha,
            beta: setting.beta,
            gamma: setting.gamma,
            birth,
            max_labels: setting.max_labels,
            max_words_per_cell: scene.max_words_per_cell,
            seed,
            ..SceneConfig::for_images()
        }
    }
}

/// North-west corners of the frames of `size` that cross a mosaic line by line, about `step` pixels apart along the
/// lines, and the actual distance between two frames, pixels.
fn corners(mosaic: (u32, u32), size: (u32, u32), step: f64) -> (Vec<(u32, u32)>, f64) {
    let places = |length: u32, frame: u32, step: f64| -> Vec<u32> {
        let free = f64::from(length - frame);
        let steps = (free / step).ceil().max(if free > 0.0 { 1.0 } else { 0.0 }) as u32;
        (0..=steps).map(|i| (free * f64::from(i) / f64::from(steps.max(1))).round() as u32).collect()
    };
    let most = |frame: u32| f64::from(frame) * (1.0 - MIN_OVERLAP);
    let across = places(mosaic.0, size.0, step.clamp(1.0, most(size.0)));
    let mut corners = Vec::new();
    for (line, &top) in places(mosaic.1, size.1, most(size.1)).iter().enumerate() {
        let along = (0..across.len()).map(|i| across[if line % 2 == 0 { i } else { across.len() - 1 - i }]);
        corners.extend(along.map(|left| (left, top)));
    }
    (corners, step.clamp(1.0, most(size.0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_survey_covers_every_pixel_and_turns_at_the_end_of_lines() {
        for (mosaic, size, step) in
            [((1000, 700), (320, 240), 90.0), ((320, 240), (320, 240), 5.0), ((333, 90), (64, 64), 1e9)]
        {
            let (corners, _) = corners(mosaic, size, step);
            let mut seen = vec![false; (mosaic.0 * mosaic.1) as usize];
            for &(left, top) in &corners {
                for y in top..top + size.1 {
                    seen[(y * mosaic.0 + left) as usize..][..size.0 as usize].fill(true);
                }
            }
            assert!(seen.iter().all(|&seen| seen), "{mosaic:?}");
            assert!(
                corners.windows(2).all(|pair| pair[0] != pair[1] && (pair[0].0 == pair[1].0 || pair[0].1 == pair[1].1))
            );
        }
    }
}
