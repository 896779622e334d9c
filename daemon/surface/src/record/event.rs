//! The events of the surface's store, and their batches as bytes. Variants are only ever appended, because files keep their
//! numbers.

use crate::label_book::StoredLabel;
use crate::log::StoredLogEntry;
use scenecast_core::UsblLine;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::VehicleStatus;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::time::Duration;

/// When an event was recorded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct EventTime {
    /// Mission time, microseconds; it continues across restarts.
    pub mission_us: u64,
    /// Time of the machine's clock, milliseconds since 1970.
    pub unix_ms: u64,
}

/// Who or what caused an event.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub enum EventSource {
    /// The surface's program by itself.
    Surface,
    /// A vehicle, by its address.
    Vehicle(u8),
    /// A person or a program that may give orders, by name.
    Principal(String),
}

/// A change of the surface's knowledge.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Event {
    /// One more than that of the event before it, across restarts and files.
    pub sequence: u64,
    pub time: EventTime,
    pub source: EventSource,
    pub kind: EventKind,
}

/// The kind of an event with its payload.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum EventKind {
    /// The store was begun: a random name, the number of the mission, and the series of the orders' versions.
    Began { id: u32, mission: u32, series: u64 },
    /// The operator changed the budget of the surface. The order is void once another one is configured.
    Budget { ordered: StoredBudget, configured: StoredBudget },
    /// A fact about the vehicle with this address.
    Vehicle(u8, VehicleEvent),
    /// An entry of the mission's log.
    Logged(StoredLogEntry),
    /// The holder of command and the requests for it.
    Command(StoredCommand),
    /// A change of command, for its history.
    CommandChanged(StoredCommandChange),
}

/// Who has command and who requests it, by name. Times are mission times in microseconds.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct StoredCommand {
    /// The holder, his client, the time since when, and that of the last sign of presence.
    pub holder: Option<(String, Option<String>, u64, u64)>,
    /// Requests with their times, the oldest first.
    pub requests: Vec<(String, u64)>,
}

/// A change of command, as the store keeps it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct StoredCommandChange {
    pub at: u64,
    /// 0 taken, 1 handed over, 2 released, 3 requested, 4 withdrawn, 5 moved to another client.
    pub kind: u8,
    pub by: String,
    pub from: Option<String>,
    pub to: Option<String>,
}

/// A change of the knowledge about one vehicle. Times are mission times in microseconds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum VehicleEvent {
    /// The name that the vehicle has from now on.
    Named(String),
    /// The run and the label epoch that the following events belong to.
    Identified(RunId),
    /// The copy of the map was emptied: the cells so far are those of an earlier map.
    Replaced,
    /// The earlier map is no longer in view.
    Overtaken,
    /// Cells of the labels, or of a layer.
    Cells(StoredCells),
    /// A number that grows with each change of the map, across restarts.
    MapVersion(u64),
    /// The last report, and when frames came in.
    Contact(StoredContact),
    /// The number of positions so far, and the newest ones: time, metres east and north.
    Track { total: u64, points: Vec<(u64, f64, f64)> },
    /// The series of the versions, and the latest version of each slot, with its status.
    Orders { series: u64, orders: Vec<StoredOrder> },
    /// The orders as they are shown: sent, and in force.
    Intent(StoredIntent),
    /// An image of a label arrived.
    Exemplar { label: u8, image: StoredImage },
    /// An image of a label was dropped: label, number of the image.
    ExemplarGone { label: u8, number: u8 },
    /// The request for an image of a label, or its end, and the label's serial number of requests.
    Request { label: u8, serial: u8, open: Option<StoredRequest> },
    /// The operator's name, colour and merging of a label.
    Label { label: u8, book: StoredLabel },
    /// A note of a person.
    Note(StoredNote),
    /// The end of a run whose map is archived.
    Archived { ended_us: u64, cells: u64 },
    /// A marker that was set.
    Marker(StoredMarker),
    /// The number of a marker that was removed.
    MarkerGone(u32),
    /// Areas and destination as they are shown.
    Places(StoredPlaces),
    /// Labels that cells had before their present ones; the times are those of their replacement.
    Former(StoredCells),
    /// The weights that are set and not sent.
    Draft(StoredDraft),
    /// The contents that are or may be in force, slots as on the wire: of each slot the last known one first.
    InForce(Vec<Vec<u8>>),
    /// The last report on the registration of frames as on the wire, with its time; the number of positions at which
    /// frames closed a loop, and the newest ones: time, metres east and north.
    Registration { report: Option<(u64, Vec<u8>)>, total: u64, closures: Vec<(u64, f64, f64)> },
    /// The faults of the equipment in the last status, as on the wire.
    Faults(u8),
    /// The last tree of the labels, as on the wire.
    Tree(Vec<u8>),
    /// A view of the sea floor arrived, which replaces one with the same middle.
    Floor(StoredImage),
    /// The view of the sea floor with this middle was dropped.
    FloorGone((i32, i32)),
}

