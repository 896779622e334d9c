//! A disk with a page cache, and power cuts.

use super::storage::Storage;
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::io::{Error, Result};
use std::path::PathBuf;
use std::rc::Rc;

/// Bytes that the disk writes atomically; smaller than a block, so that the parts of a record may
/// be written in any order.
const SECTOR: usize = 512;

/// Random choices of the simulated disk.
pub(crate) struct DiskRng(u64);

impl DiskRng {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed)
    }

    pub(crate) fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((self.0 >> 33) as usize) % n.max(1)
    }
}

/// A step of the file system or of its host.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum DiskStep {
    Create,
    Append,
    Overwrite,
    Sync,
    Rename,
    SyncFolder,
    /// An action of the host outside the disk.
    Host,
}

/// The lasting refusal of a disk.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum DiskRefusal {
    #[default]
    None,
    /// It takes no more bytes; those of a file can be overwritten.
    Full,
    ReadOnly,
}

#[derive(Debug, Clone, Default)]
struct Content {
    /// The bytes at the last sync.
    synced: Vec<u8>,
    bytes: Vec<u8>,
}

#[derive(Debug, Default)]
struct Platter {
    contents: Vec<Content>,
    /// The names after each change since the folder was last synced.
    names: Vec<BTreeMap<String, usize>>,
    steps: Vec<DiskStep>,
    cut_at: Option<usize>,
    failing: Option<DiskStep>,
    refusal: DiskRefusal,
}

/// A simulated disk; clones share it.
#[derive(Debug, Clone, Default)]
pub(crate) struct Disk(Rc<RefCell<Platter>>);

impl Disk {
    /// Cuts the power after this many further steps.
    pub(crate) fn cut_after(&self, steps: usize) {
        let mut platter = self.0.borrow_mut();
        platter.cut_at = Some(platter.steps.len() + steps);
    }

    /// Whether the power is cut.
    pub(crate) fn is_off(&self) -> bool {
        let platter = self.0.borrow();
        platter.cut_at == Some(platter.steps.len())
    }

    pub(crate) fn steps(&self) -> Vec<DiskStep> {
        self.0.borrow().steps.clone()
    }

    /// Steps of this kind fail from now on.
    pub(crate) fn fail(&self, step: Option<DiskStep>) {
        self.0.borrow_mut().failing = step;
    }

    /// The disk refuses writes from now on, or takes them again.
    pub(crate) fn refuse(&self, refusal: DiskRefusal) {
        self.0.borrow_mut().refusal = refusal;
    }

    /// Removes a file, without a step of the disk.
    pub(crate) fn remove(&self, name: &str) {
        let mut platter = self.0.borrow_mut();
        let mut names = platter.names.last().cloned().unwrap_or_default();
        names.remove(name);
        platter.names = vec![names];
    }

    /// Counts a step; an error if the power is cut.
    pub(crate) fn step(&self, step: DiskStep) -> Result<()> {
        if self.is_off() {
            return Err(Error::other("the power is gone"));
        }
        let mut platter = self.0.borrow_mut();
        platter.steps.push(step);
        let is_full = platter.refusal == DiskRefusal::Full && matches!(step, DiskStep::Create | DiskStep::Append);
        if is_full {
            return Err(Error::other("no space left on device"));
        }
        if platter.refusal == DiskRefusal::ReadOnly && step != DiskStep::Host {
            return Err(Error::other("read-only file system"));
        }
        if platter.failing == Some(step) { Err(Error::other("input/output error")) } else { Ok(()) }
    }

    /// The power comes back; `rng` chooses which of the unsynced bytes are on the disk.
    pub(crate) fn power_cut(&self, mut rng: DiskRng) {
        let mut platter = self.0.borrow_mut();
        platter.cut_at = None;
        if !platter.names.is_empty() {
            let kept = rng.below(platter.names.len());
            let kept = platter.names[kept].clone();
            platter.names = vec![kept];
        }
        let before = platter.contents.clone();
        for (at, content) in platter.contents.iter_mut().enumerate() {
            let older = at.checked_sub(1).map_or(&[][..], |i| &before[i].bytes);
            content.survive(older, &mut rng);
        }
    }

    /// Writes a file directly, without the journal.
    pub(crate) fn put(&self, name: &str, bytes: &[u8]) {
        let mut platter = self.0.borrow_mut();
        platter.contents.push(Content { synced: bytes.to_vec(), bytes: bytes.to_vec() });
        let at = platter.contents.len() - 1;
        let mut names = platter.names.last().cloned().unwrap_or_default();
        names.insert(name.to_owned(), at);
        platter.names = vec![names];
    }
}

