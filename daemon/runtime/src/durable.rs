//! The vehicle's durable state, read at the start of a run and kept during it, and the free space of its disk.

use super::checkpoint::has_checkpoint;
use super::journal::{Damage, Found, Journal, JournalNames, Storage};
use scenecast_config::{Config, StartMode};
use scenecast_core::{TangentPlane, UserError};
use scenecast_files::{CoordinateFrame, read_fence};
use scenecast_protocol::directive::Fence;
use scenecast_vehicle::{Durable, LastPlace, LostOrders, VehicleDisk};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// The journal's files. Their records hold a [`Durable`] in postcard; another layout needs another version of the files.
const JOURNAL: JournalNames = JournalNames { journal: "vehicle.journal", copy: "vehicle.journal.copy" };

/// Writes the durable state of a run to the journal.
pub(super) struct Keeper<S: Storage> {
    journal: Journal<S>,
    /// Whether the last state was refused.
    is_refused: bool,
}

/// How a vehicle begins that has no orders from before its start.
#[derive(Debug, Clone, Default)]
pub(super) struct FirstStart {
    /// Whether it surveys without any order.
    pub(super) is_free: bool,
    /// The fence of its configuration.
    pub(super) fence: Option<Fence>,
}

impl FirstStart {
    /// Reads `survey.start` and the file of `survey.fence_file`.
    pub(super) fn of(config: &Config) -> Result<Self, UserError> {
        let fence = config.survey.fence_file.as_deref().map(|file| configured_fence(file, config)).transpose()?;
        Ok(Self { is_free: config.survey.start == StartMode::Free || fence.is_some(), fence })
    }

    fn durable(&self, lineage: u64) -> Durable {
        let fence = self.fence.as_ref().map_or_else(Vec::new, Fence::to_bytes);
        if !self.is_free {
            tracing::warn!("no order from before this start is known: the vehicle holds until it is ordered to resume");
        }
        Durable { lineage, hold: !self.is_free, fence, ..Durable::default() }
    }
}

/// Reads `survey.fence_file`: in degrees where the origin is known, else in metres.
fn configured_fence(file: &Path, config: &Config) -> Result<Fence, UserError> {
    let frame = match config.mission.origin_deg {
        Some(origin) => CoordinateFrame::Wgs84(TangentPlane::new(origin)),
        None => CoordinateFrame::Metres,
    };
    let error = |line: String| UserError::Input(format!("survey.fence_file = {}: {line}", file.display()));
    let fence = read_fence(file, frame)?.to_fence().map_err(|why| error(why.to_string()))?;
    match fence.fence {
        Some(_) => Ok(fence),
        None => Err(error("it has no fence".to_owned())),
    }
}

/// A run at its start.
pub(super) struct StartedRun<S: Storage> {
    pub(super) keeper: Keeper<S>,
    pub(super) durable: Durable,
    /// Whether an earlier run left a state.
    pub(super) is_again: bool,
    /// Whether the state is on the disk. If not, the vehicle holds, and its epoch may have been used before.
    pub(super) is_stored: bool,
}

impl<S: Storage> Keeper<S> {
    /// Begins a run with the state that survived the last one. `checkpoint` has the lineage and the epoch of a restored
    /// scene model: if the last run had the same, its epoch continues; otherwise a new epoch begins.
    ///
    /// The first run of a mission has the given `lineage`, which is random. A vehicle cannot tell it from a run whose
    /// folder is lost, so that it begins as `first` says. The run begins in hold if the journal is
    /// damaged, if it is missing beside a checkpoint, or if the disk does not take the state. A damaged journal costs the orders, and
    /// not the map: the run takes the lineage of the checkpoint over.
    pub(super) fn begin_run(
        storage: S,
        lineage: u64,
        checkpoint: Option<(u64, u8)>,
        first: &FirstStart,
    ) -> StartedRun<S> {
        let (journal, found) = Journal::open(storage, JOURNAL);
        let storage = journal.storage();
        let forgotten = |name, damage: &Damage| {
            // Beside no journal at all, the checkpoint may be another mission's.
            let checkpoint = checkpoint.filter(|_| *damage != Damage::Missing);
            forgetful(&storage.path(name), damage, lineage, checkpoint, first)
        };
        let (mut durable, is_again) = match found {
            Found::Absent if !has_checkpoint(storage) => (first.durable(lineage), false),
            Found::Absent => (forgotten(JOURNAL.journal, &Damage::Missing), true),
            Found::Lost(name, damage) => (forgotten(name, &damage), true),
            Found::State { body, damage } => match decode(&body) {
                Some(last) => {
                    let mut durable = continued(last, checkpoint);
                    if let Some((name, damage)) = damage {
                        let place = storage.path(name);
                        tracing::error!("{}: {damage}; the other copy is used, and the vehicle holds", place.display());
                        durable.hold = true;
                    }
                    (durable, true)
                }
                None => (forgotten(JOURNAL.journal, &Damage::Version), true),
            },
        };
        let mut keeper = Self { journal, is_refused: false };
        // Label ids of another model have other meanings, so a new epoch is on disk before it is published.
        let is_stored = keeper.save(&durable);
        if !is_stored {
            tracing::error!("the vehicle holds, because its journal cannot be written");
            durable.hold = true;
        }
        StartedRun { keeper, durable, is_again, is_stored }
    }

