//! Finds the events that lead from the stored knowledge to the surface's present one.
//!
//! [`Recorder`] compares the surface with its [`SurfaceMemory`] and yields the [`Event`]s between them; the host writes
//! these before it shows or sends anything that depends on them.

mod command;
mod restore;
mod stored;

use crate::Surface;
use crate::exemplar_cache::StoredExemplar;
use crate::record::{
    Event, EventKind, EventSource, EventTime, RunId, StoredBudget, StoredImage, StoredLogEntry, SurfaceMemory,
    VehicleEvent, VehicleMemory,
};
use crate::track::Track;
use crate::vehicle_record::VehicleRecord;
use scenecast_protocol::link::PeerView;
use scenecast_protocol::map::{LabelTree, LayerId, SharedTiles};
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::{Address, EquipmentFaults};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// A map that was archived: the vehicle's address, the run, and the events that make the map from nothing.
#[derive(Debug, Clone, PartialEq)]
pub struct Archive {
    pub vehicle: u8,
    pub id: RunId,
    pub events: Vec<Event>,
}

/// The changes since the last observation.
#[derive(Debug, Default)]
pub struct Observation {
    pub events: Vec<Event>,
    /// Maps to write before the events, because these replace them.
    pub archives: Vec<Archive>,
}

/// Follows the surface, and keeps what is to survive a restart.
#[derive(Debug, Default)]
pub struct Recorder {
    memory: SurfaceMemory,
    /// The state of each vehicle's map when it was last compared.
    seen: BTreeMap<Address, SeenMap>,
    /// The budget of the configuration file.
    configured: StoredBudget,
}

#[derive(Debug, Default)]
struct SeenMap {
    generation: u64,
    version: u64,
    updated: Option<Instant>,
    /// The vehicle has reported an epoch since the copy was emptied.
    has_epoch: bool,
    /// The tiles of the labels and of the layers then; only others are compared.
    labels: SharedTiles,
    layers: BTreeMap<LayerId, SharedTiles>,
}

impl Recorder {
    /// Begins with the state that survived.
    pub fn new(memory: SurfaceMemory) -> Self {
        Self { memory, ..Self::default() }
    }

    /// The state after all events so far.
    pub fn memory(&self) -> &SurfaceMemory {
        &self.memory
    }

    /// All events in one, for a new file.
    pub fn snapshot(&self) -> Vec<Event> {
        let (sequence, time) = (self.memory.sequence, self.memory.last);
        let event = |kind| Event { sequence, time, source: EventSource::Surface, kind };
        self.memory.to_events().into_iter().map(event).collect()
    }

    /// Begins the store of a mission, or a run of the surface with the state of an earlier one: its maps count as earlier
    /// maps until the vehicles have sent them again. `id` and `mission` are those of a new store.
    pub fn begin(&mut self, surface: &mut Surface, id: u32, mission: u32, time: EventTime) -> Observation {
        let mut found = Observation::default();
        self.configured = budget(surface);
        match self.memory.began {
            None => {
                let series = surface.link.series().get();
                self.push(&mut found, EventSource::Surface, time, EventKind::Began { id, mission, series });
            }
            Some(_) => {
                for address in self.memory.vehicles.keys().copied().collect::<Vec<_>>() {
                    self.replace(&mut found, address, time);
                }
                restore::restore(surface, &self.memory, &self.configured);
            }
        }
        let follow = self.observe(surface, None, time);
        found.events.extend(follow.events);
        found.archives.extend(follow.archives);
        found
    }

    /// The events since the last observation. New orders are those of the principal `by`.
    pub fn observe(&mut self, surface: &mut Surface, by: Option<&str>, time: EventTime) -> Observation {
        let mut found = Observation::default();
        let source = by.map_or(EventSource::Surface, |name| EventSource::Principal(name.to_owned()));
        self.observe_budget(surface, &source, &mut found, time);
        for address in surface.records.keys().copied().collect::<Vec<_>>() {
            self.observe_vehicle(surface, address, by, &mut found, time);
        }
        self.observe_log(surface, &mut found, time);
        self.observe_command(surface, &source, &mut found, time);
        found
    }

    fn push(&mut self, found: &mut Observation, source: EventSource, time: EventTime, kind: EventKind) {
        let event = Event { sequence: self.memory.sequence.saturating_add(1), time, source, kind };
        self.memory.apply(&event);
        found.events.push(event);
    }

