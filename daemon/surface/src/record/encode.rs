//! Batches of events as bytes, with the version of their layout.

use super::event::Event;

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

#[cfg(test)]
mod tests {
    use super::super::event::{
        EventKind, EventSource, EventTime, RunId, StoredCells, StoredCommand, StoredCommandChange, StoredDraft,
        StoredLogEntry, StoredMarker, StoredPlaces, VehicleEvent,
    };
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