/// A run of a vehicle and the epoch of its labels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct RunId {
    /// Counts the runs of the vehicle that this surface has met, from 1.
    pub run: u32,
    /// Labels have the same meaning within an epoch.
    pub epoch: u8,
    /// When the surface met it, milliseconds since 1970.
    pub began_unix_ms: u64,
}

/// A budget of the surface, as ordered or as configured.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct StoredBudget {
    /// The budget in bits a second.
    pub bits_per_s: u32,
    /// Least share of each class, percent.
    pub shares: [u8; 5],
    /// The order of the background streams, as on the wire.
    pub background: Vec<u8>,
}

/// Cells with their values and the time at which each was received.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct StoredCells {
    /// The layer's index and descriptor; `None` for the labels.
    pub layer: Option<(u8, Vec<u8>)>,
    /// Columns, rows and times as differences to the cell before.
    pub cells: Vec<(i64, i64, u8, i64)>,
}

/// An order and how far it has come.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct StoredOrder {
    pub version: u64,
    /// The slot as on the wire.
    pub slot: Vec<u8>,
    /// 0 queued, 1 on air, 2 received, 3 applied, 16 + reason: refused.
    pub status: u8,
    pub issued: u64,
    pub changed: u64,
}

/// Weighted areas and the destination as they are shown; payloads are slots as on the wire.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct StoredPlaces {
    pub areas: Option<Vec<u8>>,
    pub areas_in_force: Option<(u16, Vec<u8>)>,
    pub destination: Option<Vec<u8>>,
    pub destination_in_force: Option<(u16, Vec<u8>)>,
}

/// Orders as they are shown; payloads are slots as on the wire.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct StoredIntent {
    pub utility: Vec<u8>,
    /// The highest label when it was sent.
    pub weighed: u8,
    pub fence: Option<Vec<u8>>,
    pub limits: Option<Vec<u8>>,
    pub fence_in_force: Option<(u16, Vec<u8>)>,
    pub limits_in_force: Option<(u16, Vec<u8>)>,
    pub settings_requested: Vec<u8>,
    pub settings_in_force: Vec<u8>,
    pub settings_unsure: bool,
}

/// An image of a label, or a view of the sea floor, whose number is the part of it that was seen, in 63rds.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct StoredImage {
    pub number: u8,
    pub size: u8,
    pub webp: Vec<u8>,
    pub sent_bytes: u32,
    pub received: u64,
    pub requested: bool,
    pub width_mm: u16,
    /// Decimetres east and north in the vehicle's map frame.
    pub middle_dm: (i32, i32),
    /// When it was taken, if that is known.
    pub taken: Option<u64>,
}

/// An open request for an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct StoredRequest {
    pub serial: u8,
    pub size: u8,
    pub picture: u8,
    /// 0 ordered, 1 not available yet, 2 arriving, 3 refused.
    pub state: u8,
    /// Bytes held and bytes in all, while it arrives.
    pub held: (u32, u32),
    pub changed: u64,
}

/// Weights that an operator has set and not sent.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct StoredDraft {
    /// Grows with each change; 0 before the first.
    pub number: u32,
    /// -1 to 1 by label.
    pub weights: BTreeMap<u8, f64>,
    pub exploration: Option<f64>,
    pub curiosity: Option<f64>,
    pub at: u64,
    pub author: String,
}

/// A marker on a vehicle's map.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StoredMarker {
    pub number: u32,
    /// Metres east and north in the world frame.
    pub x_m: f64,
    pub y_m: f64,
    pub at: u64,
    pub author: String,
    pub text: String,
}

/// A note about a vehicle.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct StoredNote {
    pub at: u64,
    pub author: String,
    pub text: String,
}