    /// Makes the state durable and returns whether the disk took it. A power cut before the return leaves either the
    /// previous state or this one. The first of several refusals is logged as an error.
    pub(super) fn save(&mut self, durable: &Durable) -> bool {
        let stored = match postcard::to_allocvec(durable) {
            Ok(state) => self.journal.persist(&state).map_err(|e| e.to_string()),
            Err(e) => Err(e.to_string()),
        };
        let place = self.journal.storage().path(JOURNAL.journal);
        let was_refused = std::mem::replace(&mut self.is_refused, stored.is_err());
        match stored {
            Ok(()) if was_refused => tracing::info!("{}: the disk takes the state again", place.display()),
            Err(e) if !was_refused => tracing::error!(
                "{}: {e}; until the disk takes it, the vehicle obeys only hold and abort",
                place.display()
            ),
            Err(e) => tracing::debug!("{}: {e}", place.display()),
            Ok(()) => {}
        }
        !self.is_refused
    }
}

/// The state of a run that continues the last one's.
fn continued(last: Durable, checkpoint: Option<(u64, u8)>) -> Durable {
    if checkpoint == Some((last.lineage, last.epoch)) {
        return last;
    }
    let place = last.place.map(LastPlace::for_new_map);
    Durable { epoch: last.epoch.wrapping_add(1), labels: 0, place, ..last }
}

/// The state of a run after the loss of the last one's: it holds, and applies no order that may have been applied before.
/// The map that was learnt goes on from its checkpoint. The last epoch is not known: the new one is random, and far from that of the
/// checkpoint, which the last run began at or soon after.
fn forgetful(
    place: &Path,
    damage: &Damage,
    lineage: u64,
    checkpoint: Option<(u64, u8)>,
    first: &FirstStart,
) -> Durable {
    tracing::error!("{}: {damage}; the vehicle's orders are lost, and it holds", place.display());
    let random = lineage.to_be_bytes()[0];
    let (lineage, epoch) = match checkpoint {
        Some((lineage, epoch)) => (lineage, epoch.wrapping_add(64 + random % 128)),
        None => (lineage, random),
    };
    Durable { epoch, hold: true, lost: LostOrders::Present, ..first.durable(lineage) }
}

fn decode(state: &[u8]) -> Option<Durable> {
    match postcard::take_from_bytes(state) {
        Ok((durable, [])) => Some(durable),
        _ => None,
    }
}

/// Time between two looks at the free space.
const LOOK_INTERVAL: Duration = Duration::from_secs(10);

/// Bytes that this user may still write to the disk of a folder; `None` if that is unknown.
#[cfg(unix)]
pub(super) fn free_bytes(dir: &Path) -> Option<u64> {
    let stats = nix::sys::statvfs::statvfs(dir).ok()?;
    #[allow(clippy::useless_conversion, reason = "the types differ between systems")]
    Some(u64::from(stats.blocks_available()).saturating_mul(u64::from(stats.fragment_size())))
}

#[cfg(not(unix))]
pub(super) fn free_bytes(_: &Path) -> Option<u64> {
    None
}

/// The checkpoints of a vehicle.
#[derive(Debug, Clone, Copy)]
pub(super) enum Checkpoint {
    SceneModel,
    Labels,
}

/// The disk with the vehicle's files.
pub(super) struct DiskWatch {
    dir: PathBuf,
    /// Whether the last checkpoint of each kind was refused.
    refused: [bool; 2],
    /// Whether the last look did not find the folder.
    is_gone: bool,
    /// `None` if a look is due at once.
    looked: Option<Instant>,
}

impl DiskWatch {
    pub(super) fn new(dir: &Path) -> Self {
        Self { dir: dir.to_owned(), refused: [false; 2], is_gone: false, looked: None }
    }