    fn observe_log(&mut self, surface: &Surface, found: &mut Observation, time: EventTime) {
        let known = self.memory.log.back().map_or(0, |entry| entry.number);
        let news = surface.log.entries().rev().take_while(|entry| entry.number > known);
        let news: Vec<StoredLogEntry> = news.map(StoredLogEntry::from).collect();
        for entry in news.into_iter().rev() {
            self.push(found, EventSource::Surface, time, EventKind::Logged(entry));
        }
    }

    fn observe_command(&mut self, surface: &Surface, source: &EventSource, found: &mut Observation, time: EventTime) {
        for change in command::news(&surface.command, &self.memory) {
            self.push(found, source.clone(), time, EventKind::CommandChanged(change));
        }
        let present = command::stored(&surface.command, Instant::from_micros(time.mission_us));
        if present != self.memory.command {
            self.push(found, source.clone(), time, EventKind::Command(present));
        }
    }

    fn observe_budget(&mut self, surface: &Surface, source: &EventSource, found: &mut Observation, time: EventTime) {
        let ordered = budget(surface);
        let known = self.memory.budget.as_ref().map_or(&self.configured, |(ordered, _)| ordered);
        if *known != ordered {
            let configured = self.configured.clone();
            self.push(found, source.clone(), time, EventKind::Budget { ordered, configured });
        }
    }

    /// Archives the map of a run, and makes it the earlier one.
    fn replace(&mut self, found: &mut Observation, address: u8, time: EventTime) {
        let Some(memory) = self.memory.vehicles.get(&address).filter(|v| v.map.explored() > 0) else { return };
        let events = memory.archive(time.mission_us).into_iter().zip(1..).map(|(event, sequence)| Event {
            sequence,
            time,
            source: EventSource::Vehicle(address),
            kind: EventKind::Vehicle(address, event),
        });
        found.archives.push(Archive { vehicle: address, id: memory.id, events: events.collect() });
        let replaced = EventKind::Vehicle(address, VehicleEvent::Replaced);
        self.push(found, EventSource::Vehicle(address), time, replaced);
    }

    fn observe_vehicle(
        &mut self,
        surface: &mut Surface,
        address: Address,
        by: Option<&str>,
        found: &mut Observation,
        time: EventTime,
    ) {
        let number = address.number();
        let (Some(record), Some(view)) = (surface.records.get_mut(&address), surface.link.vehicle(address)) else {
            return;
        };
        let mut seen = self.seen.remove(&address).unwrap_or_default();
        let has_status = view.status().is_some();
        let memory = self.memory.vehicles.entry(number).or_default();
        let is_new_epoch = seen.has_epoch && has_status && record.epoch != memory.id.epoch;
        if seen.generation != view.generation() || is_new_epoch {
            seen = SeenMap { generation: view.generation(), ..SeenMap::default() };
            self.replace(found, number, time);
        }
        seen.has_epoch |= has_status;

        let memory = self.memory.vehicles.entry(number).or_default();
        let mut events = Vec::new();
        identity(record, memory, time, &mut events);
        let updated = map_updated(&view);
        let version = record.map_version(&view);
        if (version, updated) != (seen.version, seen.updated) {
            (seen.version, seen.updated) = (version, updated);
            map_changes(&view, memory, &mut seen, &mut events);
        }
        self.seen.insert(address, seen);
        for event in events {
            self.push(found, EventSource::Vehicle(number), time, EventKind::Vehicle(number, event));
        }
        self.settle_earlier(record, number, by, found, time);

        let memory = self.memory.vehicles.entry(number).or_default();
        let mut events = Vec::new();
        let version = record.map_version(&view);
        if memory.map_version != version {
            events.push(VehicleEvent::MapVersion(version));
        }
        contact_changes(record, &view, memory, &mut events);
        let orders_from = events.len();
        order_changes(record, &view, memory, &mut events);
        for (i, event) in events.into_iter().enumerate() {
            let source = match by {
                Some(name) if i >= orders_from => EventSource::Principal(name.to_owned()),
                _ => EventSource::Vehicle(number),
            };
            self.push(found, source, time, EventKind::Vehicle(number, event));
        }
    }

