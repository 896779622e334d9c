//! The map that another program makes: segmented images, whole grids, bands, and names of classes.
//!
//! Class n has label n + 1, always; so no label changes its meaning, whatever restarts.

mod band;
mod checkpoint;
mod ground;

use crate::{LabelChanges, MapChanges, MapProducer};
use band::BandMaps;
pub use checkpoint::ForeignRestoreError;
use ground::{CellVotes, ChangingGrid, GroundRaster, Votes, check_room};
use scene_model::project::{DownCamera, Pose};
use scene_model::words::Word;
use scenecast_config::{Config, LabelSource, Votes as VotesKept, cell_m};
use scenecast_labels::{Content, Ground, ImagePose, Item, Raster, Refusal};
use scenecast_protocol::map::{Cell, ClassEntry, LabelGrid, UNEXPLORED};
use std::collections::BTreeMap;

/// A cell without a class.
const UNKNOWN: u8 = u8::MAX;

/// The setting that an item of another program came in by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ForeignSource {
    /// `labels.source`, which gives labels and bands.
    Labels,
    /// `bands.source`, which gives bands and no labels.
    Bands,
}

/// The map that another program makes.
#[derive(Debug, Clone, PartialEq)]
pub struct ForeignMap {
    epoch: u8,
    cell_m: f64,
    /// Whether the labels are not the scene model's.
    has_labels: bool,
    /// Most cells of the labels, and of each band; erased ones count.
    max_cells: usize,
    camera: DownCamera,
    is_newest_only: bool,
    votes: Votes,
    labels: ChangingGrid,
    /// The highest label so far.
    highest: u8,
    /// Cells that had a label and have none any more.
    erased: LabelGrid,
    bands: BandMaps,
    classes: BTreeMap<u8, ClassEntry>,
    last_s: Option<f64>,
    /// The name of the last item of each source that has one.
    marks: [Option<String>; 2],
}

impl ForeignMap {
    /// Most cells of the labels, and of each band.
    const MAX_CELLS: usize = 1 << 23;

    /// An empty map, whose labels belong to `epoch`.
    pub fn new(config: &Config, epoch: u8) -> Self {
        Self {
            epoch,
            cell_m: cell_m(config),
            has_labels: config.labels.source != LabelSource::SceneModel,
            max_cells: Self::MAX_CELLS,
            camera: DownCamera {
                metres_per_pixel: match config.labels.metres_per_pixel {
                    0.0 => config.camera.metres_per_pixel,
                    metres => metres,
                },
                altitude_m: config.survey.altitude_m,
            },
            is_newest_only: config.labels.votes == VotesKept::Newest,
            votes: Votes::default(),
            labels: ChangingGrid::default(),
            highest: 0,
            erased: LabelGrid::default(),
            bands: BandMaps::new(config),
            classes: BTreeMap::new(),
            last_s: None,
            marks: [None, None],
        }
    }

    /// Takes an item at mission time `t_s`. `own` is the vehicle's pose, for an image without one.
    ///
    /// # Errors
    /// Nothing of a refused item is used.
    pub fn handle_item(
        &mut self,
        item: &Item,
        source: ForeignSource,
        own: Option<ImagePose>,
        t_s: f64,
    ) -> Result<(), Refusal> {
        let is_band = matches!(item.content, Content::Band { .. } | Content::Quantities { .. });
        if source == ForeignSource::Bands && (!is_band || !item.classes.is_empty()) {
            return Err(Refusal::BandsAlone);
        }
        self.check_names(&item.classes)?;
        match &item.content {
            Content::Classes => {}
            Content::Image { pose, metres_per_pixel, classes } => {
                let pose = pose.or(own).ok_or(Refusal::NoPose)?;
                self.see(classes, pose, metres_per_pixel.unwrap_or(self.camera.metres_per_pixel))?;
            }
            Content::Grid { ground, classes } => self.state(classes, *ground)?,
            Content::Band { band, ground, levels } => {
                self.bands.take_band(band, *ground, levels, self.cell_m, self.max_cells)?;
            }
            Content::Quantities { band, ground, quantities } => {
                self.bands.take_quantities(band, *ground, quantities, self.cell_m, self.max_cells)?;
            }
        }
        self.classes.extend(item.classes.iter().map(|entry| (entry.label(), entry.clone())));
        self.last_s = Some(t_s);
        Ok(())
    }

    /// Takes names of classes that come with no item.
    ///
    /// # Errors
    /// A class has another name already.
    pub fn add_names(&mut self, classes: &[ClassEntry]) -> Result<(), Refusal> {
        self.check_names(classes)?;
        self.classes.extend(classes.iter().map(|entry| (entry.label(), entry.clone())));
        // So that they are part of the first checkpoint.
        self.last_s.get_or_insert(0.0);
        Ok(())
    }

    /// Notes the name of an item that was handled, for its source after a restart.
    pub fn set_mark(&mut self, source: ForeignSource, name: &str) {
        self.marks[source as usize] = Some(name.to_owned());
    }

    /// The name of the last item of a source that was handled, before a restart too.
    pub fn mark(&self, source: ForeignSource) -> Option<&str> {
        self.marks[source as usize].as_deref()
    }

    /// A class keeps its name and its colour.
    fn check_names(&self, classes: &[ClassEntry]) -> Result<(), Refusal> {
        let other = |entry: &&ClassEntry| self.classes.get(&entry.label()).is_some_and(|known| known != *entry);
        match classes.iter().find(other) {
            Some(entry) => {
                let known = self.classes.get(&entry.label()).map(ClassEntry::name).unwrap_or_default();
                Err(Refusal::OtherName(entry.label() - 1, known.to_owned()))
            }
            None => Ok(()),
        }
    }

