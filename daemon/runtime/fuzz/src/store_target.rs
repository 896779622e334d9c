//! The properties of the surface's store for any bytes: plain functions, run by libFuzzer and by the ordinary tests alike.

use super::batch;
use super::files::{Damaged, Files, Script};
use super::log::{self, EventLog, Found, STORE};
use scenecast_config::Config;
use scenecast_core::tuning_table::TuningTable;
use scenecast_protocol::map::Replica;
use scenecast_protocol::time::Instant;
use scenecast_surface::record::{
    Event, EventKind, EventSource, EventTime, RunId, SurfaceMemory, VehicleEvent, VehicleMemory, decode, encode,
};
use scenecast_surface::recorder::Recorder;
use scenecast_surface::{Surface, assemble};

/// Version of the layout of events.
const LAYOUT: [u8; 2] = [0, 7];

thread_local! {
    static CONFIG: Config = scenecast_config::load(None, &["link.discovery_period_s=60".to_owned()]).expect("defaults");
}

/// The first byte chooses the property, the rest are its bytes.
pub fn store(data: &[u8]) {
    match data.split_first() {
        Some((what, rest)) if what % 2 == 0 => content(rest),
        Some((_, rest)) => damage(rest),
        None => {}
    }
}

/// Any events that decode are folded into a state that survives every way to the disk and back.
fn content(bytes: &[u8]) {
    if let Ok(events) = decode(&[&LAYOUT[..], bytes].concat()) {
        check_state(&events);
    }
}

/// Damage never leads to other events than a beginning of those that were written, and a new file replaces any other.
fn damage(bytes: &[u8]) {
    let mut script = Script(bytes);
    let files = Files::default();
    let (mut written, mut is_forged) = (write(&files, &mut script), false);
    while !script.0.is_empty() {
        let damaged = Damaged { files: &files, name: STORE };
        match script.u8() % 9 {
            action @ 0..=5 => damaged.damage(action, &mut script),
            6 => drop(files.0.borrow_mut().remove(STORE)),
            7 => {
                let body = [&LAYOUT[usize::from(script.u8() % 8 == 7)..], script.bytes()].concat();
                let (number, previous) = (script.u16() as u64, script.u16() as u64);
                damaged.change(|file| file.extend(batch::encode(number, previous, &body)));
                is_forged = true;
            }
            _ => {
                let found = read(&files);
                written = found.iter().cloned().chain(write(&files, &mut script)).collect();
                is_forged = false;
            }
        }
        let found = read(&files);
        assert!(is_forged || written.starts_with(&found), "other events than the written ones");
    }
    let found = read(&files);
    if is_forged {
        check_state(&found);
    }
    let snapshot = Recorder::new(SurfaceMemory::fold(found)).snapshot();
    EventLog::begin(files.clone(), &snapshot).expect("files in memory");
    // Numbers that are none are equal to no number, but their bytes are.
    assert_eq!(encode(&read(&files)), encode(&snapshot));
}

fn read(files: &Files) -> Vec<Event> {
    match log::read(files).expect("files in memory") {
        Some(Ok(Found { events, .. })) => events,
        Some(Err(_)) | None => Vec::new(),
    }
}

/// Begins a file with the events that it holds, and appends up to three batches; returns all events but the first ones.
fn write(files: &Files, script: &mut Script<'_>) -> Vec<Event> {
    let kept = read(files);
    let mut sequence = kept.last().map_or(0, |event| event.sequence);
    let mut log = EventLog::begin(files.clone(), &kept).expect("files in memory");
    let mut all = Vec::new();
    for _ in 0..script.u8() % 4 {
        let batch: Vec<Event> = (0..=script.u8() % 3)
            .map(|_| {
                sequence = sequence.saturating_add(1);
                let run = RunId { run: script.u8().into(), epoch: script.u8(), began_unix_ms: 5 };
                let kind = EventKind::Vehicle(1, VehicleEvent::Identified(run));
                Event { sequence, time: EventTime::default(), source: EventSource::Vehicle(1), kind }
            })
            .collect();
        log.append(&batch).expect("files in memory");
        all.extend(batch);
    }
    all
}

/// The state of these events survives a new file, and a restart of the surface with all that follows from it.
fn check_state(events: &[Event]) {
    let fold = |events: &[Event]| SurfaceMemory::fold(events.iter().cloned());
    let mut recorder = Recorder::new(fold(events));
    let snapshot = recorder.snapshot();
    let mut stored = decode(&encode(&snapshot)).expect("a snapshot decodes");
    let again = fold(&stored);
    assert_same(recorder.memory(), &again);
    assert_eq!(encode(&Recorder::new(again).snapshot()), encode(&snapshot), "another snapshot");

    let time = recorder.memory().last();
    let now = Instant::from_micros(time.mission_us);
    let mut surface = surface(now);
    let begun = recorder.begin(&mut surface, 1, 1, time);
    for archive in begun.archives {
        let decoded = decode(&encode(&archive.events)).expect("an archived map decodes");
        assert!(fold(&decoded).take_vehicle(archive.vehicle).is_some_and(|vehicle| vehicle.archived().is_some()));
    }
    stored.extend(begun.events);
    for _ in 0..4 {
        if surface.poll_transmit(now).is_some() {
            surface.handle_transmit_outcome(now);
        }
    }
    stored.extend(recorder.observe(&mut surface, Some("ann"), time).events);
    assert_same(recorder.memory(), &fold(&decode(&encode(&stored)).expect("events decode")));
}

fn surface(now: Instant) -> Surface {
    CONFIG.with(|config| {
        let modem = scenecast_config::modem_profile(config, 1000.0);
        assemble(config, None, TuningTable::default(), modem, 7, now).expect("the default configuration")
    })
}

/// Two memories are the same: everything but the cells by its text, and the cells one by one.
fn assert_same(one: &SurfaceMemory, other: &SurfaceMemory) {
    assert_eq!(format!("{one:?}"), format!("{other:?}"));
    for ((_, one), (_, other)) in one.vehicles().zip(other.vehicles()) {
        assert!(cells(one.map().labels()).eq(cells(other.map().labels())), "other labels");
        let layers = |memory: &VehicleMemory| {
            let all = memory.map().layers().map(|(id, layer)| (id, cells(layer.levels()).collect::<Vec<_>>()));
            all.filter(|(_, cells)| !cells.is_empty()).collect::<Vec<_>>()
        };
        assert_eq!(layers(one), layers(other), "other layers");
    }
}

fn cells(replica: &Replica) -> impl Iterator<Item = (i32, i32, u8, Instant)> + '_ {
    replica.cells().map(|(cell, value, at)| (cell.x, cell.y, value, at))
}
