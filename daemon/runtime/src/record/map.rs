//! A replicated map in a record: its changes, and at the vehicle from which camera frame each cell has its label.

use super::entry_of;
use scenecast_files::RecordEntry;
use scenecast_messages::contents::{MAP_FRAME, Stamps, camera_pose, header};
use scenecast_messages::scenecast_msgs::{CameraFrame, MapCells, MapVersion};
use scenecast_protocol::map::{Cell, LabelGrid, MapDigest, UNEXPLORED};
use scenecast_vehicle::{Evidence, MappedFrame, Vehicle};
use std::sync::Arc;

/// What a record has of a map.
#[derive(Default)]
pub(super) struct RecordedMap {
    /// Epoch and version of the map that was recorded last; `None` before the first one.
    pub(super) key: Option<(u8, u64)>,
    shown: LabelGrid,
    digest: MapDigest,
}

/// A map that is to be recorded: the labels, or the levels of a layer.
pub(super) struct MapState<'a> {
    pub(super) vehicle: &'a str,
    /// The name of the layer; empty for the labels.
    pub(super) layer: &'a str,
    pub(super) epoch: u8,
    pub(super) version: u64,
    pub(super) cell_m: f64,
    pub(super) labels: &'a LabelGrid,
    /// The vehicle whose map it is, if it is at this end.
    pub(super) source: Option<&'a Vehicle>,
}

impl MapState<'_> {
    /// Adds to changed cells from which camera frame each has its label, if one of them has one.
    fn add_evidence(&self, cells: &mut MapCells, stamps: &Stamps) {
        let Some(vehicle) = self.source else { return };
        let changed = cells.x.iter().zip(&cells.y).map(|(&x, &y)| vehicle.evidence(Cell::new(x, y)));
        let evidence: Vec<Option<&Evidence>> = changed.collect();
        let mut frames: Vec<&Arc<MappedFrame>> = evidence.iter().flatten().map(|evidence| &evidence.frame).collect();
        frames.sort_by(|a, b| a.taken_s.total_cmp(&b.taken_s));
        frames.dedup_by(|a, b| a.taken_s == b.taken_s);
        // A number has no more bits; a map that changed with more frames between two looks loses the oldest ones.
        let frames = &frames[frames.len().saturating_sub(MapCells::NO_FRAME.into())..];
        if frames.is_empty() {
            return;
        }
        let index = |evidence: &Option<&Evidence>| {
            let taken_s = evidence.as_ref()?.frame.taken_s;
            frames.binary_search_by(|frame| frame.taken_s.total_cmp(&taken_s)).ok()
        };
        cells.frame = evidence.iter().map(|e| index(e).map_or(MapCells::NO_FRAME, |index| index as u16)).collect();
        cells.words = evidence.iter().map(|e| e.map_or(0, |evidence| evidence.words)).collect();
        cells.confidence = evidence.iter().map(|e| e.map_or(f32::NAN, |evidence| evidence.confidence)).collect();
        let message = |frame: &&Arc<MappedFrame>| CameraFrame {
            taken: stamps.at(frame.taken_s),
            camera: camera_pose([frame.camera.x, frame.camera.y, frame.camera.z], frame.camera.yaw_rad),
        };
        cells.frames = frames.iter().map(message).collect();
    }
}

impl RecordedMap {
    /// The changes since the last call, and the new version.
    pub(super) fn record(&mut self, map: &MapState<'_>, stamps: &Stamps) -> Vec<RecordEntry> {
        let &MapState { vehicle, layer, epoch, version, cell_m, labels, .. } = map;
        let whole = self.key.is_none_or(|(before, _)| before != epoch);
        if self.key.replace((epoch, version)) == Some((epoch, version)) {
            return Vec::new();
        }
        if whole {
            (self.shown, self.digest) = (LabelGrid::default(), MapDigest::default());
        }
        let gone = self.shown.iter().filter(|&(cell, _)| labels.get(cell) == UNEXPLORED);
        let gone: Vec<(Cell, u8)> = gone.map(|(cell, _)| (cell, UNEXPLORED)).collect();
        let changed = labels.iter().filter(|&(cell, label)| self.shown.get(cell) != label).chain(gone);
        let changed: Vec<(Cell, u8)> = changed.collect();
        for &(cell, label) in &changed {
            let before = self.shown.set(cell, label);
            self.digest.change(cell, before, label);
        }
        let head = || header(stamps.now(), MAP_FRAME);
        let name = || vehicle.to_owned();
        let state = MapVersion {
            header: head(),
            vehicle: name(),
            epoch: epoch.into(),
            version,
            cells: labels.explored() as u32,
            digest: self.digest.value(),
        };
        let mut cells = MapCells {
            header: head(),
            vehicle: name(),
            epoch: epoch.into(),
            version,
            layer: layer.to_owned(),
            cell_m,
            whole,
            x: changed.iter().map(|(cell, _)| cell.x).collect(),
            y: changed.iter().map(|(cell, _)| cell.y).collect(),
            value: changed.iter().map(|&(_, label)| label).collect(),
            ..MapCells::default()
        };
        map.add_evidence(&mut cells, stamps);
        let mut entries = Vec::new();
        if layer.is_empty() {
            entries.push(entry_of(vehicle, "map_version", stamps, &state));
        }
        if whole || !changed.is_empty() {
            entries.push(entry_of(vehicle, "map_cells", stamps, &cells));
        }
        entries
    }
}
