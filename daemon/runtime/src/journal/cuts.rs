//! The journal under power cuts and failing disks.

use super::disk::{Disk, DiskRng, DiskStep};
use super::record::{self, BLOCK};
use super::{Damage, Journal, JournalError, Storage};
use proptest::prelude::*;

const NAME: &str = "test.journal";
/// A file of few records, so that new files begin often.
const MAX_BYTES: usize = 4 * BLOCK;

fn open(disk: &Disk) -> (Journal<Disk>, Option<Vec<u8>>) {
    Journal::open(disk.clone(), NAME, MAX_BYTES).expect("a power cut leaves a readable journal")
}

/// Random bytes that depend on the number and the length, so that a mixture of two states is never a third one.
fn state(number: u32, length: usize) -> Vec<u8> {
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
fn a_record_torn_at_any_byte_leaves_the_one_before() {
    for length in [40, 5000] {
        let [old, new] = [1, 2].map(|number| record::encode(number.into(), &state(number, length)));
        let whole = length + 4 + 24;
        for torn in 0..=new.len() {
            for zeros in [0, new.len() - torn] {
                let disk = Disk::default();
                disk.put(NAME, &[&old[..], &new[..torn], &vec![0; zeros]].concat());
                let found = open(&disk).1.unwrap();
                // The last bytes of a checksum may be zeros by chance.
                let complete = torn >= whole || zeros > 0 && new[torn..whole].iter().all(|&b| b == 0);
                assert_eq!(found, state(if complete { 2 } else { 1 }, length), "{torn} bytes and {zeros} zeros");
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
            assert_eq!(steps, 5, "create, append, sync, rename, sync of the folder");
            break;
        }
    }
    // Between the rename and the sync of the folder both may be found, before only the old one, after only the new one.
    for (steps, new) in (0..=5).flat_map(|s| [(s, false), (s, true)]) {
        let possible = if new { steps >= 4 } else { steps <= 4 };
        assert_eq!(outcomes.contains(&(steps, new)), possible, "cut before step {steps}: new {new}");
    }
}

#[test]
fn the_first_state_is_whole_or_absent() {
    for (steps, seed) in (0..=5).flat_map(|steps| (0..100).map(move |seed| (steps, seed))) {
        let disk = Disk::default();
        disk.cut_after(steps);
        let confirmed = open(&disk).0.persist(b"first").is_ok();
        disk.power_cut(DiskRng::new(seed));
        let found = open(&disk).1;
        assert!(found.as_deref() == Some(b"first") || found.is_none() && !confirmed);
    }
}

#[test]
fn after_a_failed_step_no_state_is_confirmed_or_written() {
    for records in [0, 1, 4] {
        for failing in [DiskStep::Create, DiskStep::Append, DiskStep::Sync, DiskStep::Rename, DiskStep::SyncFolder] {
            let disk = Disk::default();
            let mut expected = Expected { possible: vec![None], written: 0 };
            let (mut journal, _) = open(&disk);
            (0..records).for_each(|_| assert!(expected.persist(&mut journal, 10)));
            disk.fail(Some(failing));
            if expected.persist(&mut journal, 10) {
                continue;
            }
            disk.fail(None);
            let steps = disk.steps().len();
            let again = journal.persist(b"later");
            assert!(matches!(again, Err(JournalError::Broken)), "{failing:?}");
            assert_eq!(disk.steps().len(), steps, "no record is written behind a failure");
            let (mut journal, found) = open(&disk);
            assert!(expected.possible.contains(&found));
            assert!(expected.persist(&mut journal, 10), "a new run continues");
        }
    }
}

#[test]
fn a_durable_state_is_not_written_again() {
    let disk = Disk::default();
    let (mut journal, _) = open(&disk);
    journal.persist(b"same").unwrap();
    let steps = disk.steps();
    journal.persist(b"same").unwrap();
    assert_eq!(disk.steps(), steps);
    assert_eq!(steps, [DiskStep::Create, DiskStep::Append, DiskStep::Sync, DiskStep::Rename, DiskStep::SyncFolder]);
}

#[test]
fn the_file_stays_within_its_limit() {
    let disk = Disk::default();
    let (mut journal, _) = open(&disk);
    for number in 0..50 {
        journal.persist(&state(number, 10)).unwrap();
        assert!(disk.read(NAME).unwrap().unwrap().len() <= MAX_BYTES);
    }
    assert_eq!(open(&disk).1, Some(state(49, 10)));
}

#[test]
fn damage_is_an_error_with_its_position() {
    let disk = Disk::default();
    let mut records: Vec<u8> = (1..4).flat_map(|n| record::encode(n, b"state")).collect();
    records[BLOCK + 21] ^= 1;
    disk.put(NAME, &records);
    let error = Journal::open(disk, NAME, MAX_BYTES).err().unwrap();
    assert!(matches!(error, JournalError::Damage(Damage::At { offset: BLOCK })));
    assert!(error.to_string().starts_with("damaged at byte 4096; restore the file"), "{error}");
}
