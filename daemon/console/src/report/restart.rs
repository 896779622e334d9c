//! How far restarts of a vehicle's program set its map back.

use super::dive::{Dive, SetBack};
use crate::recording::Recording;
use scenecast_protocol::map::Cell;

/// The map at each restart of a vehicle by its own record; `None` where that has no map soon after it.
pub(super) fn set_backs(recording: &mut Recording, part: &str) -> Vec<Option<SetBack>> {
    let Recording { timeline, vehicles, .. } = recording;
    let Some(own) = vehicles.get_mut(part) else { return Vec::new() };
    let pauses: Vec<(u64, u64)> = own.runs.windows(2).map(|pair| (pair[0].1, pair[1].0)).collect();
    let time = |nanos: u64| timeline.mission_time(nanos);
    let set_back = |(stopped, began): (u64, u64)| {
        own.map.seek(stopped, time);
        let (before, now) = (own.map.shown(), time(stopped));
        let epoch = before.epoch;
        let age_s = |cell| before.labels.received_at(cell).map_or(0.0, |at| now.since(at).as_secs_f64());
        let held = before.labels.shown().iter().map(|(cell, label)| (cell, label, age_s(cell)));
        let held: Vec<(Cell, u8, f64)> = held.collect();
        // A program records what it read from its checkpoint within a moment.
        let has_map = (0..=STEPS).any(|n| {
            own.map.seek(began.saturating_add(n * STEP), time);
            own.map.shown().labels.shown().explored() > 0
        });
        let after = own.map.shown();
        let is_kept = |cell, label| after.epoch == epoch && after.labels.shown().get(cell) == label;
        let lost: Vec<f64> =
            held.iter().filter(|(cell, label, _)| !is_kept(*cell, *label)).map(|held| held.2).collect();
        has_map.then(|| SetBack {
            cells: held.len() as u64,
            kept: (held.len() - lost.len()) as u64,
            lost_s: lost.into_iter().fold(0.0, f64::max),
        })
    };
    pauses.into_iter().map(set_back).collect()
}

/// The time between two looks for the first map of a run, nanoseconds, and the number of looks.
const STEP: u64 = 100_000_000;
const STEPS: u64 = 30;

impl SetBack {
    /// The end of the sentence about the restart.
    pub(super) fn told(&self, dive: &Dive) -> String {
        match (self.cells, self.kept) {
            (0, _) => String::new(),
            (cells, kept) if kept == cells => {
                ", with the whole map of its record, which may lack the last seconds before".to_owned()
            }
            (cells, kept) => format!(
                ", with {kept} of the {cells} cells of its map as they were: the program had not stored what changed in the last {} of its record",
                dive.mission_lasted(self.lost_s.max(dive.mission_s(1.0)))
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::Known;
    use scenecast_messages::scenecast_msgs::MapCells;

    const SECOND: u64 = 1_000_000_000;

    fn change(whole: bool, cells: &[(i32, u8)]) -> MapCells {
        let (x, value) = (cells.iter().map(|cell| cell.0).collect(), cells.iter().map(|cell| cell.1).collect());
        MapCells { whole, x, y: vec![0; cells.len()], value, ..MapCells::default() }
    }

    /// A run with a map that changed at 10 s and at 30 s and ended at 40 s, and one that began with these cells at 60 s.
    fn set_back(after: &[(i32, u8)]) -> SetBack {
        let runs = vec![(0, 40 * SECOND), (60 * SECOND, 90 * SECOND)];
        let mut own = Known { runs, ..Known::default() };
        own.map.take(0, change(true, &[(0, 1), (1, 1), (2, 1)]));
        own.map.take(10 * SECOND, change(false, &[(0, 2)]));
        own.map.take(30 * SECOND, change(false, &[(3, 4)]));
        own.map.take(60 * SECOND, change(true, &[]));
        own.map.take(60 * SECOND + 1, change(true, after));
        let mut recording = Recording::default();
        recording.vehicles.insert("auv".to_owned(), own);
        set_backs(&mut recording, "auv")[0].unwrap()
    }

    #[test]
    fn a_restart_loses_the_changes_since_the_checkpoint() {
        let mut dive = Dive::default();
        dive.state.mission.speed = 1.0;
        let told = |after: &[(i32, u8)]| set_back(after).told(&dive);
        assert_eq!(set_back(&[(0, 1), (1, 1), (2, 1)]), SetBack { cells: 4, kept: 2, lost_s: 30.0 });
        let late = told(&[(0, 2), (1, 1), (2, 1)]);
        assert!(late.contains("3 of the 4 cells") && late.contains("what changed in the last 10 s of"), "{late}");
        assert_eq!(
            told(&[(0, 2), (1, 1), (2, 1), (3, 4)]),
            ", with the whole map of its record, which may lack the last seconds before"
        );
        assert!(told(&[(9, 1)]).contains("with 0 of the 4 cells"), "{}", told(&[(9, 1)]));
    }
}
