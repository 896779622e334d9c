//! The report of a run of the scene model, its labels in files and images, and the process's time and memory.

use super::learn::LearningEffort;
use super::{LabelledMap, Quality};
use scene_model::topics::{FlatCell, SceneModel, TopicId, centre_of};
use scenecast_core::UserError;
use scenecast_core::label_picture::encode_within;
use scenecast_files::write_whole;
use scenecast_protocol::map::{Cell, LabelGrid, Rect};
use serde::Serialize;
use std::fmt::Write;
use std::path::Path;

/// Measurements of a run, printed as one line of JSON.
#[derive(Debug, Serialize)]
pub(crate) struct RunReport {
    words: Option<u64>,
    cells: usize,
    resampled: Option<u64>,
    seconds: f64,
    cpu_seconds: f64,
    words_per_cpu_second: Option<f64>,
    labels: usize,
    labels_used: usize,
    perplexity: Option<f64>,
    mutual_information_nats: Option<f64>,
    normalised_mutual_information: Option<f64>,
    homogeneity: Option<f64>,
    completeness: Option<f64>,
    v_measure: Option<f64>,
    null_mutual_information_nats: Option<f64>,
    peak_rss_bytes: u64,
    kernel: Option<&'static str>,
}

impl RunReport {
    /// `topics` is the model of topics; habitats have none.
    pub(crate) fn new(
        map: &LabelledMap,
        topics: Option<&SceneModel>,
        effort: &LearningEffort,
        quality: Option<&Quality>,
    ) -> Self {
        let used = numbers(&map.volume).len();
        let speed = effort.resampled as f64 / effort.cpu_seconds.max(1e-6);
        Self {
            words: topics.map(SceneModel::words),
            cells: topics.map_or(map.flat.len(), SceneModel::cells),
            resampled: topics.map(|_| effort.resampled),
            seconds: effort.seconds,
            cpu_seconds: effort.cpu_seconds,
            words_per_cpu_second: topics.map(|_| speed),
            labels: topics.map_or(used, SceneModel::labels),
            labels_used: used,
            perplexity: topics.map(SceneModel::perplexity),
            mutual_information_nats: quality.map(|q| q.mutual_information.nats),
            normalised_mutual_information: quality.map(|q| q.mutual_information.normalised),
            homogeneity: quality.map(|q| q.mutual_information.homogeneity()),
            completeness: quality.map(|q| q.mutual_information.completeness()),
            v_measure: quality.map(|q| q.mutual_information.v_measure()),
            null_mutual_information_nats: quality.map(|q| q.null_nats),
            peak_rss_bytes: peak_rss_bytes(),
            kernel: topics.map(|model| model.kernel().name()),
        }
    }
}

/// The topics of a map, oldest first: the first has the label 1.
fn numbers(volume: &[FlatCell]) -> Vec<TopicId> {
    let mut topics: Vec<TopicId> = volume.iter().map(|cell| cell.topic).collect();
    topics.sort_unstable();
    topics.dedup();
    topics
}

/// Writes `labels.png`, the flattened map, and `labels.csv`, every cell in three dimensions sorted by y and x. Of
/// stacked cells, the one in the flattened map comes last.
pub(crate) fn write(labelled: LabelledMap, dir: &Path) -> Result<(), UserError> {
    let LabelledMap { flat: map, mut volume, cell_m } = labelled;
    // Rows painted in this order give the flattened map.
    let shows =
        |cell: &FlatCell| map.binary_search_by_key(&(cell.y, cell.x), |c| (c.y, c.x)).is_ok_and(|i| map[i].z == cell.z);
    volume.sort_by_cached_key(|cell| (cell.y, cell.x, shows(cell)));
    let topics = numbers(&volume);
    let label = |topic| topics.binary_search(&topic).map_or(0, |index| (index + 1).min(254)) as u8;
    let bounds = around(&map)?;
    let grid: LabelGrid = map.iter().map(|cell| (Cell::new(cell.x, cell.y), label(cell.topic))).collect();
    let png = encode_within(&grid, bounds).map_err(UserError::failed)?;
    let mut table = "x,y,z,label,confidence,perplexity\n".to_owned();
    for cell in &volume {
        let [x, y, z] = centre_of([cell.x, cell.y, cell.z], cell_m);
        let (label, FlatCell { confidence, perplexity, .. }) = (label(cell.topic), cell);
        let _ = writeln!(table, "{x:.6},{y:.6},{z:.6},{label},{confidence:.4},{perplexity:.4}");
    }
    std::fs::create_dir_all(dir).map_err(|e| UserError::file(dir, e))?;
    write_whole(&dir.join("labels.csv"), table.as_bytes())?;
    write_whole(&dir.join("labels.png"), &png)
}

