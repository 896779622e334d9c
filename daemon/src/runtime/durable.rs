//! The vehicle's durable state: what is read of it at the start, and kept while it runs.

use super::journal::{Damage, Journal, JournalError, Storage};
use crate::auv::Durable;
use crate::problem::Problem;

/// The journal's file. Its records hold a [`Durable`] in postcard; a change of that is another version of the file.
const JOURNAL: &str = "vehicle.journal";
/// The file of builds before there was a journal.
const BEFORE: &str = "vehicle.state";
/// Length at which the journal begins anew: 64 records of a block.
const MOST_BYTES: usize = 64 * 4096;

/// Keeps the durable state of a run.
pub(super) struct Keeper<S: Storage> {
    journal: Journal<S>,
}

impl<S: Storage> Keeper<S> {
    /// Begins a run: what survived the last one, with an epoch that no run before has used.
    pub(super) fn begin_run(storage: S) -> Result<(Self, Durable), Problem> {
        let place = storage.path(JOURNAL);
        let opened = Journal::open(storage, JOURNAL, MOST_BYTES);
        let (journal, state) = opened.map_err(|e| for_people(&place, e))?;
        let durable = match state {
            Some(state) => {
                let last = decode(&state).ok_or(JournalError::Damage(Damage::Version));
                let last = last.map_err(|e| for_people(&place, e))?;
                Durable { epoch: last.epoch.wrapping_add(1), ..last }
            }
            None => {
                refuse_earlier_build(journal.storage())?;
                Durable::default()
            }
        };
        let mut keeper = Self { journal };
        // Label ids of another run mean something else: the epoch is this run's own before it is told to anybody.
        keeper.save(&durable)?;
        Ok((keeper, durable))
    }

    /// Makes the state durable: a power cut before this has returned leaves the last one or this one.
    pub(super) fn save(&mut self, durable: &Durable) -> Result<(), Problem> {
        let place = self.journal.storage().path(JOURNAL);
        let state = postcard::to_allocvec(durable).map_err(|e| Problem::Failed(e.to_string()))?;
        self.journal.persist(&state).map_err(|e| for_people(&place, e))
    }
}

fn decode(state: &[u8]) -> Option<Durable> {
    match postcard::take_from_bytes(state) {
        Ok((durable, [])) => Some(durable),
        _ => None,
    }
}

fn refuse_earlier_build(storage: &impl Storage) -> Result<(), Problem> {
    let place = storage.path(BEFORE);
    match storage.read(BEFORE) {
        Ok(None) => Ok(()),
        Ok(Some(_)) => Err(Problem::file(
            &place,
            "the state of an earlier build, which this one does not read; move it away to begin a new mission",
        )),
        Err(e) => Err(Problem::Failed(format!("{}: {e}", place.display()))),
    }
}

fn for_people(place: &std::path::Path, error: JournalError) -> Problem {
    match error {
        JournalError::Damage(damage) => Problem::file(place, damage),
        other => Problem::Failed(format!("{}: {other}", place.display())),
    }
}
