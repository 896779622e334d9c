//! The surface's knowledge about one vehicle, folded from its events.

use super::cells::{EarlierMap, FormerLabels, MapCopy};
use super::event::{
    RunId, StoredContact, StoredDraft, StoredImage, StoredIntent, StoredMarker, StoredNote, StoredOrder, StoredPlaces,
    StoredRequest, VehicleEvent,
};
use crate::label_book::{LabelBook, StoredLabel};
use scenecast_protocol::map::{Cell, LabelTree};
use scenecast_protocol::time::Instant;
use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

/// Positions that are kept of a vehicle's track, and of its closed loops.
const MAX_TRACK: usize = 500;
/// Notes that are kept of a vehicle.
const MAX_NOTES: usize = 200;
/// The most markers that are kept; a surface sets no more.
pub(crate) const MAX_MARKERS: usize = 200;

/// Everything that the surface keeps about one vehicle.
#[derive(Debug, Default)]
pub struct VehicleMemory {
    pub(crate) name: String,
    pub(crate) id: RunId,
    pub(crate) map: MapCopy,
    pub(crate) former: FormerLabels,
    pub(crate) map_version: u64,
    pub(crate) earlier: Option<Arc<EarlierMap>>,
    pub(crate) contact: StoredContact,
    pub(crate) travel: TravelMemory,
    /// The faults of the equipment in the last status, as on the wire.
    pub(crate) faults: u8,
    pub(crate) orders: OrderMemory,
    pub(crate) images: ImageMemory,
    pub(crate) annotations: AnnotationMemory,
    /// The tree of the labels as on the wire; empty before the first.
    pub(crate) tree: Vec<u8>,
    /// Set in an archived map only: end of the run in microseconds of mission time, number of cells.
    pub(crate) archived: Option<(u64, u64)>,
}

impl VehicleMemory {
    pub fn name(&self) -> &str {
        &self.name
    }

    pub fn id(&self) -> RunId {
        self.id
    }

    /// The map of the current run.
    pub fn map(&self) -> &MapCopy {
        &self.map
    }

