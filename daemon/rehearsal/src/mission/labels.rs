//! Labels of another program in a rehearsal: the items of a folder, each at its mission time.

use super::Mission;
use scenecast_config::{Config, LabelSource};
use scenecast_core::UserError;
use scenecast_files::{FolderItem, LabelFolder};
use scenecast_host::CameraPose;
use scenecast_labels::{Content, ImagePose};
use scenecast_protocol::time::Instant;
use scenecast_vehicle::ForeignMap;
use std::collections::VecDeque;
use std::path::PathBuf;

/// The items of a folder and the map that they make.
pub(crate) struct LabelReplay {
    dir: PathBuf,
    folder: LabelFolder,
    /// Names with their times, the earliest first; items without a time come first.
    names: VecDeque<(Instant, String)>,
    pub(super) map: ForeignMap,
    pub(super) refused: Vec<String>,
}

impl LabelReplay {
    /// The configured source; `None` if the scene model makes the map.
    pub(super) fn new(config: &Config) -> Result<Option<Self>, UserError> {
        let dir = match &config.labels.source {
            LabelSource::SceneModel => return Ok(None),
            LabelSource::Folder(dir) => dir.clone(),
            _ => return Err(UserError::Input("labels.source: a rehearsal takes dir:FOLDER alone".to_owned())),
        };
        let mut folder = LabelFolder::new(&dir, None);
        let names = folder.scan().map_err(|e| UserError::file(&dir, e))?;
        let time = |name: &String| Instant::from_secs_f64(folder.time_of(name).unwrap_or(0.0).clamp(0.0, 1e9));
        let mut names: Vec<(Instant, String)> = names.into_iter().map(|name| (time(&name), name)).collect();
        names.sort();
        let map = ForeignMap::new(config, 0);
        Ok(Some(Self { dir, folder, names: names.into(), map, refused: Vec::new() }))
    }

    pub(super) fn next_due(&self) -> Option<Instant> {
        self.names.front().map(|(at, _)| *at)
    }

    /// Takes the items that are due; returns whether there were any, and the pose of the last image among them.
    fn take(&mut self, own: ImagePose, now: Instant) -> (bool, Option<ImagePose>) {
        let (mut is_changed, mut last) = (false, None);
        while self.next_due().is_some_and(|at| at <= now) {
            let Some((_, name)) = self.names.pop_front() else { break };
            let found = self.folder.read_settled(&name);
            let pose = self.handle(found, own, now);
            is_changed |= pose.is_some();
            last = pose.flatten().or(last);
        }
        (is_changed, last)
    }

    /// Returns the pose in an item; `None` if it is refused.
    fn handle(&mut self, found: FolderItem, own: ImagePose, now: Instant) -> Option<Option<ImagePose>> {
        let taken = found.item.and_then(|item| {
            self.map.handle_item(&item, Some(own), now.as_secs_f64())?;
            Ok(if let Content::Image { pose, .. } = item.content { pose } else { None })
        });
        taken.map_err(|why| self.refuse(&found.name, &why.to_string())).ok()
    }

    fn refuse(&mut self, name: &str, why: &str) {
        self.refused.push(format!("{}: {why}", self.dir.join(format!("{name}.json")).display()));
    }
}

impl Mission {
    /// Hands the items of another program that are due to the vehicle.
    pub(super) fn handle_labels(&mut self) {
        let now = self.times.now;
        let Some(labels) = &mut self.labels else { return };
        if self.times.ended.is_some() || labels.next_due().is_none_or(|at| at > now) {
            return;
        }
        let navigator = self.vehicle.vehicle().navigator();
        let ((x_m, y_m), depth_m) = (navigator.dead_reckoned().xy(), navigator.depth_m());
        let own = ImagePose { x_m, y_m, depth_m, heading_rad: navigator.heading_rad() };
        let (is_changed, pose) = labels.take(own, now);
        if let Some(ImagePose { x_m, y_m, depth_m, heading_rad }) = pose.filter(|_| self.camera.is_recorded()) {
            self.vehicle.handle_pose(CameraPose { x_m, y_m, heading_rad, depth_m }, now);
        }
        if is_changed {
            let mut update = labels.map.update();
            self.vehicle.handle_foreign(&update, now);
            update.map.cells.sort_by_key(|(cell, _)| (cell.y, cell.x));
            self.logbook.note_update(self.vehicle.vehicle(), update.map);
        }
    }

    /// When the next item of another program is due.
    pub(super) fn labels_due(&self) -> Option<Instant> {
        self.labels.as_ref().filter(|_| self.times.ended.is_none())?.next_due()
    }

    /// Whether another program makes the map.
    pub fn has_foreign_labels(&self) -> bool {
        self.labels.is_some()
    }

    /// The files of another program that were refused so far, each with the cause.
    pub fn refused_labels(&self) -> &[String] {
        self.labels.as_ref().map_or(&[], |labels| &labels.refused)
    }
}
