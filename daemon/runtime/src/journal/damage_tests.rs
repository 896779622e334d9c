//! Damaged files: a journal is never read as an older state.

use super::cuts_tests::{NAMES, state};
use super::disk::Disk;
use super::record::FILE_BYTES;
use super::{Damage, Found, Journal, Storage};
use proptest::prelude::*;

/// Disk, both files after five states, and the last state.
struct Written {
    disk: Disk,
    journal: Vec<u8>,
    copy: Vec<u8>,
    last: Vec<u8>,
}

fn written(length: usize) -> Written {
    let disk = Disk::default();
    let (mut journal, _) = Journal::open(disk.clone(), NAMES);
    (0..5).for_each(|number| journal.persist(&state(number, length)).unwrap());
    let read = |name| disk.read(name).unwrap().unwrap();
    let (journal, copy) = (read(NAMES.journal), read(NAMES.copy));
    Written { disk, journal, copy, last: state(4, length) }
}

/// Whether damage is recognised: the state is lost, or it is the last one, from the other file.
fn is_recognised(found: &Found, last: &[u8]) -> bool {
    match found {
        Found::Lost(..) => true,
        Found::State { body, damage, .. } => body == last && damage.is_some(),
        Found::Absent => false,
    }
}

#[test]
fn a_journal_truncated_at_any_byte_is_recognised_as_damaged() {
    let Written { disk, journal, copy, last } = written(300);
    for length in 0..FILE_BYTES {
        for (name, whole) in [(NAMES.journal, &journal), (NAMES.copy, &copy)] {
            disk.put(NAMES.journal, &journal);
            disk.put(NAMES.copy, &copy);
            disk.put(name, &whole[..length]);
            let found = Journal::open(disk.clone(), NAMES).1;
            assert!(is_recognised(&found, &last), "{name} of {length} bytes: {found:?}");
        }
        disk.put(NAMES.journal, &journal[..length]);
        disk.put(NAMES.copy, &copy[..length]);
        let found = Journal::open(disk.clone(), NAMES).1;
        assert!(matches!(found, Found::Lost(_, Damage::Length { bytes }) if bytes == length), "{length}: {found:?}");
    }
}

#[test]
fn a_journal_shifted_by_any_distance_is_never_an_older_state() {
    let Written { disk, journal, copy, last } = written(300);
    let left = |bytes: &[u8], by: usize| [&bytes[by..], &vec![0; by]].concat();
    let right = |bytes: &[u8], by: usize| [&vec![0; by], &bytes[..FILE_BYTES - by]].concat();
    for by in (1..600).chain((600..=FILE_BYTES).step_by(97)).chain([4096, 8192, FILE_BYTES]) {
        for shift in [&left as &dyn Fn(&[u8], usize) -> Vec<u8>, &right] {
            let (shifted, shifted_copy) = (shift(&journal, by), shift(&copy, by));
            disk.put(NAMES.journal, &shifted);
            disk.put(NAMES.copy, &shifted_copy);
            assert!(matches!(Journal::open(disk.clone(), NAMES).1, Found::Lost(..)), "shifted by {by}");
            for (one, other) in [(&shifted, &copy), (&journal, &shifted_copy)] {
                disk.put(NAMES.journal, one);
                disk.put(NAMES.copy, other);
                // A stop while one file was written could leave the same, so it is no damage: no state is lost.
                let whole = Found::State { body: last.clone(), damage: None };
                assert_eq!(Journal::open(disk.clone(), NAMES).1, whole, "shifted by {by}");
            }
        }
    }
}