    /// The labels that a cell had before its present one with the times of their replacement, the newest first.
    pub fn former_labels(&self, cell: Cell) -> impl Iterator<Item = (u8, Instant)> + '_ {
        self.former.of(cell)
    }

    /// The end of the run of an archived map in microseconds of mission time, and its cells.
    pub fn archived(&self) -> Option<(u64, u64)> {
        self.archived
    }

    /// The operator's names of labels.
    pub fn labels(&self) -> &LabelBook {
        &self.annotations.labels
    }

    /// The markers on the map.
    pub fn markers(&self) -> impl Iterator<Item = &StoredMarker> {
        self.annotations.markers.values()
    }

    /// The last tree of the labels of the current epoch.
    pub fn tree(&self) -> Option<LabelTree> {
        LabelTree::from_bytes(&self.tree)
    }

    /// The images that have arrived, by label.
    pub fn exemplars(&self) -> &BTreeMap<u8, Vec<StoredImage>> {
        &self.images.exemplars
    }

    /// Time in microseconds, metres east and north.
    pub fn track(&self) -> impl Iterator<Item = (u64, f64, f64)> {
        self.travel.track.iter().copied()
    }

    /// The placement of the map, metres to add east and north, if a fix has moved it.
    pub fn placement_m(&self) -> Option<(f64, f64)> {
        let status = self.contact.status()?.0;
        status.placement.map(|p| (p.origin.east_m, p.origin.north_m))
    }

    pub(crate) fn apply(&mut self, event: &VehicleEvent) {
        match event {
            VehicleEvent::Named(name) => self.name.clone_from(name),
            VehicleEvent::Identified(id) => {
                if id.epoch != self.id.epoch {
                    // Names, tree and former labels are those of the epoch that has ended.
                    self.annotations.labels.clear();
                    self.tree.clear();
                    self.former = FormerLabels::default();
                }
                self.id = *id;
            }
            VehicleEvent::Replaced => self.replace(),
            VehicleEvent::Overtaken => self.earlier = None,
            VehicleEvent::Cells(cells) => {
                self.former.handle_cells(self.map.labels(), cells);
                self.map.apply(cells);
            }
            VehicleEvent::Former(changes) => self.former.restore(changes),
            VehicleEvent::MapVersion(version) => self.map_version = *version,
            VehicleEvent::Contact(contact) => self.contact.clone_from(contact),
            VehicleEvent::Track { total, points } => self.travel.extend_track(*total, points),
            VehicleEvent::Registration { report, total, closures } => {
                self.travel.register(report.clone(), *total, closures);
            }
            VehicleEvent::Faults(faults) => self.faults = *faults,
            VehicleEvent::Tree(tree) => self.tree.clone_from(tree),
            VehicleEvent::Orders { series, orders } => {
                self.orders.series = *series;
                self.orders.sent.clone_from(orders);
            }
            VehicleEvent::Intent(intent) => self.orders.intent.clone_from(intent),
            VehicleEvent::Places(places) => self.orders.places.clone_from(places),
            VehicleEvent::InForce(contents) => self.orders.in_force.clone_from(contents),
            VehicleEvent::Exemplar { label, image } => {
                self.images.remove(*label, image.number);
                self.images.exemplars.entry(*label).or_default().push(image.clone());
            }
            VehicleEvent::ExemplarGone { label, number } => self.images.remove(*label, *number),
            VehicleEvent::Floor(view) => _ = self.images.floor.insert(view.middle_dm, view.clone()),
            VehicleEvent::FloorGone(middle_dm) => _ = self.images.floor.remove(middle_dm),
            VehicleEvent::Request { label, serial, open } => self.images.set_request(*label, (*serial, *open)),
            VehicleEvent::Label { label, book } => self.annotations.set_label(*label, book),
            VehicleEvent::Note(note) => self.annotations.add_note(note),
            VehicleEvent::Marker(marker) => self.annotations.set_marker(marker),
            VehicleEvent::MarkerGone(number) => {
                self.annotations.markers.remove(number);
            }
            VehicleEvent::Draft(draft) => self.annotations.draft.clone_from(draft),
            VehicleEvent::Archived { ended_us, cells } => self.archived = Some((*ended_us, *cells)),
        }
    }

    /// The map so far becomes the earlier one, unless that has more cells.
    fn replace(&mut self) {
        let map = std::mem::take(&mut self.map);
        let is_larger = self.earlier.as_ref().is_none_or(|earlier| map.explored() >= earlier.map.explored());
        if map.explored() > 0 && is_larger {
            let (RunId { run, epoch, .. }, names, tree) = (self.id, self.annotations.labels.clone(), self.tree());
            let contact = StoredContact { usbl: None, ..self.contact.clone() };
            self.earlier = Some(Arc::new(EarlierMap { run, epoch, names, tree, map, contact }));
        }
    }

    pub(super) fn to_events(&self) -> Vec<VehicleEvent> {
        let mut all = vec![VehicleEvent::Named(self.name.clone())];
        all.extend(self.archived.map(|(ended_us, cells)| VehicleEvent::Archived { ended_us, cells }));
        if let Some(earlier) = &self.earlier {
            let id = RunId { run: earlier.run, epoch: earlier.epoch, began_unix_ms: 0 };
            all.push(VehicleEvent::Identified(id));
            all.extend(earlier.map.to_events().into_iter().map(VehicleEvent::Cells));
            all.extend(earlier.names.iter().map(named));
            all.extend(earlier.tree.iter().map(|tree| VehicleEvent::Tree(tree.to_bytes())));
            all.extend([VehicleEvent::Contact(earlier.contact.clone()), VehicleEvent::Replaced]);
            all.push(VehicleEvent::Tree(Vec::new()));
            let book = StoredLabel::default();
            all.extend(earlier.names.keys().map(|&label| VehicleEvent::Label { label, book: book.clone() }));
        }
        all.extend(self.run_events());
        all.push(VehicleEvent::MapVersion(self.map_version));
        all.extend(self.orders.to_events());
        all.push(VehicleEvent::Draft(self.annotations.draft.clone()));
        let request = |(&label, &(serial, open))| VehicleEvent::Request { label, serial, open };
        all.extend(self.images.requests.iter().map(request));
        all
    }

    /// The events that belong to the current run: identity, map, former labels, contact, track, registration,
    /// images, names, notes, markers.
    fn run_events(&self) -> Vec<VehicleEvent> {
        let mut all = vec![VehicleEvent::Identified(self.id)];
        all.extend(self.map.to_events().into_iter().map(VehicleEvent::Cells));
        all.extend(self.former.to_events().into_iter().map(VehicleEvent::Former));
        all.push(VehicleEvent::Contact(self.contact.clone()));
        all.extend(self.travel.to_events());
        if self.faults != 0 {
            all.push(VehicleEvent::Faults(self.faults));
        }
        if !self.tree.is_empty() {
            all.push(VehicleEvent::Tree(self.tree.clone()));
        }
        all.extend(self.images.to_events());
        all.extend(self.annotations.to_events());
        all
    }

    /// The map of the run with everything that belongs to it but the views of the sea floor, for the archive.
    pub(crate) fn archive(&self, ended_us: u64) -> Vec<VehicleEvent> {
        let cells = self.map.explored() as u64;
        let head = [VehicleEvent::Archived { ended_us, cells }, VehicleEvent::Named(self.name.clone())];
        let is_floor = |event: &VehicleEvent| matches!(event, VehicleEvent::Floor(_));
        head.into_iter().chain(self.run_events().into_iter().filter(|event| !is_floor(event))).collect()
    }
}

