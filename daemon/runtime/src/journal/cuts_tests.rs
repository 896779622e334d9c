//! The journal under power cuts and failing disks.

use super::disk::{Disk, DiskRefusal, DiskRng, DiskStep};
use super::record::FILE_BYTES;
use super::{Found, Journal, JournalNames, Storage};
use proptest::prelude::*;

pub(super) const NAMES: JournalNames = JournalNames { journal: "test.journal", copy: "test.journal.copy" };

/// Opens a journal whose disk had power cuts and refusals, but no damage.
fn open(disk: &Disk) -> (Journal<Disk>, Option<Vec<u8>>) {
    match Journal::open(disk.clone(), NAMES) {
        (journal, Found::Absent) => (journal, None),
        (journal, Found::State { body, damage: None }) => (journal, Some(body)),
        (_, other) => panic!("a power cut leaves a readable journal: {other:?}"),
    }
}

/// Random bytes that depend on the number and the length, so that a mixture of two states is never a third one.
pub(super) fn state(number: u32, length: usize) -> Vec<u8> {
    let mut rng = DiskRng::new(u64::from(number) << 20 | length as u64);
    let noise = (0..length).map(|_| rng.below(256) as u8);
    number.to_be_bytes().into_iter().chain(noise).collect()
}

/// The states that a journal may hold: the last confirmed one, or one that was being written since.
struct Expected {
    possible: Vec<Option<Vec<u8>>>,
    written: u32,
}

impl Expected {
    fn persist(&mut self, journal: &mut Journal<Disk>, length: usize) -> bool {
        self.written += 1;
        let new = state(self.written, length);
        let confirmed = journal.persist(&new).is_ok();
        if confirmed {
            self.possible.clear();
        }
        self.possible.push(Some(new));
        confirmed
    }
}

#[derive(Debug, Clone)]
enum Action {
    Persist(usize),
    /// The process ends, the machine keeps running.
    Kill,
    /// Power is cut after this many further steps.
    CutAfter(usize),
    Fail(DiskStep, usize),
}

fn actions() -> impl Strategy<Value = Vec<Action>> {
    let length = || prop_oneof![Just(0usize), 1usize..600, 4060usize..4080, 0usize..9000];
    let step = prop_oneof![
        Just(DiskStep::Create),
        Just(DiskStep::Append),
        Just(DiskStep::Overwrite),
        Just(DiskStep::Sync),
        Just(DiskStep::Rename),
        Just(DiskStep::SyncFolder),
    ];
    let action = prop_oneof![
        6 => length().prop_map(Action::Persist),
        1 => Just(Action::Kill),
        3 => (0usize..12).prop_map(Action::CutAfter),
        1 => (step, length()).prop_map(|(step, length)| Action::Fail(step, length)),
    ];
    proptest::collection::vec(action, 1..60)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]
    #[test]
    fn a_journal_holds_the_confirmed_or_the_interrupted_state(actions in actions(), seed: u64) {
        let disk = Disk::default();
        let (mut journal, found) = open(&disk);
        prop_assert_eq!(found, None);
        let mut expected = Expected { possible: vec![None], written: 0 };
        for (i, action) in actions.into_iter().enumerate() {
            let confirmed = match action {
                Action::Persist(length) => expected.persist(&mut journal, length),
                Action::Fail(step, length) => {
                    disk.fail(Some(step));
                    let confirmed = expected.persist(&mut journal, length);
                    disk.fail(None);
                    confirmed
                }
                Action::CutAfter(steps) => {
                    disk.cut_after(steps);
                    true
                }
                Action::Kill => false,
            };
            if confirmed && !disk.is_off() {
                continue;
            }
            if disk.is_off() {
                disk.power_cut(DiskRng::new(seed ^ i as u64));
                let (again, found) = open(&disk);
                prop_assert!(expected.possible.contains(&found));
                expected.possible = vec![found];
                journal = again;
            } else {
                let (again, found) = open(&disk);
                prop_assert!(expected.possible.contains(&found));
                journal = again;
            }
        }
    }
}

