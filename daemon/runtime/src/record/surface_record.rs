//! What the operator knew.

use super::{
    MapState, Named, Record, RecordedMap, entry, entry_of, frame_entry, is_due, log_entries, settings_entry,
    settings_text,
};
use bytes::Bytes;
use scenecast_config::Config;
use scenecast_console::layer_text;
use scenecast_files::RecordEntry;
use scenecast_host::FrameEvent;
use scenecast_messages::Message;
use scenecast_messages::contents::{MAP_FRAME, Stamps, WORLD_FRAME, header, pose};
use scenecast_messages::geometry_msgs::Point;
use scenecast_messages::scenecast_msgs::{Event, Exemplar};
use scenecast_messages::std_msgs::{Header, Text};
use scenecast_protocol::map::{LayerDescriptor, StateReplica};
use scenecast_protocol::wire::Address;
use scenecast_surface::messages::{label_tree, link, order, order_status, place, place_on_earth};
use scenecast_surface::state::{MapLabelTree, MissionState, OrderStatus, VehicleState};
use scenecast_surface::{LogKind, Snapshot, StoredExemplar, Surface};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Mission time between two messages about the link, and at most between two states that the page would show, seconds.
const STATE_INTERVAL_S: f64 = 10.0;
/// The time of an order in the state is rounded to a hundredth of a second.
const ROUNDING_S: f64 = 0.01;

/// The record of a surface's process; without one, nothing is done.
pub struct SurfaceRecord {
    record: Option<Record>,
    recorder: SurfaceRecorder,
}

impl SurfaceRecord {
    /// Begins it in a folder in `folder`, unless the configuration names another one.
    /// `offers_key` is whether it offers the vehicles a next key, `log` the last entry of the surface's log, which an earlier
    /// process has recorded.
    pub fn start(config: &Config, name: &str, folder: &Path, offers_key: bool, log: u64) -> Self {
        let recorder = SurfaceRecorder { hides_keys: offers_key, log, ..SurfaceRecorder::new(config, None) };
        Self { record: Record::start(config, name, folder), recorder }
    }

    /// Begins that of a rehearsal with this seed.
    pub fn rehearsed(config: &Config, folder: &Path, seed: u64) -> Self {
        Self { record: Record::start(config, "surface", folder), recorder: SurfaceRecorder::new(config, Some(seed)) }
    }

    /// Whether there is a record.
    pub fn is_on(&self) -> bool {
        self.record.is_some()
    }

    /// The folder of the record, if there is one.
    pub fn folder(&self) -> Option<&Path> {
        self.record.as_ref().map(|record| record.dir.as_path())
    }

    /// Records what has changed since the last call; the whole state after a new file was begun or messages were left out.
    pub fn observe(&mut self, surface: &Surface, snapshot: &Snapshot) {
        let Some(record) = &mut self.record else { return };
        let stamps = &snapshot.stamps;
        record.put(log_entries(stamps), stamps);
        record.put(self.recorder.observe(record.state_number(), surface, snapshot, stamps), stamps);
    }

    /// Records a frame that was sent, received or dropped; other events are passed over.
    pub fn handle_frame(&mut self, event: &FrameEvent, stamps: &Stamps) {
        let Some(record) = &mut self.record else { return };
        record.put(self.recorder.frame(event, stamps), stamps);
    }

    /// Ends the record, and prints where it is.
    pub fn finish(mut self) {
        let Some(mut record) = self.record.take() else { return };
        record.put(self.recorder.last_state(), &Stamps::default());
        record.finish();
    }
}

/// Records the surface: of each vehicle what the operator knew of it, and the state that the page showed.
#[derive(Default)]
pub struct SurfaceRecorder {
    part: u32,
    vehicles: BTreeMap<u8, RecordedVehicle>,
    state_s: Option<f64>,
    link_s: Option<f64>,
    /// The last state, unless it was recorded.
    last_state: Option<(Bytes, Stamps)>,
    /// The last entry of the surface's log that was recorded.
    log: u64,
    /// The name and the layers of each vehicle, by its address.
    named: BTreeMap<u8, Named>,
    /// Frames to the vehicle may carry a next key.
    hides_keys: bool,
    /// What the surface runs with.
    settings: String,
}