/// Where a vehicle was, as far as it is kept; times in microseconds, metres east and north.
#[derive(Debug, Default)]
pub(crate) struct TravelMemory {
    pub(crate) track: VecDeque<(u64, f64, f64)>,
    /// Positions of the track that there were in all.
    pub(crate) track_total: u64,
    /// The last report on the registration of frames, with its time.
    pub(crate) registration: Option<(u64, Vec<u8>)>,
    /// The positions of closed loops.
    pub(crate) closures: VecDeque<(u64, f64, f64)>,
    pub(crate) closures_total: u64,
}

impl TravelMemory {
    fn extend_track(&mut self, total: u64, points: &[(u64, f64, f64)]) {
        self.track_total = total;
        extend(&mut self.track, points);
    }

    fn register(&mut self, report: Option<(u64, Vec<u8>)>, total: u64, closures: &[(u64, f64, f64)]) {
        (self.registration, self.closures_total) = (report, total);
        extend(&mut self.closures, closures);
    }

    fn to_events(&self) -> impl Iterator<Item = VehicleEvent> {
        let track = VehicleEvent::Track { total: self.track_total, points: self.track.iter().copied().collect() };
        let registration = self.registration.clone().map(|report| VehicleEvent::Registration {
            report: Some(report),
            total: self.closures_total,
            closures: self.closures.iter().copied().collect(),
        });
        std::iter::once(track).chain(registration)
    }
}

fn extend(track: &mut VecDeque<(u64, f64, f64)>, points: &[(u64, f64, f64)]) {
    track.extend(points.iter().copied());
    track.drain(..track.len().saturating_sub(MAX_TRACK));
}

/// The images that a vehicle has sent, and the requests for more.
#[derive(Debug, Default)]
pub(crate) struct ImageMemory {
    /// By label, in the order of arrival.
    pub(crate) exemplars: BTreeMap<u8, Vec<StoredImage>>,
    /// Views of the sea floor by their middle.
    pub(crate) floor: BTreeMap<(i32, i32), StoredImage>,
    /// Serial number of requests and the open one, by label.
    pub(crate) requests: BTreeMap<u8, (u8, Option<StoredRequest>)>,
}

impl ImageMemory {
    fn remove(&mut self, label: u8, number: u8) {
        let images = self.exemplars.entry(label).or_default();
        images.retain(|kept| kept.number != number);
        if images.is_empty() {
            self.exemplars.remove(&label);
        }
    }

    fn set_request(&mut self, label: u8, request: (u8, Option<StoredRequest>)) {
        match request {
            (0, None) => self.requests.remove(&label),
            request => self.requests.insert(label, request),
        };
    }

