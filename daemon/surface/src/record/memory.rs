//! The surface's knowledge, folded from its events.

use super::cells::{EarlierMap, FormerLabels, MapCopy};
use super::event::{
    Event, EventKind, EventTime, RunId, StoredBudget, StoredCommand, StoredCommandChange, StoredContact, StoredDraft,
    StoredImage, StoredIntent, StoredMarker, StoredNote, StoredOrder, StoredPlaces, StoredRequest, VehicleEvent,
};
use crate::label_book::{LabelBook, StoredLabel};
use crate::log::{StoredLogEntry, make_room};
use scenecast_protocol::map::{Cell, LabelTree};
use scenecast_protocol::time::Instant;
use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

/// Positions that are kept of a vehicle's track, and of its closed loops.
const MAX_TRACK: usize = 500;
/// Notes that are kept of a vehicle.
const MAX_NOTES: usize = 200;
/// Changes of command that are kept.
pub(crate) const MAX_COMMAND_CHANGES: usize = 32;
/// The most markers that are kept; a surface sets no more.
pub(crate) const MAX_MARKERS: usize = 200;

/// How a store was begun.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Began {
    /// A random name, under which browsers keep their own data.
    pub id: u32,
    /// The number of the mission.
    pub mission: u32,
    /// The series of the orders' versions.
    pub series: u64,
}

/// Everything that the surface keeps.
#[derive(Debug, Default)]
pub struct SurfaceMemory {
    /// The sequence number of the last event.
    pub(crate) sequence: u64,
    /// The time of the last event.
    pub(crate) last: EventTime,
    /// How the store was begun.
    pub(crate) began: Option<Began>,
    /// The last order of a budget, and the configured one at that time.
    pub(crate) budget: Option<(StoredBudget, StoredBudget)>,
    pub(crate) vehicles: BTreeMap<u8, VehicleMemory>,
    /// The last entries of the log.
    pub(crate) log: VecDeque<StoredLogEntry>,
    /// The holder of command and the requests for it.
    pub(crate) command: StoredCommand,
    /// The last changes of command.
    pub(crate) command_changes: VecDeque<StoredCommandChange>,
}

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
    pub(crate) track_total: u64,
    pub(crate) track: VecDeque<(u64, f64, f64)>,
    /// The last report on the registration of frames, with its time; the positions of closed loops, and their number.
    pub(crate) registration: Option<(u64, Vec<u8>)>,
    /// The faults of the equipment in the last status, as on the wire.
    pub(crate) faults: u8,
    pub(crate) closures_total: u64,
    pub(crate) closures: VecDeque<(u64, f64, f64)>,
    pub(crate) orders: Vec<StoredOrder>,
    /// The series of the versions of the orders; 0 before the first.
    pub(crate) series: u64,
    pub(crate) intent: StoredIntent,
    pub(crate) places: StoredPlaces,
    /// The contents that are or may be in force, slots as on the wire.
    pub(crate) in_force: Vec<Vec<u8>>,
    /// By label, in the order of arrival.
    pub(crate) exemplars: BTreeMap<u8, Vec<StoredImage>>,
    /// By their middle.
    pub(crate) floor: BTreeMap<(i32, i32), StoredImage>,
    /// Serial number of requests and the open one, by label.
    pub(crate) requests: BTreeMap<u8, (u8, Option<StoredRequest>)>,
    pub(crate) labels: LabelBook,
    /// The tree of the labels as on the wire; empty before the first.
    pub(crate) tree: Vec<u8>,
    pub(crate) notes: VecDeque<StoredNote>,
    pub(crate) markers: BTreeMap<u32, StoredMarker>,
    pub(crate) draft: StoredDraft,
    /// Set in an archived map only: end of the run in microseconds of mission time, number of cells.
    pub(crate) archived: Option<(u64, u64)>,
}

impl SurfaceMemory {
    /// The state after these events, oldest first.
    pub fn fold(events: impl IntoIterator<Item = Event>) -> Self {
        let mut memory = Self::default();
        events.into_iter().for_each(|event| memory.apply(&event));
        memory
    }