/// The version of the layout of events, the only one that is read.
const SCHEMA: u16 = 7;

/// The reason that bytes are no batch of events.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum DecodeError {
    #[error("written by another version of scenecast (layout {0}); use that one, or move the file away")]
    OtherLayout(u16),
    #[error("the events are unreadable; restore the file, or move it away")]
    Damaged,
}

/// A batch of events: the version of the layout, big-endian, then the events in postcard.
pub fn encode(events: &[Event]) -> Vec<u8> {
    let mut bytes = SCHEMA.to_be_bytes().to_vec();
    // Vectors of bytes and numbers always have a form in postcard.
    bytes.extend(postcard::to_allocvec(events).unwrap_or_default());
    bytes
}

/// Reads a batch of events of this version.
pub fn decode(bytes: &[u8]) -> Result<Vec<Event>, DecodeError> {
    let (version, rest) = bytes.split_first_chunk::<2>().ok_or(DecodeError::Damaged)?;
    match u16::from_be_bytes(*version) {
        SCHEMA => match postcard::take_from_bytes(rest) {
            Ok((events, [])) => Ok(events),
            _ => Err(DecodeError::Damaged),
        },
        0 => Err(DecodeError::Damaged),
        other => Err(DecodeError::OtherLayout(other)),
    }
}

/// The last contact with a vehicle.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct StoredContact {
    pub last_received: Option<u64>,
    /// The longest usual pause between two frames, microseconds.
    pub pause: Option<u64>,
    /// When the last pose came in; pose and report as on the wire.
    pub status: Option<(u64, Vec<u8>, Vec<u8>)>,
    pub usbl: Option<StoredRange>,
}

/// A measurement of the surface's modem.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StoredRange {
    pub at: u64,
    pub remote: u16,
    pub range_m: Option<f64>,
    pub direction_rad: Option<(f64, f64)>,
    pub accuracy: f64,
    pub age_s: f64,
}

impl StoredContact {
    /// The status and when its pose came in.
    pub(crate) fn status(&self) -> Option<(VehicleStatus, Instant)> {
        let (at, pose, report) = self.status.as_ref()?;
        let mut status = VehicleStatus::default();
        status.read_pose(pose).ok()?;
        status.read_report(report).ok()?;
        Some((status, Instant::from_micros(*at)))
    }

    /// The last measurement of the surface's modem, and its time.
    pub(crate) fn range(&self) -> Option<(UsblLine, Instant)> {
        let StoredRange { at, remote, range_m, direction_rad, accuracy, age_s } = *self.usbl.as_ref()?;
        let line = UsblLine { remote: remote.try_into().ok()?, range_m, direction_rad, accuracy, age_s };
        Some((line, Instant::from_micros(at)))
    }