    /// A checkpoint was written or refused.
    pub(super) fn handle_checkpoint(&mut self, which: Checkpoint, is_refused: bool) {
        (self.refused[which as usize], self.looked) = (is_refused, None);
    }

    /// The state of the disk, at its first look, after a change, and every [`LOOK_INTERVAL`].
    pub(super) fn look(&mut self, now: Instant) -> Option<VehicleDisk> {
        if self.looked.is_some_and(|at| now < at + LOOK_INTERVAL) {
            return None;
        }
        self.looked = Some(now);
        // Open files are written on, although nobody finds them again.
        let is_gone = !self.dir.is_dir();
        let was_gone = std::mem::replace(&mut self.is_gone, is_gone);
        if is_gone && !was_gone {
            tracing::error!("{}: the folder is gone: a restart would find neither orders nor map", self.dir.display());
        }
        let is_checkpoint_refused = is_gone || self.refused.contains(&true);
        Some(VehicleDisk { free_bytes: free_bytes(&self.dir), is_checkpoint_refused })
    }
}

#[cfg(test)]
mod tests {
    use super::super::journal::disk::{Disk, DiskRefusal};
    use super::*;
    use scenecast_protocol::coordinates::DecimetrePoint;
    use scenecast_protocol::directive::{Polygon, Series};
    use scenecast_protocol::link::{SeriesRecord, SlotInboxState};
    use scenecast_vehicle::{KeptBudget, KeptGoals, KeptKeys, KeptLimits, KeptUtility};

    const NAMES: [&str; 2] = [JOURNAL.journal, JOURNAL.copy];

    fn bits_per_s(rate: u32) -> KeptBudget {
        KeptBudget { bits_per_s: Some(rate), ..KeptBudget::default() }
    }

    fn free() -> FirstStart {
        FirstStart { is_free: true, fence: None }
    }

    fn begin(disk: &Disk) -> (Keeper<Disk>, Durable) {
        let run = Keeper::begin_run(disk.clone(), 9, None, &free());
        (run.keeper, run.durable)
    }

    #[test]
    fn a_run_has_the_state_of_the_last_one_and_an_epoch_of_its_own() {
        let disk = Disk::default();
        let (mut keeper, durable) = begin(&disk);
        assert_eq!(durable, Durable { lineage: 9, ..Durable::default() });
        let held = Durable { epoch: 4, labels: 7, hold: true, budget: bits_per_s(500), ..durable };
        assert!(keeper.save(&held));
        let later = |epoch| Durable { epoch, labels: 0, ..held.clone() };
        assert_eq!(begin(&disk).1, later(5));
        assert_eq!(begin(&disk).1, later(6));
    }

    #[test]
    fn only_a_checkpoint_of_the_same_mission_continues_the_epoch() {
        let disk = Disk::default();
        let (mut keeper, durable) = begin(&disk);
        let last = Durable { epoch: 4, labels: 7, ..durable };
        assert!(keeper.save(&last));
        let run = |checkpoint| {
            let run = Keeper::begin_run(disk.clone(), 1, Some(checkpoint), &free());
            assert!(run.is_again);
            run.durable
        };
        assert_eq!(run((9, 4)), last);
        assert_eq!(run((9, 3)), Durable { epoch: 5, labels: 0, ..last.clone() });
        assert_eq!(run((8, 5)).epoch, 6, "another mission");
        let fresh = Keeper::begin_run(Disk::default(), 2, Some((9, 4)), &free());
        assert_eq!((fresh.durable.lineage, fresh.durable.epoch, fresh.is_again), (2, 0, false));
    }