/// What a record has of a vehicle.
#[derive(Default)]
struct RecordedVehicle {
    map: RecordedMap,
    /// What the record has of each layer, by the name of the layer.
    layers: BTreeMap<String, RecordedLayer>,
    tree: Option<(u8, MapLabelTree)>,
    /// Version and state by slot.
    orders: BTreeMap<String, (u16, OrderStatus)>,
    /// Mission time of the last report.
    report_s: Option<f64>,
    /// Epoch, label, number and size of the images, and whether somebody asked for it: a larger one takes the place of one of the same number.
    exemplars: BTreeSet<(u8, u8, u8, u8, bool)>,
    /// The number of the last view of the sea floor.
    floor: u64,
}

/// What a record has of a layer.
struct RecordedLayer {
    descriptor: LayerDescriptor,
    levels: RecordedMap,
}

impl SurfaceRecorder {
    /// Records a surface of this configuration, or that of a rehearsal with a seed.
    pub fn new(config: &Config, rehearsal_seed: Option<u64>) -> Self {
        Self { settings: settings_text(config, rehearsal_seed), ..Self::default() }
    }

    /// What has changed since the last call, or the whole state where `part` is another one than then.
    pub fn observe(&mut self, part: u32, surface: &Surface, snapshot: &Snapshot, stamps: &Stamps) -> Vec<RecordEntry> {
        let mut entries = Vec::new();
        if std::mem::replace(&mut self.part, part) != part {
            let (named, settings) = (std::mem::take(&mut self.named), std::mem::take(&mut self.settings));
            *self = Self { part, log: self.log, named, hides_keys: self.hides_keys, settings, ..Self::default() };
            entries.push(settings_entry(&self.settings, stamps));
        }
        entries.extend(self.events(surface, snapshot, stamps));
        let now_s = snapshot.state.now_s;
        let is_link_due = is_due(&mut self.link_s, STATE_INTERVAL_S, now_s);
        let mut has_news = is_due(&mut self.state_s, STATE_INTERVAL_S, now_s);
        for vehicle in &snapshot.state.vehicles {
            let named = self.named.entry(vehicle.id).or_default();
            named.name.clone_from(&vehicle.name);
            let view = Address::vehicle(vehicle.id).and_then(|address| surface.view(address));
            if let Some(layers) = view.map(|view| view.layers()).filter(|layers| **layers != named.layers) {
                named.layers.clone_from(layers);
            }
            let recorded = self.vehicles.entry(vehicle.id).or_default();
            let before = entries.len();
            let seen = Seen { surface, mission: &snapshot.state, vehicle, stamps };
            recorded.record_orders(seen, &mut entries);
            let reported_s = vehicle.status.as_ref().map(|status| status.at_s);
            has_news |= entries.len() > before || recorded.report_s != reported_s;
            recorded.record_map(seen, &mut entries);
            recorded.record_tree(seen, &mut entries);
            recorded.record_report(seen, &mut entries);
            recorded.record_exemplars(seen, &mut entries);
            recorded.record_floor(seen, &mut entries);
            if is_link_due {
                entries.push(seen.entry("link", &link(&snapshot.state, vehicle, stamps)));
            }
        }
        self.last_state = Some((snapshot.json.clone(), stamps.clone()));
        if has_news {
            self.state_s = Some(now_s);
            entries.extend(self.last_state());
        }
        entries
    }

    /// The last state, if it is not recorded.
    pub fn last_state(&mut self) -> Option<RecordEntry> {
        let (json, stamps) = self.last_state.take()?;
        let data = String::from_utf8_lossy(&json).into_owned();
        Some(entry("state".to_owned(), &stamps, &Text { data }))
    }

    /// A frame of the link.
    pub fn frame(&self, event: &FrameEvent, stamps: &Stamps) -> Option<RecordEntry> {
        frame_entry(event, |vehicle| self.named.get(&vehicle.number()), self.hides_keys, stamps)
    }

    /// The entries of the surface's log since the last call.
    fn events(&mut self, surface: &Surface, snapshot: &Snapshot, stamps: &Stamps) -> Vec<RecordEntry> {
        let after = std::mem::replace(&mut self.log, surface.log().last());
        let new = surface.log().entries().filter(|logged| logged.number > after);
        let event = |logged: &scenecast_surface::LogEntry| {
            let vehicle = logged.vehicle.and_then(|address| snapshot.vehicle(address.number()));
            let message = Event {
                header: header(stamps.at(logged.at.as_secs_f64()), ""),
                vehicle: vehicle.map(|vehicle| vehicle.name.clone()).unwrap_or_default(),
                level: Event::INFO,
                source: logged.kind.name().to_owned(),
                text: logged.line(),
            };
            entry("events".to_owned(), stamps, &message)
        };
        new.map(event).collect()
    }
}