    pub fn apply(&mut self, event: &Event) {
        (self.sequence, self.last) = (event.sequence, event.time);
        match &event.kind {
            &EventKind::Began { id, mission, series } => self.began = Some(Began { id, mission, series }),
            EventKind::Budget { ordered, configured } => self.budget = Some((ordered.clone(), configured.clone())),
            EventKind::Vehicle(address, event) => self.vehicles.entry(*address).or_default().apply(event),
            EventKind::Logged(entry) => {
                self.log.push_back(entry.clone());
                make_room(&mut self.log, StoredLogEntry::group);
            }
            EventKind::Command(command) => self.command = command.clone(),
            EventKind::CommandChanged(change) => {
                self.command_changes.push_back(change.clone());
                self.command_changes.drain(..self.command_changes.len().saturating_sub(MAX_COMMAND_CHANGES));
            }
        }
    }

    /// The time of the last event.
    pub fn last(&self) -> EventTime {
        self.last
    }

    /// How the store was begun; `None` before the first event.
    pub fn began(&self) -> Option<Began> {
        self.began
    }

    /// The state as events that make it from nothing.
    pub fn to_events(&self) -> Vec<EventKind> {
        let began = self.began.map(|Began { id, mission, series }| EventKind::Began { id, mission, series });
        let mut all: Vec<EventKind> = began.into_iter().collect();
        let budget = self.budget.clone();
        all.extend(budget.map(|(ordered, configured)| EventKind::Budget { ordered, configured }));
        for (&address, vehicle) in &self.vehicles {
            all.extend(vehicle.to_events().into_iter().map(|event| EventKind::Vehicle(address, event)));
        }
        all.extend(self.log.iter().cloned().map(EventKind::Logged));
        all.extend(Some(self.command.clone()).filter(|c| *c != StoredCommand::default()).map(EventKind::Command));
        all.extend(self.command_changes.iter().cloned().map(EventKind::CommandChanged));
        all
    }

    /// A vehicle by its address.
    pub fn vehicle(&self, address: u8) -> Option<&VehicleMemory> {
        self.vehicles.get(&address)
    }

    /// The knowledge about one vehicle alone.
    pub fn take_vehicle(mut self, address: u8) -> Option<VehicleMemory> {
        self.vehicles.remove(&address)
    }

