//! How many bytes an image needs to look like its patch, and how many the vehicle sends.

use super::Spread;
use crate::World;
use image::RgbImage;
use scene_model::exemplars::ExemplarPatch;
use scene_model::project::Pose;
use scenecast_config::Config;
use scenecast_core::UserError;
use scenecast_protocol::exemplar::edge_px;
use scenecast_protocol::exemplar::{HEAD, max_bytes};
use scenecast_vehicle::Mapper;
use scenecast_vehicle::exemplar::{GOOD_SSIM, compress, compress_to, middle};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Frames across and along an image.
const FRAMES: (u32, u32) = (4, 3);

/// The best patches of each label that are measured.
const EACH: usize = 2;

/// Where patches come from.
#[derive(Debug, Clone)]
pub enum Source {
    /// A procedural reef of this seed.
    Reef(u64),
    /// A photo.
    Photo(PathBuf),
}

/// Bytes of images of one size.
#[derive(Debug, Clone, Serialize)]
pub struct Sizes {
    /// Edge, pixels.
    pub edge_px: u32,
    /// Patches.
    pub patches: usize,
    /// The fewest bytes with a structural similarity of at least 0.9, by trying every quality; only of the smallest images.
    pub fewest: Option<Spread>,
    /// What the vehicle sends.
    pub sent: Option<Spread>,
    /// Share of what it sends that looks as like as that.
    pub similar_share: f64,
    /// The similarity of what it sends: median and least.
    pub ssim: [f64; 2],
}

/// What was measured of the patches of several sources.
#[derive(Debug, Clone, Serialize)]
pub struct Bytes {
    /// Photos or procedural reefs that were flown over.
    pub sources: usize,
    /// The first image of a label, and the larger one.
    pub sizes: Vec<Sizes>,
    /// Tenths of the bytes of the first images as they are sent, from the least to the greatest.
    pub tenths: Vec<f64>,
}

/// The photos in a folder, sorted by name; pictures of labels are passed over.
pub fn photos(dir: &Path) -> Result<Vec<Source>, UserError> {
    let entries = std::fs::read_dir(dir).map_err(|e| UserError::file(dir, e))?;
    let is_photo = |path: &PathBuf| {
        let name = path.file_name().map(|n| n.to_string_lossy().to_lowercase()).unwrap_or_default();
        let kind = ["jpg", "jpeg", "png"].iter().any(|e| name.ends_with(&format!(".{e}")));
        kind && !name.contains("label")
    };
    let mut found: Vec<PathBuf> = entries.flatten().map(|e| e.path()).filter(is_photo).collect();
    found.sort();
    if found.is_empty() {
        return Err(UserError::file(dir, "there is no .jpg or .png in it"));
    }
    Ok(found.into_iter().map(Source::Photo).collect())
}

/// The patches that the vehicle picks on a flight over a source.
pub fn patches(source: &Source, seed: u64) -> Result<Vec<RgbImage>, UserError> {
    let config = Config::default();
    let mpp = config.camera.metres_per_pixel;
    let world = match source {
        Source::Reef(seed) => World::procedural(*seed, mpp),
        Source::Photo(path) => World::from_files(path, None, mpp)?,
    };
    let mut mapper =
        Mapper::new(&config, scenecast_files::configured_vocabulary(config.scene.vocabulary.as_deref())?, 0, seed)?;
    let (area, camera) = (world.area(), &config.camera);
    for i in 0..FRAMES.0 * FRAMES.1 {
        let along = |k: u32, n: u32, low: f64, high: f64| low + (high - low) * (f64::from(k) + 0.5) / f64::from(n);
        let x = along(i % FRAMES.0, FRAMES.0, area.west, area.east);
        let y = along(i / FRAMES.0, FRAMES.1, area.south, area.north);
        let view = world.view(x, y, 0.0, camera.width_px, camera.height_px);
        let pose = Pose { x, y, z: -16.0, yaw_rad: 0.0 };
        mapper.handle_frame(&view, &pose, 1.0, f64::from(i) / camera.rate_hz);
    }
    let of_label = |images: Vec<ExemplarPatch>| images.into_iter().take(EACH).map(|e| e.patch.as_ref().clone());
    Ok(Arc::unwrap_or_clone(mapper.shared_exemplars()).into_values().flat_map(of_label).collect())
}

/// Measures the patches of all sources; the patches too.
pub fn sizes(
    sources: &[Source],
    seed: u64,
    progress: &mut dyn FnMut(f64),
) -> Result<(Bytes, Vec<RgbImage>), UserError> {
    let mut all = Vec::new();
    for (i, source) in sources.iter().enumerate() {
        all.extend(patches(source, seed)?);
        progress((i + 1) as f64 / sources.len() as f64);
    }
    let small = measure(&all, 0);
    let mut sent: Vec<f64> = small.sent.iter().map(|&n| n as f64).collect();
    sent.sort_by(f64::total_cmp);
    let last = sent.len().saturating_sub(1);
    let tenths = (0..=10).filter_map(|t| sent.get(t * last / 10).copied()).collect();
    let measured = Bytes { sources: sources.len(), sizes: vec![small.sizes(0), measure(&all, 1).sizes(1)], tenths };
    Ok((measured, all))
}

#[derive(Default)]
struct Measured {
    fewest: Vec<usize>,
    sent: Vec<usize>,
    ssim: Vec<f64>,
}

fn measure(patches: &[RgbImage], size: u8) -> Measured {
    let mut measured = Measured::default();
    for patch in patches.iter().filter_map(|p| middle(p, size)).filter(|(cut, _)| *cut == size).map(|(_, p)| p) {
        if size == 0 {
            let good = (0..=100).filter_map(|quality| compress(&patch, quality)).filter(|c| c.ssim >= GOOD_SSIM);
            measured.fewest.extend(good.map(|c| c.bytes.len() + HEAD).min());
        }
        if let Some(sent) = compress_to(&patch, GOOD_SSIM, max_bytes(size)) {
            measured.sent.push(sent.bytes.len() + HEAD);
            measured.ssim.push(sent.ssim);
        }
    }
    measured.ssim.sort_by(f64::total_cmp);
    measured
}

impl Measured {
    fn sizes(&self, size: u8) -> Sizes {
        let good = self.ssim.iter().filter(|s| **s >= GOOD_SSIM).count();
        let at = |i: usize| self.ssim.get(i).map_or(0.0, |s| (s * 1e4).round() / 1e4);
        Sizes {
            edge_px: edge_px(size),
            patches: self.sent.len(),
            fewest: Spread::of(self.fewest.iter().map(|&n| n as f64)),
            sent: Spread::of(self.sent.iter().map(|&n| n as f64)),
            similar_share: good as f64 / self.ssim.len().max(1) as f64,
            ssim: [at(self.ssim.len() / 2), at(0)],
        }
    }
}