/// What is known of a vehicle at one moment.
#[derive(Clone, Copy)]
struct Seen<'a> {
    surface: &'a Surface,
    mission: &'a MissionState,
    vehicle: &'a VehicleState,
    stamps: &'a Stamps,
}

impl Seen<'_> {
    /// An entry of a topic of the vehicle.
    fn entry<M: Message>(&self, topic: &str, message: &M) -> RecordEntry {
        entry_of(&self.vehicle.name, topic, self.stamps, message)
    }

    fn address(&self) -> Option<Address> {
        Address::vehicle(self.vehicle.id)
    }
}

impl RecordedVehicle {
    fn record_orders(&mut self, seen: Seen<'_>, entries: &mut Vec<RecordEntry>) {
        let Seen { surface, mission, vehicle, stamps } = seen;
        for slot in &vehicle.orders.directive.slots {
            let state = (slot.version, slot.state);
            let before = self.orders.insert(slot.slot.clone(), state);
            if before.is_none_or(|(version, _)| version != slot.version) {
                let principal = principal(surface, vehicle.id, slot.issued_s);
                let order = order(mission, vehicle, slot, principal, stamps);
                entries.extend(order.map(|order| seen.entry("orders", &order)));
            }
            if before != Some(state) {
                entries.push(seen.entry("order_status", &order_status(vehicle, slot, stamps)));
            }
        }
    }

    /// Labels and layers of the map in view.
    fn record_map(&mut self, seen: Seen<'_>, entries: &mut Vec<RecordEntry>) {
        let Seen { surface, vehicle, stamps, .. } = seen;
        let Some((address, labels)) = seen.address().and_then(|address| Some((address, surface.map(address)?))) else {
            return;
        };
        // A map of an earlier run that comes into view, or leaves it, is a new version.
        let shown = surface.record(address).map_or(0, |record| record.earlier.version_base);
        let version = shown + surface.view(address).map_or(0, |view| view.replica().version());
        let (name, epoch, cell_m) = (vehicle.name.as_str(), vehicle.map.epoch, vehicle.map.cell_m);
        let map = MapState { vehicle: name, layer: "", epoch, version, cell_m, labels, source: None };
        entries.extend(self.map.record(&map, stamps));
        for layer in surface.map_layers(address).into_iter().filter(|layer| layer.levels().shown().explored() > 0) {
            let descriptor = layer.descriptor();
            let name = descriptor.name.clone().into_owned();
            let recorded = self.layers.entry(name).or_insert_with(|| RecordedLayer::new(descriptor.clone()));
            let (version, labels) = (shown + layer.version(), layer.levels().shown());
            let map = MapState { layer: &descriptor.name, version, labels, ..map };
            entries.extend(recorded.record(descriptor, &map, stamps));
        }
    }

    fn record_tree(&mut self, seen: Seen<'_>, entries: &mut Vec<RecordEntry>) {
        let Seen { vehicle, stamps, .. } = seen;
        let is_recorded =
            |tree: &MapLabelTree| self.tree.as_ref().is_some_and(|(e, t)| (*e, t) == (vehicle.map.epoch, tree));
        if let Some(tree) = vehicle.label_tree.as_ref().filter(|tree| !is_recorded(tree)) {
            entries.push(seen.entry("label_tree", &label_tree(vehicle, tree, header(stamps.now(), WORLD_FRAME))));
            self.tree = Some((vehicle.map.epoch, tree.clone()));
        }
    }

    fn record_report(&mut self, seen: Seen<'_>, entries: &mut Vec<RecordEntry>) {
        let Seen { mission, vehicle, stamps, .. } = seen;
        let Some(status) = vehicle.status.as_ref().filter(|status| self.report_s != Some(status.at_s)) else { return };
        self.report_s = Some(status.at_s);
        let place = place(status, vehicle.map.shift_m(), stamps);
        let sigma_m = status.pose.sigma_m;
        entries.push(seen.entry("pose", &pose(&place, sigma_m, WORLD_FRAME)));
        entries.extend(place_on_earth(mission, &place, sigma_m).map(|fix| seen.entry("fix", &fix)));
    }