/// Seconds of CPU time of all threads so far, ended ones included, and the peak of resident memory in bytes.
#[cfg(unix)]
fn usage() -> (f64, u64) {
    use nix::sys::resource::{UsageWho, getrusage};
    use nix::sys::time::TimeValLike;
    let Ok(usage) = getrusage(UsageWho::RUSAGE_SELF) else { return (0.0, 0) };
    let microseconds = usage.user_time().num_microseconds() + usage.system_time().num_microseconds();
    // The unit is a kilobyte, except on Apple's systems, where it is a byte.
    let unit = if cfg!(target_vendor = "apple") { 1 } else { 1024 };
    (microseconds as f64 * 1e-6, usage.max_rss().max(0) as u64 * unit)
}

#[cfg(not(unix))]
fn usage() -> (f64, u64) {
    (0.0, 0)
}

/// Seconds of CPU time of all threads so far.
pub(super) fn cpu_seconds() -> f64 {
    usage().0
}

/// Peak of resident memory, bytes.
pub(super) fn peak_rss_bytes() -> u64 {
    // On Linux the usage includes the peak of the process that started this one.
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    peak_in(&status).unwrap_or_else(|| usage().1)
}

/// The peak in the text of `/proc/PID/status`.
fn peak_in(status: &str) -> Option<u64> {
    let kilobytes = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?.trim().strip_suffix(" kB")?;
    Some(kilobytes.parse::<u64>().ok()? * 1024)
}

/// Maximum number of cells in the rectangle around a map.
const MAX_CELLS: u64 = 1 << 26;

/// A map whose cells lie too far apart for an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "the map would reach over {width} x {height} cells, more than {MAX_CELLS}: a position far off, or --cell-size too small"
)]
pub(super) struct LargeExtent {
    width: u64,
    height: u64,
}

/// The rectangle around cells from (west, south) to (east, north); an error if it is too large for an image.
pub(super) fn rectangle(west: i64, south: i64, east: i64, north: i64) -> Result<Rect, LargeExtent> {
    let (width, height) = ((east - west + 1) as u64, (north - south + 1) as u64);
    if width.saturating_mul(height) > MAX_CELLS {
        return Err(LargeExtent { width, height });
    }
    Ok(Rect { x: west as i32, y: south as i32, width: width as u32, height: height as u32 })
}

/// The rectangle around a map; one cell for an empty map.
pub(super) fn around(map: &[FlatCell]) -> Result<Rect, UserError> {
    let Some(first) = map.first() else { return Ok(Rect { x: 0, y: 0, width: 1, height: 1 }) };
    let mut limits = (first.x, first.y, first.x, first.y);
    for cell in map {
        limits = (limits.0.min(cell.x), limits.1.min(cell.y), limits.2.max(cell.x), limits.3.max(cell.y));
    }
    let (west, south, east, north) = limits;
    rectangle(west.into(), south.into(), east.into(), north.into()).map_err(UserError::input)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_peak_is_read_from_the_status_and_cpu_time_grows() {
        assert_eq!(peak_in("Name:\tx\nVmHWM:\t    1234 kB\nVmRSS:\t 9 kB\n"), Some(1234 * 1024));
        assert_eq!(peak_in("Name:\tx\n"), None);
        let before = cpu_seconds();
        let sum: u64 = (0..20_000_000u64).map(|i| i ^ (i >> 3)).sum();
        assert!(sum > 0 && cpu_seconds() >= before);
    }
}