    #[test]
    fn the_bytes_of_a_state_are_those_of_this_version_of_the_file() {
        let versions = [None, Some(300), None, None, None, Some(1), None, None, None, Some(2)];
        let record = |series| SeriesRecord {
            series: Series::from_random(series),
            versions,
            decisions: [0, 1, 0, 0, 0, 2, 0, 0, 0, 1],
        };
        let inbox = SlotInboxState { records: [5, 7].map(record).into() };
        let utility = Some((3, 50, -1, [(2, -3)].into()));
        let durable = Durable {
            inbox,
            epoch: 3,
            labels: 12,
            lineage: 300,
            utility: KeptUtility { order: utility, weighed: 12 },
            hold: true,
            budget: KeptBudget {
                bits_per_s: Some(500),
                shares: Some([10, 5, 5, 50, 20]),
                background: Some(vec![0x14, 0x40]),
            },
            abort: false,
            settings: vec![0x40, 0],
            limits: KeptLimits { order: vec![0, 4], used: (130, 2), breach: 2 },
            fence: vec![0],
            place: None,
            lost: LostOrders::Of(Series::from_random(300)),
            goals: KeptGoals { destination: Some((-3, 100)), areas: vec![0] },
            keys: KeptKeys::default(),
        };
        let golden = [
            &[2, 5, 0, 1, 172, 2, 0, 0, 0, 1, 1, 0, 0, 0, 1, 2][..],
            &[0, 1, 0, 0, 0, 2, 0, 0, 0, 1],
            &[7, 0, 1, 172, 2, 0, 0, 0, 1, 1, 0, 0, 0, 1, 2],
            &[0, 1, 0, 0, 0, 2, 0, 0, 0, 1],
            &[3, 12, 172, 2],
            &[1, 3, 50, 255, 1, 2, 253, 12, 1, 0, 1, 244, 3, 1, 10, 5, 5, 50, 20, 1, 2, 0x14, 0x40],
            &[2, 0x40, 0, 2, 0, 4, 130, 1, 2, 2, 1, 0, 0, 2, 172, 2],
            &[1, 5, 200, 1, 1, 0],
            &[0, 0, 0],
        ];
        assert_eq!(postcard::to_allocvec(&durable).unwrap(), golden.concat());
        assert_eq!(decode(&golden.concat()), Some(durable));
    }

    #[test]
    fn a_vehicle_without_its_journal_holds_and_has_lost_its_orders() {
        let lost = |disk: &Disk| {
            let run = Keeper::begin_run(disk.clone(), 9 << 56, None, &free());
            assert!(run.is_again && run.is_stored);
            let expected = Durable { lineage: 9 << 56, epoch: 9, hold: true, ..Durable::default() };
            assert_eq!(run.durable, Durable { lost: LostOrders::Present, ..expected });
            let again = Keeper::begin_run(disk.clone(), 1, None, &free()).durable;
            assert!(again.hold && again.lost == LostOrders::Present, "a restart changes neither");
        };
        for content in [&b""[..], b"scVJRN99", &[7; 5000]] {
            let disk = Disk::default();
            disk.put("vehicle.journal", content);
            lost(&disk);
        }
        let disk = Disk::default();
        disk.put("scene.checkpoint", b"any");
        lost(&disk);
    }

    #[test]
    fn a_lost_journal_costs_the_orders_and_not_the_learnt_map() {
        let disk = Disk::default();
        let (mut keeper, durable) = begin(&disk);
        assert!(keeper.save(&Durable { epoch: 250, lineage: 77, budget: bits_per_s(500), ..durable }));
        for name in NAMES {
            let mut bytes = disk.read(name).unwrap().unwrap();
            bytes[40] ^= 1;
            disk.put(name, &bytes);
        }
        let run = Keeper::begin_run(disk, 9 << 56, Some((77, 250)), &free()).durable;
        let expected = Durable { lineage: 77, epoch: 67, hold: true, lost: LostOrders::Present, ..Durable::default() };
        assert_eq!(run, expected, "the mapper of this lineage resumes, in an epoch of its own");
    }

    /// The bytes of both files after each of `count` states, the last of which does not hold.
    fn files_after_states(disk: &Disk, count: u32) -> (Vec<[Vec<u8>; 2]>, Durable) {
        let (mut keeper, durable) = begin(disk);
        let state = |number| Durable { budget: bits_per_s(number), hold: number % 3 == 1, ..durable.clone() };
        let mut files = Vec::new();
        for number in 0..count {
            assert!(keeper.save(&state(number)));
            files.push(NAMES.map(|name| disk.read(name).unwrap().unwrap()));
        }
        (files, state(count - 1))
    }