    /// The vehicles by their addresses.
    pub fn vehicles(&self) -> impl Iterator<Item = (u8, &VehicleMemory)> {
        self.vehicles.iter().map(|(&address, vehicle)| (address, vehicle))
    }
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
        &self.labels
    }

    /// The markers on the map.
    pub fn markers(&self) -> impl Iterator<Item = &StoredMarker> {
        self.markers.values()
    }

    /// The last tree of the labels of the current epoch.
    pub fn tree(&self) -> Option<LabelTree> {
        LabelTree::from_bytes(&self.tree)
    }

    /// The images that have arrived, by label.
    pub fn exemplars(&self) -> &BTreeMap<u8, Vec<StoredImage>> {
        &self.exemplars
    }

    /// Time in microseconds, metres east and north.
    pub fn track(&self) -> impl Iterator<Item = (u64, f64, f64)> {
        self.track.iter().copied()
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
                    self.labels.clear();
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
            VehicleEvent::Track { total, points } => {
                self.track_total = *total;
                self.track.extend(points.iter().copied());
                self.track.drain(..self.track.len().saturating_sub(MAX_TRACK));
            }
            VehicleEvent::Registration { report, total, closures } => {
                (self.registration, self.closures_total) = (report.clone(), *total);
                self.closures.extend(closures.iter().copied());
                self.closures.drain(..self.closures.len().saturating_sub(MAX_TRACK));
            }
            VehicleEvent::Faults(faults) => self.faults = *faults,
            VehicleEvent::Tree(tree) => self.tree.clone_from(tree),
            VehicleEvent::Orders { series, orders } => {
                self.series = *series;
                self.orders.clone_from(orders);
            }
            VehicleEvent::Intent(intent) => self.intent.clone_from(intent),
            VehicleEvent::Places(places) => self.places.clone_from(places),
            VehicleEvent::InForce(contents) => self.in_force.clone_from(contents),
            VehicleEvent::Exemplar { label, image } => {
                let images = self.exemplars.entry(*label).or_default();
                images.retain(|kept| kept.number != image.number);
                images.push(image.clone());
            }
            VehicleEvent::ExemplarGone { label, number } => {
                let images = self.exemplars.entry(*label).or_default();
                images.retain(|kept| kept.number != *number);
                if images.is_empty() {
                    self.exemplars.remove(label);
                }
            }
            VehicleEvent::Floor(view) => _ = self.floor.insert(view.middle_dm, view.clone()),
            VehicleEvent::FloorGone(middle_dm) => _ = self.floor.remove(middle_dm),
            VehicleEvent::Request { label, serial, open } => {
                match (*serial, *open) {
                    (0, None) => self.requests.remove(label),
                    request => self.requests.insert(*label, request),
                };
            }
            VehicleEvent::Label { label, book } => {
                match *book == StoredLabel::default() {
                    true => self.labels.remove(label),
                    false => self.labels.insert(*label, book.clone()),
                };
            }
            VehicleEvent::Note(note) => {
                self.notes.push_back(note.clone());
                self.notes.drain(..self.notes.len().saturating_sub(MAX_NOTES));
            }
            VehicleEvent::Marker(marker) => {
                self.markers.insert(marker.number, marker.clone());
                while self.markers.len() > MAX_MARKERS {
                    self.markers.pop_first();
                }
            }
            VehicleEvent::MarkerGone(number) => {
                self.markers.remove(number);
            }
            VehicleEvent::Draft(draft) => self.draft.clone_from(draft),
            VehicleEvent::Archived { ended_us, cells } => self.archived = Some((*ended_us, *cells)),
        }
    }

    /// The map so far becomes the earlier one, unless that has more cells.
    fn replace(&mut self) {
        let map = std::mem::take(&mut self.map);
        let is_larger = self.earlier.as_ref().is_none_or(|earlier| map.explored() >= earlier.map.explored());
        if map.explored() > 0 && is_larger {
            let (RunId { run, epoch, .. }, names, tree) = (self.id, self.labels.clone(), self.tree());
            let contact = StoredContact { usbl: None, ..self.contact.clone() };
            self.earlier = Some(Arc::new(EarlierMap { run, epoch, names, tree, map, contact }));
        }
    }

    fn to_events(&self) -> Vec<VehicleEvent> {
        let named = |(&label, book): (&u8, &StoredLabel)| VehicleEvent::Label { label, book: book.clone() };
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
        all.extend([
            VehicleEvent::MapVersion(self.map_version),
            VehicleEvent::Orders { series: self.series, orders: self.orders.clone() },
            VehicleEvent::Intent(self.intent.clone()),
            VehicleEvent::Places(self.places.clone()),
            VehicleEvent::InForce(self.in_force.clone()),
            VehicleEvent::Draft(self.draft.clone()),
        ]);
        let request = |(&label, &(serial, open))| VehicleEvent::Request { label, serial, open };
        all.extend(self.requests.iter().map(request));
        all
    }

    /// The events that belong to the current run: identity, map, former labels, contact, track, registration,
    /// images, names, notes, markers.
    fn run_events(&self) -> Vec<VehicleEvent> {
        let mut all = vec![VehicleEvent::Identified(self.id)];
        all.extend(self.map.to_events().into_iter().map(VehicleEvent::Cells));
        all.extend(self.former.to_events().into_iter().map(VehicleEvent::Former));
        all.push(VehicleEvent::Contact(self.contact.clone()));
        all.push(VehicleEvent::Track { total: self.track_total, points: self.track.iter().copied().collect() });
        if self.registration.is_some() {
            let (total, closures) = (self.closures_total, self.closures.iter().copied().collect());
            all.push(VehicleEvent::Registration { report: self.registration.clone(), total, closures });
        }
        if self.faults != 0 {
            all.push(VehicleEvent::Faults(self.faults));
        }
        if !self.tree.is_empty() {
            all.push(VehicleEvent::Tree(self.tree.clone()));
        }
        for (&label, images) in &self.exemplars {
            all.extend(images.iter().map(|image| VehicleEvent::Exemplar { label, image: image.clone() }));
        }
        all.extend(self.floor.values().cloned().map(VehicleEvent::Floor));
        let named = |(&label, book): (&u8, &StoredLabel)| VehicleEvent::Label { label, book: book.clone() };
        all.extend(self.labels.iter().map(named));
        all.extend(self.notes.iter().cloned().map(VehicleEvent::Note));
        all.extend(self.markers.values().cloned().map(VehicleEvent::Marker));
        all
    }

    /// The map of the run with everything that belongs to it, for the archive.
    pub(crate) fn archive(&self, ended_us: u64) -> Vec<VehicleEvent> {
        let cells = self.map.explored() as u64;
        let head = [VehicleEvent::Archived { ended_us, cells }, VehicleEvent::Named(self.name.clone())];
        head.into_iter().chain(self.run_events()).collect()
    }
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