#[test]
fn a_write_cut_at_any_step_leaves_the_old_or_the_new_state() {
    let mut outcomes = Vec::new();
    for steps in 0.. {
        let mut confirmed = false;
        for seed in 0..200 {
            let disk = Disk::default();
            let mut expected = Expected { possible: vec![None], written: 0 };
            let (mut journal, _) = open(&disk);
            (0..4).for_each(|_| assert!(expected.persist(&mut journal, 100)));
            disk.cut_after(steps);
            confirmed = expected.persist(&mut journal, 100);
            disk.power_cut(DiskRng::new(seed));
            let (mut journal, found) = open(&disk);
            assert!(expected.possible.contains(&found), "cut before step {steps}");
            outcomes.push((steps, found == Some(state(5, 100))));
            assert!(expected.persist(&mut journal, 100), "the journal continues");
            assert_eq!(open(&disk).1, Some(state(6, 100)));
        }
        if confirmed {
            assert_eq!(steps, 4, "overwrite and sync, of the copy and of the journal");
            break;
        }
    }
    // While the copy is written both may be found; afterwards only the new one.
    for (steps, new) in (0..=4).flat_map(|s| [(s, false), (s, true)]) {
        let possible = if new { true } else { steps <= 1 };
        assert_eq!(outcomes.contains(&(steps, new)), possible, "cut before step {steps}: new {new}");
    }
}

#[test]
fn the_first_state_is_whole_or_absent() {
    for (steps, seed) in (0..=10).flat_map(|steps| (0..100).map(move |seed| (steps, seed))) {
        let disk = Disk::default();
        disk.cut_after(steps);
        let confirmed = open(&disk).0.persist(b"first").is_ok();
        assert_eq!(confirmed, steps == 10);
        disk.power_cut(DiskRng::new(seed));
        let found = open(&disk).1;
        assert!(found.as_deref() == Some(b"first") || found.is_none() && !confirmed);
    }
}

#[test]
fn a_refused_state_is_not_confirmed_and_the_next_one_is() {
    for records in [0, 1, 4] {
        let steps = [DiskStep::Create, DiskStep::Append, DiskStep::Sync, DiskStep::Rename, DiskStep::SyncFolder];
        for failing in steps.into_iter().chain([DiskStep::Overwrite]) {
            let disk = Disk::default();
            let mut expected = Expected { possible: vec![None], written: 0 };
            let (mut journal, _) = open(&disk);
            (0..records).for_each(|_| assert!(expected.persist(&mut journal, 10)));
            disk.fail(Some(failing));
            if expected.persist(&mut journal, 10) {
                continue;
            }
            disk.fail(None);
            assert!(expected.possible.contains(&open(&disk).1));
            assert!(expected.persist(&mut journal, 10), "the disk takes it again");
            assert_eq!(open(&disk).1, expected.possible[0]);
        }
    }
}

#[test]
fn a_full_disk_takes_records_after_the_first() {
    let disk = Disk::default();
    disk.refuse(DiskRefusal::Full);
    assert!(open(&disk).0.persist(b"first").is_err());
    disk.refuse(DiskRefusal::None);
    open(&disk).0.persist(b"first").unwrap();
    disk.refuse(DiskRefusal::Full);
    let mut expected = Expected { possible: Vec::new(), written: 0 };
    for run in 0..5 {
        let (mut journal, _) = open(&disk);
        (0..5).for_each(|i| assert!(expected.persist(&mut journal, 700 * (run + i))));
        assert_eq!(open(&disk).1, expected.possible[0]);
    }
}

#[test]
fn both_files_keep_their_length() {
    let disk = Disk::default();
    let (mut journal, _) = open(&disk);
    for number in 0..50 {
        journal.persist(&state(number, 10 * number as usize)).unwrap();
        for name in [NAMES.journal, NAMES.copy] {
            assert_eq!(disk.read(name).unwrap().unwrap().len(), FILE_BYTES);
        }
    }
    assert_eq!(open(&disk).1, Some(state(49, 490)));
}
