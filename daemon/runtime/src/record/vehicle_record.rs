//! What the vehicle knew.

use super::{
    MapState, Named, Record, RecordedMap, entry_of, frame_entry, is_due, log_entries, settings_entry, settings_text,
    unix_nanos,
};
use scenecast_config::{Config, cell_m};
use scenecast_files::RecordEntry;
use scenecast_host::VehicleHostEvent;
use scenecast_messages::contents::{MAP_FRAME, Place, Stamps, header, pose};
use scenecast_messages::scenecast_msgs::{Event, Link, OrderStatus};
use scenecast_protocol::directive::{SlotId, SlotState};
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::{ModeReason, VehicleMode};
use scenecast_vehicle::{AppliedSlot, LostOrders, Vehicle};
use std::path::Path;

/// Mission time between two messages about the link, seconds.
const LINK_INTERVAL_S: f64 = 10.0;
/// Mission time between two accounts of the images, seconds.
pub const IMAGES_INTERVAL_S: f64 = 60.0;
/// Mission time between two poses, seconds.
const POSE_INTERVAL_S: f64 = 1.0;

/// The record of a vehicle's process; without one, nothing is done.
pub struct VehicleRecord {
    record: Option<Record>,
    recorder: VehicleRecorder,
    stamps: Stamps,
    /// Whether the log of the process is that of the vehicle; in a rehearsal it is that of the surface.
    has_log: bool,
}

impl VehicleRecord {
    /// Begins it in a folder in `folder`, unless the configuration names another one.
    pub fn start(config: &Config, folder: &Path, speed: f64) -> Self {
        let hides_keys = config.link.key_file.is_some();
        let recorder = VehicleRecorder { hides_keys, ..VehicleRecorder::new(config, None) };
        let record = Record::start(config, &config.vehicle.name, folder);
        Self { record, recorder, stamps: Stamps::with_speed(speed), has_log: true }
    }

    /// Begins that of a rehearsal with this seed.
    pub fn rehearsed(config: &Config, folder: &Path, speed: f64, seed: u64) -> Self {
        let record = Record::start(config, &config.vehicle.name, folder);
        let recorder = VehicleRecorder::new(config, Some(seed));
        Self { record, recorder, stamps: Stamps::with_speed(speed), has_log: false }
    }

    /// The folder of the record, if there is one.
    pub fn folder(&self) -> Option<&Path> {
        self.record.as_ref().map(|record| record.dir.as_path())
    }

    /// Records what has changed since the last call; the whole state after a new file was begun or messages were left out.
    pub fn observe(&mut self, vehicle: &Vehicle, now: Instant) {
        let Some(record) = &mut self.record else { return };
        self.stamps.observe(now.as_secs_f64(), unix_nanos());
        if self.has_log {
            record.put(log_entries(&self.stamps), &self.stamps);
        }
        record.put(self.recorder.observe(record.state_number(), vehicle, &self.stamps), &self.stamps);
    }

    fn put_images(&mut self, account: Option<impl ToString>, interval_s: f64) {
        let (Some(record), Some(account)) = (&mut self.record, account) else { return };
        record.put(self.recorder.images(account, interval_s, &self.stamps), &self.stamps);
    }

    /// Records an event of the host.
    pub fn handle_event(&mut self, event: &VehicleHostEvent, now: Instant) {
        let Some(record) = &mut self.record else { return };
        self.stamps.observe(now.as_secs_f64(), unix_nanos());
        record.put(self.recorder.handle_event(event, &self.stamps), &self.stamps);
    }

    /// Records now and then what has become of the images; without an account, nobody counts them.
    pub fn observe_images(&mut self, account: Option<impl ToString>) {
        self.put_images(account, IMAGES_INTERVAL_S);
    }

    /// Ends the record with what has become of the images, and prints where it is.
    pub fn finish(mut self, account: Option<impl ToString>) {
        self.put_images(account, 0.0);
        self.record.into_iter().for_each(Record::finish);
    }
}

/// Makes the messages of a vehicle's record from its state and from the events of its host.
pub struct VehicleRecorder {
    named: Named,
    cell_m: f64,
    part: u32,
    map: RecordedMap,
    mode: String,
    /// Whether hold, resume or abort was ordered in this run.
    was_stopped: bool,
    pose_s: Option<f64>,
    link_s: Option<f64>,
    /// The last account of the images, and when it was made.
    images: (String, Option<f64>),
    /// Frames to the vehicle may carry a next key.
    hides_keys: bool,
    /// What the vehicle runs with.
    settings: String,
}

impl VehicleRecorder {
    /// Records a vehicle of this configuration, or that of a rehearsal with a seed.
    pub fn new(config: &Config, rehearsal_seed: Option<u64>) -> Self {
        let named = Named { name: config.vehicle.name.clone(), ..Named::default() };
        let (map, mode) = (RecordedMap::default(), String::new());
        let (cell_m, settings) = (cell_m(config), settings_text(config, rehearsal_seed));
        Self {
            named,
            cell_m,
            part: 0,
            map,
            mode,
            was_stopped: false,
            pose_s: None,
            link_s: None,
            images: Default::default(),
            hides_keys: false,
            settings,
        }
    }