    /// Gives the surface the earlier map to show, until the current one has as many cells or the operator dismisses it.
    fn settle_earlier(
        &mut self,
        record: &mut VehicleRecord,
        number: u8,
        by: Option<&str>,
        found: &mut Observation,
        time: EventTime,
    ) {
        let memory = self.memory.vehicles.entry(number).or_default();
        let Some(earlier) = &memory.earlier else { return };
        if record.earlier.is_dismissed || memory.map.explored() >= earlier.map.explored() {
            let source = by.filter(|_| record.earlier.is_dismissed);
            record.show_earlier(None);
            let source = source.map_or(EventSource::Vehicle(number), |name| EventSource::Principal(name.to_owned()));
            self.push(found, source, time, EventKind::Vehicle(number, VehicleEvent::Overtaken));
        } else if record.earlier.map.as_ref().is_none_or(|shown| !Arc::ptr_eq(shown, earlier)) {
            record.show_earlier(Some(earlier.clone()));
        }
    }
}

fn budget(surface: &Surface) -> StoredBudget {
    StoredBudget {
        bits_per_s: surface.budget_bps(),
        shares: surface.shares().0,
        background: surface.background().to_bytes(),
    }
}

fn identity(record: &VehicleRecord, memory: &VehicleMemory, time: EventTime, events: &mut Vec<VehicleEvent>) {
    if memory.name != record.name {
        events.push(VehicleEvent::Named(record.name.clone()));
    }
    let (run, epoch) = (record.run, record.epoch);
    if (memory.id.run, memory.id.epoch) != (run, epoch) {
        events.push(VehicleEvent::Identified(RunId { run, epoch, began_unix_ms: time.unix_ms }));
    }
}

/// When a chunk last changed or confirmed the map or a layer.
fn map_updated(view: &PeerView<'_>) -> Option<Instant> {
    let layers = view.layers().iter().filter_map(|(id, _)| view.layer(id)?.levels().updated());
    layers.chain(view.replica().updated()).max()
}

fn map_changes(view: &PeerView<'_>, memory: &VehicleMemory, seen: &mut SeenMap, events: &mut Vec<VehicleEvent>) {
    let labels = memory.map.label_changes(view.replica().cells_apart_from(&seen.labels));
    events.extend(labels.into_iter().map(VehicleEvent::Cells));
    for (id, _) in view.layers().iter() {
        let Some(live) = view.layer(id) else { continue };
        let compared = seen.layers.entry(id).or_default();
        events.extend(memory.map.layer_changes(id, live, compared).into_iter().map(VehicleEvent::Cells));
        compared.clone_from(live.levels().tiles());
    }
    seen.labels.clone_from(view.replica().tiles());
}

fn contact_changes(
    record: &VehicleRecord,
    view: &PeerView<'_>,
    memory: &VehicleMemory,
    events: &mut Vec<VehicleEvent>,
) {
    let contact = stored::contact(record, view);
    if memory.contact != contact {
        events.push(VehicleEvent::Contact(contact));
    }
    let points = new_points(&record.track, memory.travel.track_total);
    if !points.is_empty() {
        events.push(VehicleEvent::Track { total: record.track.total(), points });
    }
    let report = record.registration.latest().map(|(report, at)| (at.as_micros(), report.encode().to_vec()));
    if memory.travel.registration != report {
        let closures = record.registration.closures();
        let (total, closures) = (closures.total(), new_points(closures, memory.travel.closures_total));
        events.push(VehicleEvent::Registration { report, total, closures });
    }
    let [faults] = record.status(view).map_or(EquipmentFaults::default(), |(status, _)| status.faults).encode();
    if memory.faults != faults {
        events.push(VehicleEvent::Faults(faults));
    }
    exemplar_changes(record, memory, events);
    floor_changes(record, memory, events);
}

/// The points of a track after the first `known` ones, as far as they are kept; times in microseconds.
fn new_points(track: &Track, known: u64) -> Vec<(u64, f64, f64)> {
    let news = track.total().saturating_sub(known) as usize;
    let points = track.iter().skip(track.iter().len().saturating_sub(news));
    points.map(|(at, x, y)| (at.as_micros(), x, y)).collect()
}

