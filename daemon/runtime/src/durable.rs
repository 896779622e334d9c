//! The vehicle's durable state: read at the start of a run, and kept during it.

use super::journal::{Damage, Journal, JournalError, Storage};
use scenecast_core::UserError;
use scenecast_vehicle::{Durable, LastPlace};
use std::path::Path;

/// The journal's file. Its records hold a [`Durable`] in postcard; another layout needs another version of the file.
const JOURNAL: &str = "vehicle.journal";
/// The state file of builds without a journal.
const EARLIER_FILE: &str = "vehicle.state";
/// Length at which the journal is rewritten: 64 records of a block.
const MAX_BYTES: usize = 64 * 4096;

/// Writes the durable state of a run to the journal.
pub(super) struct Keeper<S: Storage> {
    journal: Journal<S>,
}

/// A run whose state is on disk, so that it may transmit.
pub(super) struct StartedRun<S: Storage> {
    pub(super) keeper: Keeper<S>,
    pub(super) durable: Durable,
    /// Whether an earlier run left a state.
    pub(super) is_again: bool,
}

impl<S: Storage> Keeper<S> {
    /// Begins a run with the state that survived the last one. `checkpoint` has the lineage and the epoch of a restored
    /// scene model: if the last run had the same, its epoch continues; otherwise a new epoch begins.
    ///
    /// The first run of a mission has the given `lineage`, which is random.
    pub(super) fn begin_run(
        storage: S,
        lineage: u64,
        checkpoint: Option<(u64, u8)>,
    ) -> Result<StartedRun<S>, UserError> {
        let place = storage.path(JOURNAL);
        let opened = Journal::open(storage, JOURNAL, MAX_BYTES);
        let (journal, state) = opened.map_err(|e| for_people(&place, e))?;
        let is_again = state.is_some();
        let durable = match state {
            Some(state) => {
                let last = decode(&state).ok_or(JournalError::Damage(Damage::Version));
                let last = last.map_err(|e| for_people(&place, e))?;
                match checkpoint == Some((last.lineage, last.epoch)) {
                    true => last,
                    false => {
                        let place = last.place.map(LastPlace::for_new_map);
                        Durable { epoch: last.epoch.wrapping_add(1), labels: 0, place, ..last }
                    }
                }
            }
            None => {
                refuse_earlier_build(journal.storage())?;
                Durable { lineage, ..Durable::default() }
            }
        };
        let mut keeper = Self { journal };
        // Label ids of another model have other meanings, so a new epoch is on disk before it is published.
        keeper.save(&durable)?;
        Ok(StartedRun { keeper, durable, is_again })
    }

    /// Makes the state durable. A power cut before the return leaves either the previous state or this one.
    pub(super) fn save(&mut self, durable: &Durable) -> Result<(), UserError> {
        let place = self.journal.storage().path(JOURNAL);
        let state = postcard::to_allocvec(durable).map_err(|e| UserError::Failed(e.to_string()))?;
        self.journal.persist(&state).map_err(|e| for_people(&place, e))
    }
}

fn decode(state: &[u8]) -> Option<Durable> {
    match postcard::take_from_bytes(state) {
        Ok((durable, [])) => Some(durable),
        _ => None,
    }
}

fn refuse_earlier_build(storage: &impl Storage) -> Result<(), UserError> {
    let place = storage.path(EARLIER_FILE);
    match storage.read(EARLIER_FILE) {
        Ok(None) => Ok(()),
        Ok(Some(_)) => Err(UserError::file(
            &place,
            "the state of an earlier build, which this one does not read; move it away to begin a new mission",
        )),
        Err(e) => Err(UserError::Failed(format!("{}: {e}", place.display()))),
    }
}

fn for_people(place: &Path, error: JournalError) -> UserError {
    match error {
        JournalError::Damage(damage) => UserError::file(place, damage),
        other => UserError::Failed(format!("{}: {other}", place.display())),
    }
}

#[cfg(test)]
mod tests {
    use super::super::journal::disk::Disk;
    use super::*;
    use scenecast_protocol::link::SlotInboxState;
    use scenecast_protocol::schedule::BackgroundOrder;
    use scenecast_protocol::wire::Series;

    fn begin(disk: &Disk) -> Result<(Keeper<Disk>, Durable), UserError> {
        Keeper::begin_run(disk.clone(), 9, None).map(|run| (run.keeper, run.durable))
    }

