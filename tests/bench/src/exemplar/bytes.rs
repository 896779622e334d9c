//! The bytes that an image needs for its similarity with the patch, and the bytes that the vehicle sends.

use super::Spread;
use image::RgbImage;
use scene_model::exemplars::ExemplarPatch;
use scene_model::project::Pose;
use scenecast_config::Config;
use scenecast_core::UserError;
use scenecast_protocol::exemplar::edge_px;
use scenecast_protocol::exemplar::{HEAD, max_bytes};
use scenecast_rehearsal::World;
use scenecast_vehicle::exemplar::{GOOD_SSIM, compress, compress_to, middle};
use scenecast_vehicle::{Frame, Mapper};
use scenecast_worlds::View;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Number of camera frames across and along a source.
const FRAMES: (u32, u32) = (4, 3);

/// Number of patches of each label that are measured, the best first.
const EACH: usize = 2;

#[derive(Debug, Clone)]
pub enum PatchSource {
    /// A procedural reef of this seed.
    Reef(u64),
    Photo(PathBuf),
}

/// Bytes of images of one size.
#[derive(Debug, Clone, Serialize)]
pub struct Sizes {
    pub edge_px: u32,
    pub patches: usize,
    /// Minimum number of bytes with a structural similarity of at least 0.9, over all qualities;
    /// of the smallest images only.
    pub fewest: Option<Spread>,
    /// Bytes of the exemplar that the vehicle sends.
    pub sent: Option<Spread>,
    /// Share of the sent exemplars with at least that similarity.
    pub similar_share: f64,
    /// Similarity of the sent exemplars: median and minimum.
    pub ssim: [f64; 2],
}

/// Measurements of the patches of several sources.
#[derive(Debug, Clone, Serialize)]
pub struct Bytes {
    /// Number of photos or procedural reefs.
    pub sources: usize,
    /// Results for the first image of a label, and for the larger one.
    pub sizes: Vec<Sizes>,
    /// Deciles of the bytes of the first images as they are sent, minimum and maximum included.
    pub tenths: Vec<f64>,
}

/// The photos in a folder, sorted by name; images of annotated classes are skipped.
pub fn photos(dir: &Path) -> Result<Vec<PatchSource>, UserError> {
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
    Ok(found.into_iter().map(PatchSource::Photo).collect())
}

/// The patches that the vehicle picks on a flight over a source.
pub fn patches(source: &PatchSource, seed: u64) -> Result<Vec<RgbImage>, UserError> {
    let config = Config::default();
    let mpp = config.camera.metres_per_pixel;
    let mut world = match source {
        PatchSource::Reef(seed) => World::patches(*seed, mpp),
        PatchSource::Photo(path) => World::from_files(path, None, mpp)?,
    };
    let mut mapper =
        Mapper::new(&config, scenecast_files::configured_vocabulary(config.scene.vocabulary.as_deref())?, 0, seed)?;
    let (area, camera) = (world.area(), &config.camera);
    for i in 0..FRAMES.0 * FRAMES.1 {
        let along = |k: u32, n: u32, low: f64, high: f64| low + (high - low) * (f64::from(k) + 0.5) / f64::from(n);
        let x = along(i % FRAMES.0, FRAMES.0, area.west, area.east);
        let y = along(i / FRAMES.0, FRAMES.1, area.south, area.north);
        let (width_px, height_px) = (camera.width_px, camera.height_px);
        let altitude_m = config.survey.altitude_m;
        let moment = u64::from(i);
        let view = View { x_m: x, y_m: y, heading_rad: 0.0, altitude_m, width_px, height_px, moment };
        let view = world.view(&view);
        let pose = Pose { x, y, z: -16.0, yaw_rad: 0.0 };
        mapper.handle_frame(&Frame::flat(&view, pose, 1.0), f64::from(i) / camera.rate_hz);
    }
    let of_label = |images: Vec<ExemplarPatch>| images.into_iter().take(EACH).map(|e| e.patch.as_ref().clone());
    Ok(Arc::unwrap_or_clone(mapper.shared_exemplars()).into_values().flat_map(of_label).collect())
}

/// Measures the patches of all sources; returns the patches as well.
pub fn sizes(
    sources: &[PatchSource],
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