fn exemplar_changes(record: &VehicleRecord, memory: &VehicleMemory, events: &mut Vec<VehicleEvent>) {
    let none = Vec::new();
    let here = |label: u8, number: u8| {
        record.exemplars.label(label).is_some_and(|entry| entry.stored.iter().any(|p| p.number == number))
    };
    for (&label, images) in &memory.images.exemplars {
        let gone = images.iter().filter(|image| !here(label, image.number));
        events.extend(gone.map(|image| VehicleEvent::ExemplarGone { label, number: image.number }));
    }
    for (label, entry) in record.exemplars.labels() {
        let kept: &Vec<StoredImage> = memory.images.exemplars.get(&label).unwrap_or(&none);
        let is_kept = |number, size, received: Instant| {
            kept.iter().any(|k| (k.number, k.size, k.received) == (number, size, received.as_micros()))
        };
        let news = entry.stored.iter().filter(|p| !is_kept(p.number, p.size, p.received));
        events.extend(news.map(|p| VehicleEvent::Exemplar { label, image: stored::image(p) }));
    }
    let labels: BTreeSet<u8> =
        record.exemplars.labels().map(|(label, _)| label).chain(memory.images.requests.keys().copied()).collect();
    for label in labels {
        let (serial, open) = record.exemplars.label(label).map_or((0, None), |entry| entry.open_request());
        let open = open.map(|open| stored::request(&open));
        if memory.images.requests.get(&label).copied().unwrap_or_default() != (serial, open) {
            events.push(VehicleEvent::Request { label, serial, open });
        }
    }
}

fn floor_changes(record: &VehicleRecord, memory: &VehicleMemory, events: &mut Vec<VehicleEvent>) {
    let gone = memory.images.floor.keys().filter(|place| record.floor.get(**place).is_none());
    events.extend(gone.map(|place| VehicleEvent::FloorGone(*place)));
    let is_kept = |place, view: &StoredExemplar| {
        memory
            .images
            .floor
            .get(&place)
            .is_some_and(|kept| (kept.size, kept.received) == (view.size, view.received.as_micros()))
    };
    let news = record.floor.iter().filter(|(place, _, view)| !is_kept(*place, view));
    events.extend(news.map(|(_, _, view)| VehicleEvent::Floor(stored::image(view))));
}

fn order_changes(record: &VehicleRecord, view: &PeerView<'_>, memory: &VehicleMemory, events: &mut Vec<VehicleEvent>) {
    let orders: Vec<_> = view.slots().map(stored::order).collect();
    let series = view.series().get();
    if (memory.orders.series, &memory.orders.sent) != (series, &orders) {
        events.push(VehicleEvent::Orders { series, orders });
    }
    let intent = stored::intent(record);
    if memory.orders.intent != intent {
        events.push(VehicleEvent::Intent(intent));
    }
    let places = stored::places(record);
    if memory.orders.places != places {
        events.push(VehicleEvent::Places(places));
    }
    let in_force: Vec<Vec<u8>> = view.in_force_memory().map(stored::slot_bytes).collect();
    if memory.orders.in_force != in_force {
        events.push(VehicleEvent::InForce(in_force));
    }
    let labels: BTreeSet<u8> =
        record.annotations.labels.keys().chain(memory.annotations.labels.keys()).copied().collect();
    for label in labels {
        let book = record.annotations.labels.get(&label).cloned().unwrap_or_default();
        if memory.annotations.labels.get(&label).cloned().unwrap_or_default() != book {
            events.push(VehicleEvent::Label { label, book });
        }
    }
    let tree = record.labels.tree.as_ref().map(LabelTree::to_bytes).unwrap_or_default();
    if memory.tree != tree {
        events.push(VehicleEvent::Tree(tree));
    }
    let known = memory.annotations.notes.back();
    let first_new = record.annotations.notes.iter().rposition(|note| Some(note) == known).map_or(0, |at| at + 1);
    events.extend(record.annotations.notes.iter().skip(first_new).cloned().map(VehicleEvent::Note));
    if memory.annotations.draft != record.annotations.draft {
        events.push(VehicleEvent::Draft(record.annotations.draft.clone()));
    }
    let markers = &record.annotations.markers;
    let gone = memory.annotations.markers.keys().filter(|number| !markers.contains_key(number));
    events.extend(gone.copied().map(VehicleEvent::MarkerGone));
    let news = markers.values().filter(|marker| memory.annotations.markers.get(&marker.number) != Some(marker));
    events.extend(news.cloned().map(VehicleEvent::Marker));
}