    #[test]
    fn no_cut_or_shift_of_the_journal_restarts_an_older_state() {
        let disk = Disk::default();
        let (files, last) = files_after_states(&disk, 37);
        assert!(!last.hold);
        let whole = files.last().unwrap();
        // Among them each place at which a file ended after one of the states.
        let cut = |bytes: &[u8], at: usize| bytes[..at.min(bytes.len())].to_vec();
        let left = |bytes: &[u8], by: usize| bytes[by.min(bytes.len())..].to_vec();
        let shifted = |bytes: &[u8], by: usize| [&bytes[by..], &vec![0; by]].concat();
        let longest = whole.iter().map(Vec::len).max().unwrap();
        let borders = files.iter().flatten().map(Vec::len).filter(|&border| border < longest);
        for at in (1..600).chain((600..longest).step_by(97)).chain(borders) {
            for damaged in [&cut as &dyn Fn(&[u8], usize) -> Vec<u8>, &left, &shifted] {
                let pair = [damaged(&whole[0], at), damaged(&whole[1], at)];
                NAMES.iter().zip(&pair).for_each(|(name, bytes)| disk.put(name, bytes));
                let run = begin(&disk).1;
                assert!(
                    run.hold && run.lost == LostOrders::Present && run.budget.bits_per_s.is_none(),
                    "{at}: {run:?}"
                );
                for number in [0, 1] {
                    disk.put(NAMES[number], &pair[number]);
                    disk.put(NAMES[1 - number], &whole[1 - number]);
                    let run = begin(&disk).1;
                    assert_eq!(
                        (run.budget.bits_per_s, run.lost),
                        (last.budget.bits_per_s, last.lost),
                        "{at}: an older state"
                    );
                }
            }
        }
    }

    #[test]
    fn one_damaged_copy_leaves_the_state_and_the_vehicle_holds() {
        for name in ["vehicle.journal", "vehicle.journal.copy"] {
            let disk = Disk::default();
            let (mut keeper, durable) = begin(&disk);
            let last = Durable {
                budget: bits_per_s(500),
                limits: KeptLimits { breach: 2, ..KeptLimits::default() },
                ..durable
            };
            assert!(keeper.save(&last));
            disk.remove(name);
            assert_eq!(begin(&disk).1, Durable { epoch: 1, hold: true, ..last.clone() });
            assert_eq!(begin(&disk).1, Durable { epoch: 2, hold: true, ..last });
        }
    }

    #[test]
    fn a_run_on_a_disk_that_refuses_its_state_holds() {
        for refusal in [DiskRefusal::Full, DiskRefusal::ReadOnly] {
            let disk = Disk::default();
            disk.refuse(refusal);
            let run = Keeper::begin_run(disk.clone(), 9, None, &free());
            assert!(run.durable.hold && !run.is_stored && !run.is_again);
        }
        let disk = Disk::default();
        let last = begin(&disk).1;
        disk.refuse(DiskRefusal::Full);
        assert_eq!(begin(&disk).1, Durable { epoch: 1, ..last.clone() }, "the files have their full length");
        disk.refuse(DiskRefusal::ReadOnly);
        assert_eq!(begin(&disk).1, Durable { epoch: 2, hold: true, ..last });
    }

    #[test]
    fn a_vehicle_without_state_holds_unless_fenced_or_free() {
        let corner = |x, y| DecimetrePoint::new(x, y);
        let outline = Polygon(vec![corner(0, 0), corner(90, 0), corner(90, 90)]);
        let fence = Fence { fence: Some(outline), ..Fence::default() };
        let begun = |first: &FirstStart| Keeper::begin_run(Disk::default(), 9, None, first).durable;
        assert!(begun(&FirstStart::default()).hold);
        assert!(!begun(&free()).hold);
        let fenced = FirstStart { is_free: true, fence: Some(fence.clone()) };
        assert_eq!(begun(&fenced), Durable { lineage: 9, fence: fence.to_bytes(), ..Durable::default() });
        let disk = Disk::default();
        disk.put("vehicle.journal", b"damaged");
        let damaged = Keeper::begin_run(disk, 9, None, &fenced).durable;
        assert!(damaged.hold && damaged.fence == fence.to_bytes(), "what else it was ordered is not known");
    }

    #[test]
    fn a_disk_is_checked_at_intervals_and_after_a_checkpoint() {
        let (mut disk, now) = (DiskWatch::new(&std::env::temp_dir()), Instant::now());
        let first = disk.look(now).unwrap();
        assert!(first.free_bytes.is_some() == cfg!(unix) && !first.is_checkpoint_refused);
        assert_eq!(disk.look(now + LOOK_INTERVAL / 2), None);
        disk.handle_checkpoint(Checkpoint::Labels, true);
        disk.handle_checkpoint(Checkpoint::SceneModel, false);
        assert!(disk.look(now + LOOK_INTERVAL / 2).unwrap().is_checkpoint_refused);
        assert!(disk.look(now + LOOK_INTERVAL).is_none());
        assert!(disk.look(now + LOOK_INTERVAL * 2).is_some());
        let missing = DiskWatch::new(Path::new("/no such folder")).look(now).unwrap();
        assert_eq!((missing.free_bytes, missing.is_checkpoint_refused), (None, true));
    }
}
