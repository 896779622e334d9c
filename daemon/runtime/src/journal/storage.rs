//! The operations that the journal needs of a file system.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, ErrorKind, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

/// A folder under power cuts: content is durable after [`Storage::sync`], names are after [`Storage::sync_folder`].
pub(crate) trait Storage {
    /// A file open for appending; a rename does not close it.
    type File;

    /// Path of a file, for messages.
    fn path(&self, name: &str) -> PathBuf;

    /// The content of a file; `None` if no file has this name.
    fn read(&self, name: &str) -> io::Result<Option<Vec<u8>>>;

    /// Creates an empty file, which replaces one of the same name.
    fn create(&mut self, name: &str) -> io::Result<Self::File>;

    /// Opens a file of exactly this length for [`Storage::overwrite`]; `None` if there is none.
    fn open(&mut self, name: &str, bytes: usize) -> io::Result<Option<Self::File>>;

    /// Writes over the beginning of a file; the bytes are durable after [`Storage::sync`].
    ///
    /// # Errors
    /// One of them is a file that no longer has its name, because it would be gone after a restart.
    fn overwrite(&mut self, name: &str, file: &mut Self::File, bytes: &[u8]) -> io::Result<()>;

    /// Appends bytes to a file; they are durable after [`Storage::sync`].
    ///
    /// # Errors
    /// As those of [`Storage::overwrite`], also for no bytes.
    fn append(&mut self, name: &str, file: &mut Self::File, bytes: &[u8]) -> io::Result<()>;

    /// Makes the content of a file durable.
    fn sync(&mut self, file: &mut Self::File) -> io::Result<()>;

    /// Renames a file and replaces one of the new name.
    fn rename(&mut self, from: &str, to: &str) -> io::Result<()>;

    /// The names of the files.
    #[cfg_attr(not(feature = "surface"), allow(dead_code, reason = "vehicles have no archive"))]
    fn list(&self) -> io::Result<Vec<String>>;

    /// Makes the names in the folder durable.
    fn sync_folder(&mut self) -> io::Result<()>;
}

/// Writes a file beside the one of this name, and puts it in its place. An error frees the space of the unfinished file.
pub(crate) fn write_whole<S: Storage>(storage: &mut S, name: &str, bytes: &[u8]) -> io::Result<S::File> {
    let part = format!("{name}.part");
    let written = storage.create(&part).and_then(|mut file| {
        storage.append(&part, &mut file, bytes)?;
        storage.sync(&mut file)?;
        storage.rename(&part, name)?;
        Ok(file)
    });
    match written {
        Ok(file) => storage.sync_folder().map(|()| file),
        Err(e) => {
            // An unfinished file could be all that fills the disk.
            let _ = storage.create(&part);
            Err(e)
        }
    }
}

/// A folder of the machine's file system, held by one process. Clones share the lock.
#[derive(Clone)]
pub(crate) struct Folder {
    path: PathBuf,
    /// `None` while the folder does not exist.
    handle: Arc<Mutex<Option<File>>>,
}

impl Folder {
    /// Opens the folder and creates it if necessary; an error if another process holds it.
    pub(crate) fn hold(path: &Path) -> io::Result<Self> {
        let handle = Arc::new(Mutex::new(Some(lock(path)?)));
        warn_if_open(path);
        Ok(Self { path: path.to_owned(), handle })
    }

    /// Like [`Self::hold`], but a folder that cannot be opened or created is no error: every write tries it again.
    pub(crate) fn hold_when_there(path: &Path) -> io::Result<Self> {
        match Self::hold(path) {
            Err(e) if e.kind() != ErrorKind::ResourceBusy => {
                tracing::error!("{}: {e}", path.display());
                Ok(Self { path: path.to_owned(), handle: Arc::default() })
            }
            held => held,
        }
    }

    /// Creates and holds the folder if it was removed or was never there.
    fn restore(&self) -> io::Result<()> {
        let mut handle = self.handle.lock().unwrap_or_else(PoisonError::into_inner);
        if handle.is_none() || !self.path.is_dir() {
            *handle = Some(lock(&self.path)?);
        }
        Ok(())
    }
}

/// A folder that was there before may admit others. Its mode stays: it may be a common folder, or that of a group on purpose.
#[cfg(unix)]
fn warn_if_open(path: &Path) {
    use std::os::unix::fs::MetadataExt;
    let mode = fs::metadata(path).map_or(0, |folder| folder.mode() & 0o777);
    if mode & 0o077 != 0 {
        let path = path.display();
        tracing::warn!(
            "other users of this computer can list {path} (mode {mode:03o}): chmod 700 {path} keeps them out"
        );
    }
}

#[cfg(not(unix))]
fn warn_if_open(_path: &Path) {}

fn lock(path: &Path) -> io::Result<File> {
    create_folder(path)?;
    let handle = File::open(if path.as_os_str().is_empty() { Path::new(".") } else { path })?;
    match handle.try_lock() {
        Err(TryLockError::WouldBlock) => Err(io::Error::new(ErrorKind::ResourceBusy, HELD)),
        // On a file system without locks the folder is not protected.
        Err(TryLockError::Error(e)) if e.kind() != ErrorKind::Unsupported => Err(e),
        _ => Ok(handle),
    }
}

/// Whether `file` is the one of this path: a removed file still takes bytes, which are gone after a restart.
#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> io::Result<bool> {
    use std::os::unix::fs::MetadataExt;
    let (open, named) = (file.metadata()?, fs::metadata(path)?);
    Ok((open.dev(), open.ino()) == (named.dev(), named.ino()))
}