    /// An image votes for the classes of the cells that it shows.
    fn see(&mut self, image: &Raster, pose: ImagePose, metres_per_pixel: f64) -> Result<(), Refusal> {
        let camera = DownCamera { metres_per_pixel, ..self.camera };
        let across = f64::from(image.width).hypot(f64::from(image.height)) * metres_per_pixel / self.cell_m + 2.0;
        if across * across > ground::MAX_CELLS as f64 {
            return Err(Refusal::Cells((across * across) as u64, ground::MAX_CELLS));
        }
        let seen = image_votes(image, &camera, pose, self.cell_m);
        self.check_room(seen.keys().map(|&(x, y)| Cell::new(x, y)))?;
        for (place, votes) in seen {
            let cell = Cell::new(place.0, place.1);
            let held = self.labels.grid().get(cell).checked_sub(1);
            let winner = self.votes.vote(place, &votes, self.is_newest_only).winner(held);
            self.set(cell, winner.unwrap_or(UNKNOWN));
        }
        Ok(())
    }

    /// A grid states the class of each of its cells.
    fn state(&mut self, classes: &Raster, ground: Ground) -> Result<(), Refusal> {
        let mut stated = Vec::new();
        GroundRaster::new(classes, ground, self.cell_m)?.for_each(|cell, values| {
            let mut votes = CellVotes::default();
            values.iter().filter(|&&class| class != UNKNOWN).for_each(|&class| votes.add(class, 1));
            stated.push((cell, votes.winner(None).unwrap_or(UNKNOWN)));
        });
        self.check_room(stated.iter().filter(|(_, class)| *class != UNKNOWN).map(|&(cell, _)| cell))?;
        for (cell, class) in stated {
            self.votes.forget((cell.x, cell.y));
            self.set(cell, class);
        }
        Ok(())
    }

    fn check_room(&self, cells: impl Iterator<Item = Cell>) -> Result<(), Refusal> {
        check_room(self.labels.grid(), &self.erased, cells, self.max_cells)
    }

    fn set(&mut self, cell: Cell, class: u8) {
        let label = ClassEntry::label_of(class).unwrap_or(UNEXPLORED);
        let before = self.labels.set(cell, label);
        self.highest = self.highest.max(label);
        if label == UNEXPLORED && before != UNEXPLORED {
            self.erased.set(cell, 1);
        } else if label != UNEXPLORED && before == UNEXPLORED {
            self.erased.set(cell, UNEXPLORED);
        }
    }

    /// Whether cells may have changed since the last update.
    pub fn has_changes(&self) -> bool {
        self.labels.has_changes() || self.bands.has_changes()
    }

    /// Gives away about `most` changed cells of the labels, and as many of each band. A band without any is there too.
    pub fn take_changes(&mut self, most: usize) -> MapChanges {
        let (epoch, highest) = (self.epoch, self.highest);
        let labels = LabelChanges { epoch, highest, cells: self.labels.take(most), tree: None };
        MapChanges {
            labels: self.has_labels.then_some(labels),
            bands: self.bands.take_changes(most),
            classes: self.classes.values().cloned().collect(),
            ..MapChanges::default()
        }
    }

    /// The names and colours of classes that were given so far.
    pub fn classes(&self) -> impl Iterator<Item = &ClassEntry> {
        self.classes.values()
    }

    /// The map of labels; an erased cell has none.
    pub fn labels(&self) -> &LabelGrid {
        self.labels.grid()
    }
}

impl MapProducer for ForeignMap {
    fn epoch(&self) -> u8 {
        self.epoch
    }

    fn last_s(&self) -> Option<f64> {
        self.last_s
    }

    fn resume(&mut self, epoch: u8, published: u8) {
        (self.epoch, self.highest) = (epoch, self.highest.max(published));
    }

    fn save(&self, lineage: u64) -> Vec<u8> {
        self.encode(lineage)
    }
}

/// The votes of an image for each cell that it shows.
fn image_votes(image: &Raster, camera: &DownCamera, pose: ImagePose, cell_m: f64) -> BTreeMap<(i32, i32), CellVotes> {
    let pose = Pose { x: pose.x_m, y: pose.y_m, z: -pose.depth_m, yaw_rad: -pose.heading_rad };
    let cell = |metres: f64| (metres / cell_m).floor() as i32;
    let mut seen: BTreeMap<(i32, i32), CellVotes> = BTreeMap::new();
    for (row, classes) in image.values.chunks(image.width.max(1) as usize).enumerate() {
        let pixel =
            |(column, &class): (usize, &u8)| Word { id: u32::from(class), u: column as f32 + 0.5, v: row as f32 + 0.5 };
        let words: Vec<Word> = classes.iter().enumerate().filter(|(_, class)| **class != UNKNOWN).map(pixel).collect();
        // Neighbours mostly vote for the same class of the same cell.
        let mut run: Option<((i32, i32), u8, u32)> = None;
        for seen_at in camera.project(image.width, image.height, &pose, &words) {
            let (at, class) = ((cell(seen_at.x), cell(seen_at.y)), seen_at.word as u8);
            match &mut run {
                Some((place, voted, pixels)) if *place == at && *voted == class => *pixels += 1,
                _ => {
                    if let Some((place, class, pixels)) = run.replace((at, class, 1)) {
                        seen.entry(place).or_default().add(class, pixels);
                    }
                }
            }
        }
        if let Some((place, class, pixels)) = run {
            seen.entry(place).or_default().add(class, pixels);
        }
    }
    seen
}

#[cfg(test)]
mod tests;