    #[test]
    fn a_run_has_the_state_of_the_last_one_and_an_epoch_of_its_own() {
        let disk = Disk::default();
        let (mut keeper, durable) = begin(&disk).unwrap();
        assert_eq!(durable, Durable { lineage: 9, ..Durable::default() });
        let held = Durable { epoch: 4, labels: 7, hold: true, budget_bps: Some(500), ..durable };
        keeper.save(&held).unwrap();
        let later = |epoch| Durable { epoch, labels: 0, ..held.clone() };
        assert_eq!(begin(&disk).unwrap().1, later(5));
        assert_eq!(begin(&disk).unwrap().1, later(6));
    }

    #[test]
    fn only_a_checkpoint_of_the_same_mission_continues_the_epoch() {
        let disk = Disk::default();
        let (mut keeper, durable) = begin(&disk).unwrap();
        let last = Durable { epoch: 4, labels: 7, ..durable };
        keeper.save(&last).unwrap();
        let run = |checkpoint| {
            let run = Keeper::begin_run(disk.clone(), 1, Some(checkpoint)).unwrap();
            assert!(run.is_again);
            run.durable
        };
        assert_eq!(run((9, 4)), last);
        assert_eq!(run((9, 3)), Durable { epoch: 5, labels: 0, ..last.clone() });
        assert_eq!(run((8, 5)).epoch, 6, "another mission");
        let fresh = Keeper::begin_run(Disk::default(), 2, Some((9, 4))).unwrap();
        assert_eq!((fresh.durable.lineage, fresh.durable.epoch, fresh.is_again), (2, 0, false));
    }

    #[test]
    fn the_bytes_of_a_state_are_those_of_this_version_of_the_file() {
        let versions = [None, Some(300), None, None, None, Some(1), None, None];
        let inbox = SlotInboxState {
            series: Some(Series::from_random(7)),
            retired: [5, 6].map(Series::from_random).into(),
            versions,
            decisions: [0, 1, 0, 0, 0, 2, 0, 0],
        };
        let utility = Some((3, 50, -1, [(2, -3)].into()));
        let durable = Durable {
            inbox,
            epoch: 3,
            labels: 12,
            lineage: 300,
            utility,
            hold: true,
            budget_bps: Some(500),
            shares: Some([10, 5, 5, 50, 20]),
            background: Some(0x3200),
            abort: false,
            settings: vec![0x40, 0],
            limits: vec![0, 4],
            used: (130, 2),
            breach: 2,
            fence: vec![0],
            place: None,
        };
        let golden = [
            &[1, 7, 2, 5, 6][..],
            &[0, 1, 172, 2, 0, 0, 0, 1, 1, 0, 0],
            &[0, 1, 0, 0, 0, 2, 0, 0],
            &[3, 12, 172, 2],
            &[1, 3, 50, 255, 1, 2, 253, 1, 0, 1, 244, 3, 1, 10, 5, 5, 50, 20, 1, 128, 100],
            &[2, 0x40, 0, 2, 0, 4, 130, 1, 2, 2, 1, 0, 0],
        ];
        assert_eq!(postcard::to_allocvec(&durable).unwrap(), golden.concat());
        assert_eq!(decode(&golden.concat()), Some(durable));
    }

    #[test]
    fn a_state_with_two_bytes_of_background_order_reads_as_before() {
        let stored = |background: &[u8]| [&[0; 26][..], background, &[0; 7]].concat();
        let zeros = Durable::default();
        assert_eq!(decode(&stored(&[0])), Some(zeros.clone()));
        let codes = (0..0x8000u16).filter(|&code| BackgroundOrder::from_code(u128::from(code)).is_some());
        for code in codes {
            // Earlier builds held the order as a `u16`, because it had no long form.
            let bytes = stored(&postcard::to_allocvec(&Some(code)).unwrap());
            let durable = Durable { background: Some(u128::from(code)), ..zeros.clone() };
            assert_eq!(
                (decode(&bytes), postcard::to_allocvec(&durable).unwrap()),
                (Some(durable), bytes),
                "{code:04x}"
            );
        }
    }

    #[test]
    fn an_unusable_state_is_refused_in_one_line() {
        let refused = |name: &str, content: &[u8]| {
            let disk = Disk::default();
            disk.put(name, content);
            begin(&disk).err().unwrap()
        };
        let input = |text: &str| UserError::Input(text.to_owned());
        let other = "vehicle.journal: the file is of another version of scenecast; use that one, or move the file away to \
                     begin a new mission";
        assert_eq!(refused("vehicle.journal", b"scVJRN99"), input(other));
        let damaged = "vehicle.journal: damaged at byte 0; restore the file, or move it away to begin a new mission";
        assert_eq!(refused("vehicle.journal", b""), input(damaged));
        let earlier = "vehicle.state: the state of an earlier build, which this one does not read; move it away to begin a \
                       new mission";
        assert_eq!(refused("vehicle.state", b"scVSTA01"), input(earlier));
    }
}