    /// The images; requests belong to no run.
    fn to_events(&self) -> impl Iterator<Item = VehicleEvent> {
        let of_label = |(&label, images): (&u8, &Vec<StoredImage>)| {
            images.iter().map(|image| VehicleEvent::Exemplar { label, image: image.clone() }).collect::<Vec<_>>()
        };
        self.exemplars.iter().flat_map(of_label).chain(self.floor.values().cloned().map(VehicleEvent::Floor))
    }
}

/// The orders to a vehicle.
#[derive(Debug, Default)]
pub(crate) struct OrderMemory {
    pub(crate) sent: Vec<StoredOrder>,
    /// The series of the versions of the orders; 0 before the first.
    pub(crate) series: u64,
    pub(crate) intent: StoredIntent,
    pub(crate) places: StoredPlaces,
    /// The contents that are or may be in force, slots as on the wire.
    pub(crate) in_force: Vec<Vec<u8>>,
}

impl OrderMemory {
    fn to_events(&self) -> [VehicleEvent; 4] {
        [
            VehicleEvent::Orders { series: self.series, orders: self.sent.clone() },
            VehicleEvent::Intent(self.intent.clone()),
            VehicleEvent::Places(self.places.clone()),
            VehicleEvent::InForce(self.in_force.clone()),
        ]
    }
}

/// What people have written on the map of a vehicle.
#[derive(Debug, Default)]
pub(crate) struct AnnotationMemory {
    pub(crate) labels: LabelBook,
    pub(crate) notes: VecDeque<StoredNote>,
    pub(crate) markers: BTreeMap<u32, StoredMarker>,
    pub(crate) draft: StoredDraft,
}

impl AnnotationMemory {
    fn set_label(&mut self, label: u8, book: &StoredLabel) {
        match *book == StoredLabel::default() {
            true => self.labels.remove(&label),
            false => self.labels.insert(label, book.clone()),
        };
    }

    fn add_note(&mut self, note: &StoredNote) {
        self.notes.push_back(note.clone());
        self.notes.drain(..self.notes.len().saturating_sub(MAX_NOTES));
    }

    fn set_marker(&mut self, marker: &StoredMarker) {
        self.markers.insert(marker.number, marker.clone());
        while self.markers.len() > MAX_MARKERS {
            self.markers.pop_first();
        }
    }

    /// All but the draft, which belongs to no run.
    fn to_events(&self) -> impl Iterator<Item = VehicleEvent> {
        let labels = self.labels.iter().map(named);
        let notes = self.notes.iter().cloned().map(VehicleEvent::Note);
        labels.chain(notes).chain(self.markers.values().cloned().map(VehicleEvent::Marker))
    }
}

fn named((&label, book): (&u8, &StoredLabel)) -> VehicleEvent {
    VehicleEvent::Label { label, book: book.clone() }
}

#[cfg(test)]
mod tests {
    use super::super::event::StoredCells;
    use super::*;

    #[test]
    fn an_earlier_map_keeps_the_tree_of_its_labels() {
        let tree = |merges: &[(u8, u8)]| LabelTree::new(merges.to_vec(), None).unwrap();
        let (first, second) = (tree(&[(1, 2), (1, 3)]), tree(&[(2, 4)]));
        let epoch = |epoch: u8| VehicleEvent::Identified(RunId { run: epoch.into(), epoch, began_unix_ms: 0 });
        let cells = VehicleEvent::Cells(StoredCells { layer: None, cells: vec![(3, -2, 1, 0), (1, 0, 2, 0)] });
        let mut memory = VehicleMemory::default();
        for event in [epoch(1), cells, VehicleEvent::Tree(first.to_bytes()), VehicleEvent::Replaced, epoch(2)] {
            memory.apply(&event);
        }
        let trees = |memory: &VehicleMemory| (memory.earlier.as_ref().and_then(|map| map.tree.clone()), memory.tree());
        assert_eq!(trees(&memory), (Some(first.clone()), None));
        memory.apply(&VehicleEvent::Tree(second.to_bytes()));
        let mut again = VehicleMemory::default();
        memory.to_events().iter().for_each(|event| again.apply(event));
        assert_eq!(trees(&again), (Some(first), Some(second)));
    }
}