    /// What has changed since the last call, or the whole state where `part` is another one than then.
    pub fn observe(&mut self, part: u32, vehicle: &Vehicle, stamps: &Stamps) -> Vec<RecordEntry> {
        let mut entries = Vec::new();
        if std::mem::replace(&mut self.part, part) != part {
            (self.map, self.mode) = (RecordedMap::default(), String::new());
            entries.push(settings_entry(&self.settings, stamps));
        }
        for layer in vehicle.layers() {
            if self.named.layers.get(layer.id()) != Some(layer.descriptor()) {
                self.named.layers.insert(layer.id(), layer.descriptor().clone());
            }
        }
        let labels = vehicle.map();
        let (epoch, version) = (vehicle.durable().epoch, vehicle.map_version());
        let (cell_m, source) = (self.cell_m, Some(vehicle));
        let state = MapState { vehicle: &self.named.name, layer: "", epoch, version, cell_m, labels, source };
        entries.extend(self.map.record(&state, stamps));
        let now_s = stamps.now_s();
        let navigator = vehicle.navigator();
        if navigator.is_measured() && is_due(&mut self.pose_s, POSE_INTERVAL_S, now_s) {
            let at = navigator.position();
            let place = Place {
                stamp: stamps.now(),
                position_m: [at.x_m, at.y_m, -navigator.depth_m()],
                heading_rad: navigator.heading_rad(),
            };
            entries.push(self.entry("pose", stamps, &pose(&place, navigator.sigma_m(), MAP_FRAME)));
        }
        if is_due(&mut self.link_s, LINK_INTERVAL_S, now_s) {
            entries.push(self.entry("link", stamps, &self.link(vehicle, stamps)));
        }
        let (mode, reason) = vehicle.mode();
        let waits = vehicle.durable().lost != LostOrders::None && !self.was_stopped;
        let reason = match (mode, reason) {
            (VehicleMode::Hold, ModeReason::Order) if waits => Some("it has no record of orders and waits for one"),
            (_, reason) => reason.name(),
        };
        let mode = mode.name();
        let mode = reason.map_or_else(|| mode.to_owned(), |reason| format!("{mode}: {reason}"));
        if self.mode != mode {
            entries.push(self.event(Event::INFO, "mode", &mode, stamps));
            self.mode = mode;
        }
        entries
    }

    /// What has become of the images, if that has changed and the last account is `interval_s` old.
    pub fn images(&mut self, account: impl ToString, interval_s: f64, stamps: &Stamps) -> Option<RecordEntry> {
        let (told, told_s) = &mut self.images;
        if !is_due(told_s, interval_s, stamps.now_s()) {
            return None;
        }
        let account = account.to_string();
        if *told == account {
            return None;
        }
        told.clone_from(&account);
        Some(self.event(Event::INFO, "images", &account, stamps))
    }

    /// What is to be recorded of an event of the host.
    pub fn handle_event(&mut self, event: &VehicleHostEvent, stamps: &Stamps) -> Option<RecordEntry> {
        match event {
            VehicleHostEvent::Frame(event) => frame_entry(event, |_| Some(&self.named), self.hides_keys, stamps),
            VehicleHostEvent::Applied(applied) => {
                self.was_stopped |= applied.id == SlotId::Constraints && applied.state == SlotState::Applied;
                Some(self.decision(applied, stamps))
            }
            VehicleHostEvent::Note(text) => Some(self.event(Event::WARN, "navigation", text, stamps)),
            VehicleHostEvent::Fixed(fix, _) => {
                let at = fix.position;
                let text = format!("{:.1} m east, {:.1} m north, {:.1} m", at.east_m, at.north_m, fix.sigma_m);
                Some(self.event(Event::INFO, "fix", &text, stamps))
            }
            _ => None,
        }
    }

    /// A decision of the vehicle about an order.
    fn decision(&self, applied: &AppliedSlot, stamps: &Stamps) -> RecordEntry {
        let (status, reason) = match applied.state {
            SlotState::Refused(reason) => (OrderStatus::REFUSED, format!("{reason:?}")),
            _ => (OrderStatus::APPLIED, String::new()),
        };
        let message = OrderStatus {
            header: header(stamps.at(applied.at.as_secs_f64()), ""),
            vehicle: self.named.name.clone(),
            slot: applied.id.name().to_owned(),
            version: applied.version.into(),
            status,
            reason,
            ..OrderStatus::default()
        };
        self.entry("order_status", stamps, &message)
    }

    fn event(&self, level: u8, source: &str, text: &str, stamps: &Stamps) -> RecordEntry {
        let (header, vehicle) = (header(stamps.now(), ""), self.named.name.clone());
        let message = Event { header, vehicle, level, source: source.to_owned(), text: text.to_owned() };
        self.entry("events", stamps, &message)
    }

    fn link(&self, vehicle: &Vehicle, stamps: &Stamps) -> Link {
        let stats = vehicle.stats();
        Link {
            header: header(stamps.now(), ""),
            vehicle: self.named.name.clone(),
            budget_bps: vehicle.budget_bps(),
            sent_bps: f32::NAN,
            received_bps: f32::NAN,
            loss: stats.outgoing.loss.expected() as f32,
            round_trip_s: f32::NAN,
            age_s: f32::NAN,
            backlog_bits: 0,
        }
    }

    fn entry<M: scenecast_messages::Message>(&self, topic: &str, stamps: &Stamps, message: &M) -> RecordEntry {
        entry_of(&self.named.name, topic, stamps, message)
    }
}