    /// Records the images that have come in, also of labels that have no cell.
    fn record_exemplars(&mut self, seen: Seen<'_>, entries: &mut Vec<RecordEntry>) {
        let Some(record) = seen.address().and_then(|address| seen.surface.record(address)) else { return };
        let images = record.exemplars.labels().flat_map(|(label, of_it)| of_it.stored.iter().map(move |i| (label, i)));
        for (label, image) in
            images.filter(|(label, i)| self.exemplars.insert((record.epoch, *label, i.number, i.size, i.requested)))
        {
            let name = record.label_name(label).unwrap_or_default();
            let message = Exemplar { epoch: record.epoch.into(), label, name: name.to_owned(), ..picture(seen, image) };
            entries.push(seen.entry("exemplars", &message));
        }
    }

    /// Records the views of the sea floor that have come in, as images of no label.
    fn record_floor(&mut self, seen: Seen<'_>, entries: &mut Vec<RecordEntry>) {
        let Some(record) = seen.address().and_then(|address| seen.surface.record(address)) else { return };
        let news = record.floor.iter().filter(|(_, number, _)| *number > self.floor);
        let mut news: Vec<_> = news.map(|(_, number, view)| (number, view)).collect();
        news.sort_by_key(|(number, _)| *number);
        entries
            .extend(news.into_iter().map(|(_, view)| seen.entry("floor", &of_floor(seen, record.floor.epoch(), view))));
        self.floor = record.floor.version().max(self.floor);
    }
}

/// A view of the sea floor, which moves with the map.
fn of_floor(seen: Seen<'_>, epoch: u8, view: &StoredExemplar) -> Exemplar {
    let ((x, y), whole) = (view.view.middle_m(), picture(seen, view));
    Exemplar {
        header: Header { frame_id: MAP_FRAME.to_owned(), ..whole.header.clone() },
        epoch: epoch.into(),
        middle: Point { x, y, z: f64::NAN },
        ..whole
    }
}

/// An image that has come in.
fn picture(Seen { vehicle, stamps, .. }: Seen<'_>, image: &StoredExemplar) -> Exemplar {
    let place = image.place_m(vehicle.map.shift_m());
    Exemplar {
        header: header(stamps.at(image.received.as_secs_f64()), ""),
        vehicle: vehicle.name.clone(),
        image: image.number,
        taken: image.taken.map(|taken| stamps.at(taken.as_secs_f64())).unwrap_or_default(),
        width_m: image.width_m().unwrap_or(f64::NAN),
        middle: place.map_or(Point { x: f64::NAN, y: f64::NAN, z: f64::NAN }, |(x, y)| Point { x, y, z: f64::NAN }),
        requested: image.requested,
        format: "webp".to_owned(),
        data: image.webp.clone(),
        ..Exemplar::default()
    }
}

/// Who has given an order to a vehicle at a mission time, by the log; empty if it does not say.
fn principal(surface: &Surface, vehicle: u8, issued_s: f64) -> String {
    let is_it = |logged: &&scenecast_surface::LogEntry| {
        logged.kind == LogKind::Order
            && logged.vehicle.is_none_or(|address| address.number() == vehicle)
            && (logged.at.as_secs_f64() - issued_s).abs() < ROUNDING_S
    };
    surface.log().entries().rev().find(is_it).and_then(|logged| logged.by.clone()).unwrap_or_default()
}

impl RecordedLayer {
    fn new(descriptor: LayerDescriptor) -> Self {
        Self { descriptor, levels: RecordedMap::default() }
    }

    /// The meaning of its levels, where it is new or another one, and the changes since the last call.
    fn record(&mut self, descriptor: &LayerDescriptor, map: &MapState<'_>, stamps: &Stamps) -> Vec<RecordEntry> {
        let mut entries = Vec::new();
        if self.levels.key.is_none() || self.descriptor != *descriptor {
            (self.descriptor, self.levels) = (descriptor.clone(), RecordedMap::default());
            let data = layer_text(descriptor);
            entries.push(entry_of(map.vehicle, "layers", stamps, &Text { data }));
        }
        entries.extend(self.levels.record(map, stamps));
        entries
    }
}
