//! The free space of a disk, and the state of the vehicle's disk for its reports.

use scenecast_vehicle::VehicleDisk;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

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
    /// `None` if a look is due at once.
    looked: Option<Instant>,
}

impl DiskWatch {
    pub(super) fn new(dir: &Path) -> Self {
        Self { dir: dir.to_owned(), refused: [false; 2], looked: None }
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
        let is_checkpoint_refused = self.refused.contains(&true);
        Some(VehicleDisk { free_bytes: free_bytes(&self.dir), is_checkpoint_refused })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
        assert_eq!(missing.free_bytes, None);
    }
}