#[test]
fn an_old_file_in_the_place_of_the_last_is_recognised() {
    let Written { disk, journal, copy, .. } = written(100);
    let mut run = Journal::open(disk.clone(), NAMES).0;
    (5..9).for_each(|number| run.persist(&state(number, 100)).unwrap());
    let last = state(8, 100);
    let (new, new_copy) = (disk.read(NAMES.journal).unwrap().unwrap(), disk.read(NAMES.copy).unwrap().unwrap());
    for (one, other, damaged) in [(&journal, &new_copy, NAMES.journal), (&new, &copy, NAMES.copy)] {
        disk.put(NAMES.journal, one);
        disk.put(NAMES.copy, other);
        let found = Journal::open(disk.clone(), NAMES).1;
        let damage = Some((damaged, Damage::Older));
        assert_eq!(found, Found::State { body: last.clone(), damage });
    }
    disk.put(NAMES.journal, &new_copy);
    disk.put(NAMES.copy, &new);
    assert!(matches!(Journal::open(disk.clone(), NAMES).1, Found::Lost(..)), "each has the place of the other");
}

#[test]
fn a_missing_file_is_damage_unless_both_are() {
    for (name, other) in [(NAMES.journal, NAMES.copy), (NAMES.copy, NAMES.journal)] {
        let Written { disk, last, .. } = written(100);
        disk.remove(name);
        let damage = Some((name, Damage::Missing));
        let found = Journal::open(disk.clone(), NAMES).1;
        assert_eq!(found, Found::State { body: last, damage });
        disk.remove(other);
        assert_eq!(Journal::open(disk, NAMES).1, Found::Absent);
    }
}

#[test]
fn a_damaged_file_is_put_aside_and_both_are_whole_again() {
    let Written { disk, journal, copy, .. } = written(100);
    for (name, cut) in [(NAMES.journal, &journal[..700]), (NAMES.copy, &copy[..700])] {
        disk.put(name, cut);
        let mut run = Journal::open(disk.clone(), NAMES).0;
        run.persist(b"next").unwrap();
        let whole = Found::State { body: b"next".to_vec(), damage: None };
        assert_eq!(Journal::open(disk.clone(), NAMES).1, whole);
        assert_eq!(disk.read(&format!("{name}.damaged")).unwrap().as_deref(), Some(cut));
    }
}

#[test]
fn a_journal_of_another_version_is_lost_and_put_aside() {
    let Written { disk, journal, copy, .. } = written(100);
    let other = [journal, copy].map(|mut bytes| {
        bytes[7] = b'3';
        bytes
    });
    disk.put(NAMES.journal, &other[0]);
    disk.put(NAMES.copy, &other[1]);
    let (mut run, found) = Journal::open(disk.clone(), NAMES);
    assert_eq!(found, Found::Lost(NAMES.journal, Damage::Version));
    run.persist(b"next").unwrap();
    assert_eq!(Journal::open(disk.clone(), NAMES).1, Found::State { body: b"next".to_vec(), damage: None });
    for (name, bytes) in [NAMES.journal, NAMES.copy].into_iter().zip(&other) {
        assert_eq!(disk.read(&format!("{name}.damaged")).unwrap().as_ref(), Some(bytes));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]
    #[test]
    fn random_damage_never_leads_to_an_older_state(
        cuts in proptest::collection::vec((any::<bool>(), 0usize..FILE_BYTES, 0usize..FILE_BYTES, any::<u8>()), 1..6),
    ) {
        let Written { disk, journal, copy, last } = written(900);
        let mut files = [journal, copy];
        for (which, at, length, byte) in cuts {
            let file = &mut files[usize::from(which)];
            match byte % 4 {
                0 => file.truncate(at),
                1 => drop(file.drain(..at.min(file.len()))),
                2 => file.splice(..0, vec![byte; length]).for_each(drop),
                _ => file.iter_mut().skip(at).take(length).for_each(|b| *b ^= byte),
            }
        }
        disk.put(NAMES.journal, &files[0]);
        disk.put(NAMES.copy, &files[1]);
        match Journal::open(disk, NAMES).1 {
            Found::Lost(..) => {}
            Found::State { body, .. } => prop_assert_eq!(body, last),
            Found::Absent => prop_assert!(false, "files are there"),
        }
    }
}