    /// The longest usual pause between two frames.
    pub(crate) fn pause(&self) -> Option<Duration> {
        self.pause.map(Duration::from_micros)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn events() -> Vec<Event> {
        let time = EventTime { mission_us: 1000, unix_ms: 2000 };
        let by = EventSource::Principal("ann".to_owned());
        let cells = StoredCells { layer: None, cells: vec![(3, -4, 7, 1000), (1, 0, 7, 0)] };
        let id = RunId { run: 2, epoch: 1, began_unix_ms: 300 };
        let vehicle = |event| EventKind::Vehicle(1, event);
        let kinds = [
            (EventSource::Surface, EventKind::Began { id: 300, mission: 5, series: 7 }),
            (EventSource::Vehicle(1), vehicle(VehicleEvent::Identified(id))),
            (EventSource::Vehicle(1), vehicle(VehicleEvent::Cells(cells))),
            (by, vehicle(VehicleEvent::Overtaken)),
        ];
        let numbered = kinds.into_iter().zip(1..);
        numbered.map(|((source, kind), sequence)| Event { sequence, time, source, kind }).collect()
    }

    #[test]
    fn golden_bytes_of_a_run_and_its_map() {
        let golden = [
            &[0, 7, 4][..],
            &[1, 0xE8, 0x07, 0xD0, 0x0F, 0, 0, 0xAC, 2, 5, 7],
            &[2, 0xE8, 0x07, 0xD0, 0x0F, 1, 1, 2, 1, 1, 2, 1, 0xAC, 2],
            &[3, 0xE8, 0x07, 0xD0, 0x0F, 1, 1, 2, 1, 4, 0, 2, 6, 7, 7, 0xD0, 0x0F, 2, 0, 7, 0],
            &[4, 0xE8, 0x07, 0xD0, 0x0F, 2, 3, b'a', b'n', b'n', 2, 1, 3],
        ];
        assert_eq!(decode(&golden.concat()), Ok(events()));
        assert_eq!(encode(&events()), golden.concat());
    }

    #[test]
    fn golden_bytes_of_a_marker() {
        let (at, author, text) = (1000, "ann".to_owned(), "wreck".to_owned());
        let marker = VehicleEvent::Marker(StoredMarker { number: 300, x_m: 1.5, y_m: -2.0, at, author, text });
        let time = EventTime { mission_us: 1000, unix_ms: 2000 };
        let event = |event, sequence| Event {
            sequence,
            time,
            source: EventSource::Surface,
            kind: EventKind::Vehicle(1, event),
        };
        let events = [event(marker, 1), event(VehicleEvent::MarkerGone(300), 2)];
        let golden = [
            &[0, 7, 2][..],
            &[1, 0xE8, 0x07, 0xD0, 0x0F, 0, 2, 1, 16, 0xAC, 2],
            &1.5f64.to_le_bytes(),
            &(-2.0f64).to_le_bytes(),
            &[0xE8, 0x07, 3, b'a', b'n', b'n', 5, b'w', b'r', b'e', b'c', b'k'],
            &[2, 0xE8, 0x07, 0xD0, 0x0F, 0, 2, 1, 17, 0xAC, 2],
        ];
        assert_eq!(encode(&events), golden.concat());
        assert_eq!(decode(&golden.concat()).as_deref(), Ok(&events[..]));
    }

    #[test]
    fn golden_bytes_of_places() {
        let places = StoredPlaces { areas_in_force: Some((300, vec![7, 8])), ..StoredPlaces::default() };
        let kind = EventKind::Vehicle(1, VehicleEvent::Places(places));
        let time = EventTime { mission_us: 1000, unix_ms: 2000 };
        let events = [Event { sequence: 1, time, source: EventSource::Surface, kind }];
        let golden = [0, 7, 1, 1, 0xE8, 0x07, 0xD0, 0x0F, 0, 2, 1, 18, 0, 1, 0xAC, 2, 2, 7, 8, 0, 0];
        assert_eq!(encode(&events), golden);
        assert_eq!(decode(&golden).as_deref(), Ok(&events[..]));
    }

    #[test]
    fn golden_bytes_of_former_labels_and_of_a_draft() {
        let former = StoredCells { layer: None, cells: vec![(3, -4, 7, 1000)] };
        let (weights, author) = ([(3, 0.5)].into(), "ann".to_owned());
        let draft = StoredDraft { number: 300, weights, exploration: Some(-1.0), curiosity: None, at: 5, author };
        let time = EventTime { mission_us: 1000, unix_ms: 2000 };
        let event = |sequence, event| Event {
            sequence,
            time,
            source: EventSource::Surface,
            kind: EventKind::Vehicle(1, event),
        };
        let events = [event(1, VehicleEvent::Former(former)), event(2, VehicleEvent::Draft(draft))];
        let golden = [
            &[0, 7, 2][..],
            &[1, 0xE8, 0x07, 0xD0, 0x0F, 0, 2, 1, 19, 0, 1, 6, 7, 7, 0xD0, 0x0F],
            &[2, 0xE8, 0x07, 0xD0, 0x0F, 0, 2, 1, 20, 0xAC, 2, 1, 3],
            &0.5f64.to_le_bytes(),
            &[1],
            &(-1.0f64).to_le_bytes(),
            &[0, 5, 3, b'a', b'n', b'n'],
        ];
        assert_eq!(encode(&events), golden.concat());
        assert_eq!(decode(&golden.concat()).as_deref(), Ok(&events[..]));
    }

    #[test]
    fn golden_bytes_of_the_contents_in_force() {
        let kind = EventKind::Vehicle(1, VehicleEvent::InForce(vec![vec![7, 8], vec![9]]));
        let time = EventTime { mission_us: 1000, unix_ms: 2000 };
        let events = [Event { sequence: 1, time, source: EventSource::Surface, kind }];
        let golden = [0, 7, 1, 1, 0xE8, 0x07, 0xD0, 0x0F, 0, 2, 1, 21, 2, 2, 7, 8, 1, 9];
        assert_eq!(encode(&events), golden);
        assert_eq!(decode(&golden).as_deref(), Ok(&events[..]));
    }

    #[test]
    fn golden_bytes_of_a_registration() {
        let (report, closures) = (Some((5, vec![0x95, 5, 1, 2])), vec![(1000, 1.5, -2.0)]);
        let kind = EventKind::Vehicle(1, VehicleEvent::Registration { report, total: 300, closures });
        let time = EventTime { mission_us: 1000, unix_ms: 2000 };
        let events = [Event { sequence: 1, time, source: EventSource::Surface, kind }];
        let golden = [
            &[0, 7, 1, 1, 0xE8, 0x07, 0xD0, 0x0F, 0, 2, 1, 22, 1, 5, 4, 0x95, 5, 1, 2, 0xAC, 2, 1, 0xE8, 0x07][..],
            &1.5f64.to_le_bytes(),
            &(-2.0f64).to_le_bytes(),
        ];
        assert_eq!(encode(&events), golden.concat());
        assert_eq!(decode(&golden.concat()).as_deref(), Ok(&events[..]));
    }

    #[test]
    fn golden_bytes_of_faults() {
        let kind = EventKind::Vehicle(1, VehicleEvent::Faults(0x88));
        let time = EventTime { mission_us: 1000, unix_ms: 2000 };
        let events = [Event { sequence: 1, time, source: EventSource::Surface, kind }];
        let golden = [0, 7, 1, 1, 0xE8, 0x07, 0xD0, 0x0F, 0, 2, 1, 23, 0x88];
        assert_eq!(encode(&events), golden);
        assert_eq!(decode(&golden).as_deref(), Ok(&events[..]));
    }

    #[test]
    fn golden_bytes_of_an_entry_of_the_log() {
        let entry = StoredLogEntry { number: 300, at: 5, vehicle: Some(1), kind: 7, by: None, text: "ab".to_owned() };
        let time = EventTime { mission_us: 1000, unix_ms: 2000 };
        let events = [Event { sequence: 1, time, source: EventSource::Surface, kind: EventKind::Logged(entry) }];
        let golden = [0, 7, 1, 1, 0xE8, 0x07, 0xD0, 0x0F, 0, 3, 0xAC, 2, 5, 1, 1, 7, 0, 2, b'a', b'b'];
        assert_eq!(encode(&events), golden);
        assert_eq!(decode(&golden).as_deref(), Ok(&events[..]));
    }

    #[test]
    fn golden_bytes_of_command() {
        let holder = Some(("ann".to_owned(), Some("pc".to_owned()), 5, 300));
        let command = StoredCommand { holder, requests: vec![("bo".to_owned(), 6)] };
        let to = Some("ann".to_owned());
        let change = StoredCommandChange { at: 5, kind: 1, by: "bo".to_owned(), from: None, to };
        let time = EventTime { mission_us: 1000, unix_ms: 2000 };
        let event = |sequence, kind| Event { sequence, time, source: EventSource::Surface, kind };
        let events = [event(1, EventKind::Command(command)), event(2, EventKind::CommandChanged(change))];
        let head = [0xE8, 0x07, 0xD0, 0x0F, 0];
        let golden = [
            &[0, 7, 2][..],
            &[1],
            &head,
            &[4, 1, 3, b'a', b'n', b'n', 1, 2, b'p', b'c', 5, 0xAC, 2, 1, 2, b'b', b'o', 6],
            &[2],
            &head,
            &[5, 5, 1, 2, b'b', b'o', 0, 1, 3, b'a', b'n', b'n'],
        ];
        assert_eq!(encode(&events), golden.concat());
        assert_eq!(decode(&golden.concat()).as_deref(), Ok(&events[..]));
    }

    #[test]
    fn another_layout_is_refused_by_its_number() {
        for layout in [1, 6, 8] {
            assert_eq!(decode(&[0, layout, 0]), Err(DecodeError::OtherLayout(layout.into())));
        }
        assert_eq!(decode(&[0, 0, 0]), Err(DecodeError::Damaged));
        assert_eq!(decode(&[0]), Err(DecodeError::Damaged));
    }

    proptest! {
        #[test]
        fn any_bytes_decode_or_are_refused(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
            let _ = decode(&[&[0, 7], &bytes[..]].concat());
        }
    }
}
