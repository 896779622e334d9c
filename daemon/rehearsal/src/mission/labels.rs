//! Labels of another program in a rehearsal: the items of a folder, each at its mission time.

use super::Mission;
use scenecast_config::{Config, LabelSource};
use scenecast_core::UserError;
use scenecast_files::{FolderItem, LabelFolder, read_class_names};
use scenecast_host::CameraPose;
use scenecast_labels::{Content, ImagePose, ItemTime};
use scenecast_protocol::time::Instant;
use scenecast_vehicle::{ForeignMap, ForeignSource};
use std::collections::VecDeque;
use std::path::{Path, PathBuf};

/// The items of one or two folders and the map that they make.
pub(crate) struct LabelReplay {
    folders: Vec<ReplayFolder>,
    /// Items by their times, the earliest first; items without a time come first.
    due: VecDeque<(Instant, usize, String)>,
    pub(super) map: ForeignMap,
    /// Whether the labels are not the scene model's.
    is_foreign: bool,
    pub(super) refused: Vec<String>,
}

struct ReplayFolder {
    source: ForeignSource,
    dir: PathBuf,
    folder: LabelFolder,
}

impl LabelReplay {
    /// The configured sources; `None` if the scene model makes the map and no other program adds bands.
    pub(super) fn new(config: &Config) -> Result<Option<Self>, UserError> {
        let mut folders = Vec::new();
        let sources = [
            ("labels.source", ForeignSource::Labels, &config.labels.source),
            ("bands.source", ForeignSource::Bands, &config.bands.source),
        ];
        for (key, source, place) in sources {
            match place {
                LabelSource::SceneModel => {}
                LabelSource::Folder(dir) => {
                    folders.push(ReplayFolder { source, dir: dir.clone(), folder: LabelFolder::new(dir, None) });
                }
                _ => return Err(UserError::Input(format!("{key}: a rehearsal takes dir:FOLDER alone"))),
            }
        }
        if folders.is_empty() {
            return Ok(None);
        }
        let mut due = Vec::new();
        for (index, replay) in folders.iter_mut().enumerate() {
            let names = replay.folder.scan().map_err(|e| UserError::file(&replay.dir, e))?;
            due.extend(names.into_iter().map(|name| (replay.folder.time_of(&name), index, name)));
        }
        let mut map = ForeignMap::new(config, 0);
        if let Some(path) = &config.labels.classes {
            map.add_names(&read_class_names(path)?.classes).map_err(|why| UserError::file(path, why))?;
        }
        let is_foreign = config.labels.source != LabelSource::SceneModel;
        Ok(Some(Self { folders, due: in_order(due), map, is_foreign, refused: Vec::new() }))
    }

    pub(super) fn next_due(&self) -> Option<Instant> {
        self.due.front().map(|(at, ..)| *at)
    }

    /// Takes the items that are due; returns whether there were any, and the pose of the last image among them.
    fn take(&mut self, own: ImagePose, now: Instant) -> (bool, Option<ImagePose>) {
        let (mut is_changed, mut last) = (false, None);
        while self.next_due().is_some_and(|at| at <= now) {
            let Some((_, index, name)) = self.due.pop_front() else { break };
            let Some(ReplayFolder { source, dir, folder }) = self.folders.get_mut(index) else { continue };
            let (source, dir, found) = (*source, dir.clone(), folder.read_settled(&name));
            let pose = self.handle(found, (source, &dir), own, now);
            is_changed |= pose.is_some();
            last = pose.flatten().or(last);
        }
        (is_changed, last)
    }

    /// Returns the pose in an item; `None` if it is refused.
    fn handle(
        &mut self,
        found: FolderItem,
        (source, dir): (ForeignSource, &Path),
        own: ImagePose,
        now: Instant,
    ) -> Option<Option<ImagePose>> {
        let taken = found.item.and_then(|item| {
            self.map.handle_item(&item, source, Some(own), now.as_secs_f64())?;
            Ok(if let Content::Image { pose, .. } = item.content { pose } else { None })
        });
        let place = dir.join(format!("{}.json", found.name));
        taken.map_err(|why| self.refused.push(format!("{}: {why}", place.display()))).ok()
    }
}

/// Items by their mission times. Unix times count from the earliest one.
fn in_order(items: Vec<(ItemTime, usize, String)>) -> VecDeque<(Instant, usize, String)> {
    let unix = |time: &ItemTime| if let ItemTime::Unix(unix_s) = time { Some(*unix_s) } else { None };
    let first_s = items.iter().filter_map(|(time, ..)| unix(time)).reduce(f64::min).unwrap_or(0.0);
    let time = |time: ItemTime| match time {
        ItemTime::Mission(t_s) => t_s,
        ItemTime::Unix(unix_s) => unix_s - first_s,
        ItemTime::Arrival | ItemTime::Age(_) => 0.0,
    };
    let at = |given: ItemTime| Instant::from_secs_f64(time(given).clamp(0.0, 1e9));
    let mut due: Vec<_> = items.into_iter().map(|(given, index, name)| (at(given), index, name)).collect();
    due.sort();
    due.into()
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
        let is_foreign = labels.is_foreign;
        if let Some(ImagePose { x_m, y_m, depth_m, heading_rad }) =
            pose.filter(|_| is_foreign && self.camera.is_recorded())
        {
            self.vehicle.handle_pose(CameraPose { x_m, y_m, heading_rad, depth_m }, now);
        }
        if is_changed {
            let changes = labels.map.take_changes(usize::MAX);
            self.vehicle.handle_changes(&changes, now);
            self.logbook.map.note_changes(self.vehicle.vehicle(), &changes, now);
        }
    }

    /// When the next item of another program is due.
    pub(super) fn labels_due(&self) -> Option<Instant> {
        self.labels.as_ref().filter(|_| self.times.ended.is_none())?.next_due()
    }

    /// Whether another program gives the labels.
    pub fn has_foreign_labels(&self) -> bool {
        self.labels.as_ref().is_some_and(|labels| labels.is_foreign)
    }

    /// The files of another program that were refused so far, each with the cause.
    pub fn refused_labels(&self) -> &[String] {
        self.labels.as_ref().map_or(&[], |labels| &labels.refused)
    }
}