#[cfg(not(unix))]
fn is_at(_file: &File, path: &Path) -> io::Result<bool> {
    path.try_exists()
}

/// The error is for a file that no longer has its name.
fn require_name(file: &File, path: &Path) -> io::Result<()> {
    if is_at(file, path)? {
        Ok(())
    } else {
        Err(io::Error::new(ErrorKind::NotFound, "the file was removed or replaced"))
    }
}

const HELD: &str = "another process keeps its state there; stop it, or set another runtime.state_dir";

/// Creates a folder and its parents, and syncs the parent of each new one so that its name is durable.
fn create_folder(path: &Path) -> io::Result<()> {
    if path.as_os_str().is_empty() || path.is_dir() {
        return Ok(());
    }
    let above = path.parent().unwrap_or(Path::new(""));
    create_folder(above)?;
    match fs::create_dir(path) {
        Err(e) if e.kind() != ErrorKind::AlreadyExists || !path.is_dir() => Err(e),
        _ => scenecast_files::sync_folder(above),
    }
}

impl Storage for Folder {
    type File = File;

    fn path(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    fn read(&self, name: &str) -> io::Result<Option<Vec<u8>>> {
        match fs::read(self.path(name)) {
            Ok(bytes) => Ok(Some(bytes)),
            Err(e) if e.kind() == ErrorKind::NotFound => Ok(None),
            Err(e) => Err(e),
        }
    }

    fn open(&mut self, name: &str, bytes: usize) -> io::Result<Option<File>> {
        let file = match OpenOptions::new().write(true).open(self.path(name)) {
            Err(e) if e.kind() == ErrorKind::NotFound => return Ok(None),
            opened => opened?,
        };
        let has_length = file.metadata()?.len() == bytes as u64;
        Ok(has_length.then_some(file))
    }

    fn overwrite(&mut self, name: &str, file: &mut File, bytes: &[u8]) -> io::Result<()> {
        require_name(file, &self.path(name))?;
        file.seek(SeekFrom::Start(0))?;
        file.write_all(bytes)
    }

    fn create(&mut self, name: &str) -> io::Result<File> {
        self.restore()?;
        OpenOptions::new().write(true).create(true).truncate(true).open(self.path(name))
    }

    fn append(&mut self, name: &str, file: &mut File, bytes: &[u8]) -> io::Result<()> {
        require_name(file, &self.path(name))?;
        file.write_all(bytes)
    }

    fn sync(&mut self, file: &mut File) -> io::Result<()> {
        file.sync_all()
    }

    fn rename(&mut self, from: &str, to: &str) -> io::Result<()> {
        fs::rename(self.path(from), self.path(to))
    }

    fn list(&self) -> io::Result<Vec<String>> {
        let names = fs::read_dir(&self.path)?.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
        Ok(names.collect())
    }

    fn sync_folder(&mut self) -> io::Result<()> {
        scenecast_files::sync_folder(&self.path)
    }
}

#[cfg(test)]
mod tests {
    use super::super::record::FILE_BYTES;
    use super::super::{Found, Journal, JournalNames};
    use super::*;

    const NAMES: JournalNames = JournalNames { journal: "test.journal", copy: "test.journal.copy" };

    fn scratch(name: &str) -> PathBuf {
        let path = std::env::temp_dir().join(format!("scenecast-{}-{name}", std::process::id()));
        let _ = fs::remove_dir_all(&path);
        path
    }

    fn open(path: &Path) -> (Journal<Folder>, Found) {
        Journal::open(Folder::hold(path).unwrap(), NAMES)
    }

    fn state(body: &[u8]) -> Found {
        Found::State { body: body.to_vec(), damage: None }
    }

    #[test]
    fn a_journal_in_a_new_folder_is_read_without_its_torn_end() {
        let path = scratch("journal").join("a/b");
        let (mut journal, found) = open(&path);
        assert_eq!(found, Found::Absent);
        (0..10u8).for_each(|n| journal.persist(&[n]).unwrap());
        drop(journal);
        let file = path.join(NAMES.copy);
        let mut torn = fs::read(&file).unwrap();
        torn[..512].fill(0);
        fs::write(&file, torn).unwrap();
        fs::write(path.join("test.journal.part"), "left by a power cut").unwrap();
        let (mut journal, found) = open(&path);
        assert_eq!(found, state(&[9]));
        journal.persist(&[10]).unwrap();
        drop(journal);
        assert_eq!(open(&path).1, state(&[10]));
        for name in [NAMES.journal, NAMES.copy] {
            assert_eq!(fs::metadata(path.join(name)).unwrap().len(), FILE_BYTES as u64);
        }
    }

    #[test]
    fn a_removed_folder_refuses_one_record_and_takes_the_next() {
        let path = scratch("removed");
        let (mut journal, _) = open(&path);
        journal.persist(b"first").unwrap();
        fs::remove_dir_all(&path).unwrap();
        let refused = journal.persist(b"second").unwrap_err().to_string();
        assert!(refused.starts_with("writing: "), "{refused}");
        journal.persist(b"third").unwrap();
        drop(journal);
        assert_eq!(open(&path).1, state(b"third"));
    }

    #[test]
    fn a_folder_is_held_by_one_process() {
        let path = scratch("held");
        let first = Folder::hold(&path).unwrap();
        assert_eq!(Folder::hold(&path).err().unwrap().to_string(), HELD);
        assert_eq!(Folder::hold_when_there(&path).err().unwrap().to_string(), HELD);
        drop(first);
        assert!(Folder::hold(&path).is_ok());
    }
}
