//! A disk that is full, read-only or gone.

use super::SurfaceStore;
use crate::journal::disk::{Disk, DiskStep};
use scenecast_core::tuning_table::TuningTable;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::Address;
use scenecast_surface::Surface;
use scenecast_surface::record::EventTime;
use std::io::{Error, ErrorKind};

fn surface() -> Surface {
    let config = scenecast_config::load(None, &[]).unwrap();
    let profile = scenecast_config::modem_profile(&config, config.modem.bit_rate);
    scenecast_surface::assemble(&config, None, TuningTable::shipped(), profile, 5, Instant::ZERO).unwrap()
}

pub(super) fn auv() -> Address {
    Address::vehicle(1).unwrap()
}

pub(super) fn at(seconds: u64) -> EventTime {
    EventTime { mission_us: seconds * 1_000_000, unix_ms: seconds * 1000 }
}

pub(super) fn start(disk: &Disk, seconds: u64) -> (SurfaceStore<Disk>, Surface) {
    let mut store = SurfaceStore::load(Ok(disk.clone()), 1).unwrap();
    let mut surface = surface();
    store.begin(&mut surface, 9, 1, at(seconds));
    (store, surface)
}

fn note(store: &mut SurfaceStore<Disk>, surface: &mut Surface, text: &str, seconds: u64) {
    surface.record_mut(auv()).unwrap().annotations.add_note("ann", text, Instant::ZERO).unwrap();
    store.commit(surface, Some("ann"), at(seconds));
}

fn notes(disk: &Disk) -> Vec<String> {
    let (_, surface) = start(disk, 100);
    surface.record(auv()).unwrap().annotations.notes.iter().map(|note| note.text.clone()).collect()
}

#[test]
fn a_disk_that_refuses_is_written_again_once_it_accepts() {
    for failing in [DiskStep::Create, DiskStep::Append, DiskStep::Sync, DiskStep::Rename, DiskStep::SyncFolder] {
        let disk = Disk::default();
        let (mut store, mut surface) = start(&disk, 0);
        note(&mut store, &mut surface, "first", 1);
        disk.fail(Some(DiskStep::Append));
        note(&mut store, &mut surface, "second", 2);
        disk.fail(Some(failing));
        store.reopen(Ok(disk.clone()), at(3));
        assert!(store.is_closed() && store.faults.write_errors > 0, "{failing:?}");
        assert!(store.faults.failing.as_ref().unwrap().contains("input/output error"));
        note(&mut store, &mut surface, "third", 4);
        assert_eq!(notes(&disk).first().map(String::as_str), Some("first"), "{failing:?}");
        disk.fail(None);
        store.reopen(Ok(disk.clone()), at(5));
        assert!(!store.is_closed() && store.faults.failing.is_none(), "{failing:?}");
        note(&mut store, &mut surface, "fourth", 6);
        assert_eq!(notes(&disk), ["first", "second", "third", "fourth"], "{failing:?}");
    }
}

#[test]
fn a_folder_that_appears_later_loses_none_of_its_content() {
    let disk = Disk::default();
    let (mut store, mut surface) = start(&disk, 0);
    note(&mut store, &mut surface, "before", 1);
    let refused = Err(Error::from(ErrorKind::PermissionDenied));
    let mut later = SurfaceStore::load(refused, 1).unwrap();
    let mut surface = self::surface();
    later.begin(&mut surface, 10, 1, at(50));
    note(&mut later, &mut surface, "after", 51);
    assert!(later.is_closed() && later.faults.write_errors == 1);
    later.reopen(Ok(disk.clone()), at(60));
    assert_eq!(notes(&disk), ["after"]);
    let names = crate::journal::Storage::list(&disk).unwrap();
    assert!(names.contains(&"surface-unread-60.store".to_owned()), "{names:?}");
}

#[test]
fn damaged_stores_and_those_of_other_missions_are_kept() {
    let disk = Disk::default();
    let (mut store, mut surface) = start(&disk, 0);
    (1..4).for_each(|i| note(&mut store, &mut surface, &format!("note {i}"), i));
    let mut bytes = crate::journal::Storage::read(&disk, "surface.store").unwrap().unwrap();
    let second = bytes.len() - 2 * 4096;
    bytes[second + 40] ^= 1;
    disk.put("surface.store", &bytes);
    assert_eq!(notes(&disk), ["note 1"], "everything before the damage");
    let names = crate::journal::Storage::list(&disk).unwrap();
    assert!(names.contains(&"surface-damaged-1.store".to_owned()), "{names:?}");
    let other = SurfaceStore::load(Ok(disk.clone()), 2).unwrap();
    assert!(other.memory().began().is_none(), "another mission begins without notes");
    let names = crate::journal::Storage::list(&disk).unwrap();
    assert!(names.iter().any(|name| name.starts_with("surface-mission-1-")), "{names:?}");
}

#[test]
fn the_file_of_a_long_mission_stays_small() {
    let disk = Disk::default();
    let (mut store, mut surface) = start(&disk, 0);
    let mut longest = 0;
    for i in 0..3000 {
        note(&mut store, &mut surface, &format!("note {i}"), i);
        longest = longest.max(crate::journal::Storage::read(&disk, "surface.store").unwrap().unwrap().len());
    }
    assert!(longest < 5 << 20, "{longest} bytes");
    assert_eq!(notes(&disk).len(), 200);
}