impl Content {
    /// Each unsynced sector is written, half written, zero, or holds bytes of an older file; one that was overwritten
    /// may hold its old bytes.
    fn survive(&mut self, older: &[u8], rng: &mut DiskRng) {
        let appended = self.bytes.len().saturating_sub(self.synced.len());
        self.bytes.truncate(self.synced.len() + [0, rng.below(appended + 1), appended][rng.below(3)]);
        let mut from = 0;
        while from < self.bytes.len() {
            let to = (from + 1).next_multiple_of(SECTOR).min(self.bytes.len());
            let sector = &mut self.bytes[from..to];
            if self.synced.get(from..to) == Some(&*sector) {
                from = to;
                continue;
            }
            let old = |at: usize| self.synced.get(at).or(older.get(at)).copied().unwrap_or(0);
            match rng.below(6) {
                0 => sector.fill(0),
                1 | 2 => sector.iter_mut().enumerate().for_each(|(i, b)| *b = old(from + i)),
                3 => {
                    let half = rng.below(to - from);
                    (half..to - from).for_each(|i| sector[i] = old(from + i));
                }
                _ => {}
            }
            from = to;
        }
        self.synced.clone_from(&self.bytes);
    }
}

impl Storage for Disk {
    type File = usize;

    fn path(&self, name: &str) -> PathBuf {
        name.into()
    }

    fn read(&self, name: &str) -> Result<Option<Vec<u8>>> {
        let platter = self.0.borrow();
        let at = platter.names.last().and_then(|names| names.get(name));
        Ok(at.map(|&at| platter.contents[at].bytes.clone()))
    }

    fn open(&mut self, name: &str, bytes: usize) -> Result<Option<usize>> {
        let platter = self.0.borrow();
        let at = platter.names.last().and_then(|names| names.get(name)).copied();
        Ok(at.filter(|&at| platter.contents[at].bytes.len() == bytes))
    }

    fn overwrite(&mut self, name: &str, file: &mut usize, bytes: &[u8]) -> Result<()> {
        {
            let mut platter = self.0.borrow_mut();
            platter.require_name(name, *file)?;
            // A write that is cut off may have written some bytes; a refused one has not.
            if platter.refusal != DiskRefusal::ReadOnly {
                platter.contents[*file].bytes[..bytes.len()].copy_from_slice(bytes);
            }
        }
        self.step(DiskStep::Overwrite)
    }

    fn create(&mut self, name: &str) -> Result<usize> {
        self.step(DiskStep::Create)?;
        let mut platter = self.0.borrow_mut();
        platter.contents.push(Content::default());
        let at = platter.contents.len() - 1;
        let mut names = platter.change_names();
        names.insert(name.to_owned(), at);
        platter.names.push(names);
        Ok(at)
    }

    fn append(&mut self, name: &str, file: &mut usize, bytes: &[u8]) -> Result<()> {
        self.0.borrow().require_name(name, *file)?;
        if bytes.is_empty() {
            return Ok(());
        }
        // A write that fails or is cut off may have written some bytes.
        self.0.borrow_mut().contents[*file].bytes.extend_from_slice(bytes);
        self.step(DiskStep::Append)
    }

    fn sync(&mut self, file: &mut usize) -> Result<()> {
        self.step(DiskStep::Sync)?;
        let content = &mut self.0.borrow_mut().contents[*file];
        content.synced = content.bytes.clone();
        Ok(())
    }

    fn rename(&mut self, from: &str, to: &str) -> Result<()> {
        self.step(DiskStep::Rename)?;
        let mut platter = self.0.borrow_mut();
        let mut names = platter.change_names();
        let at = names.remove(from).ok_or_else(|| Error::other("no such file"))?;
        names.insert(to.to_owned(), at);
        platter.names.push(names);
        Ok(())
    }

    fn list(&self) -> Result<Vec<String>> {
        Ok(self.0.borrow().names.last().into_iter().flat_map(BTreeMap::keys).cloned().collect())
    }

    fn sync_folder(&mut self) -> Result<()> {
        self.step(DiskStep::SyncFolder)?;
        let mut platter = self.0.borrow_mut();
        let last = platter.names.pop();
        platter.names = last.into_iter().collect();
        Ok(())
    }
}

impl Platter {
    fn require_name(&self, name: &str, file: usize) -> Result<()> {
        let is_named = self.names.last().and_then(|names| names.get(name)) == Some(&file);
        if is_named { Ok(()) } else { Err(Error::other("the file was removed")) }
    }

    fn change_names(&mut self) -> BTreeMap<String, usize> {
        if self.names.is_empty() {
            self.names.push(BTreeMap::new());
        }
        self.names[self.names.len() - 1].clone()
    }
}
