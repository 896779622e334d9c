//! The operations that the journal needs of a file system.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

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

    /// Appends bytes to a file; they are durable after [`Storage::sync`].
    fn append(&mut self, file: &mut Self::File, bytes: &[u8]) -> io::Result<()>;

    /// Makes the content of a file durable.
    fn sync(&mut self, file: &mut Self::File) -> io::Result<()>;

    /// Renames a file and replaces one of the new name.
    fn rename(&mut self, from: &str, to: &str) -> io::Result<()>;

    /// The names of the files.
    fn list(&self) -> io::Result<Vec<String>>;

    /// Makes the names in the folder durable.
    fn sync_folder(&mut self) -> io::Result<()>;
}

/// A folder of the machine's file system, held by one process.
pub(crate) struct Folder {
    path: PathBuf,
    handle: File,
}

impl Folder {
    /// Opens the folder and creates it if necessary; an error if another process holds it.
    pub(crate) fn hold(path: &Path) -> io::Result<Self> {
        create_folder(path)?;
        let handle = File::open(path)?;
        match handle.try_lock() {
            Err(TryLockError::WouldBlock) => Err(io::Error::new(ErrorKind::ResourceBusy, HELD)),
            // On a file system without locks the folder is not protected.
            Err(TryLockError::Error(e)) if e.kind() != ErrorKind::Unsupported => Err(e),
            _ => Ok(Self { path: path.to_owned(), handle }),
        }
    }
}

impl Folder {
    /// The same folder for another owner; it stays locked until both are dropped.
    pub(crate) fn share(&self) -> io::Result<Self> {
        Ok(Self { path: self.path.clone(), handle: self.handle.try_clone()? })
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

    fn create(&mut self, name: &str) -> io::Result<File> {
        OpenOptions::new().write(true).create(true).truncate(true).open(self.path(name))
    }

    fn append(&mut self, file: &mut File, bytes: &[u8]) -> io::Result<()> {
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
        self.handle.sync_all()
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Journal, record};
    use super::*;

    const NAME: &str = "test.journal";

    fn scratch(name: &str) -> PathBuf {
        let path = std::env::temp_dir().join(format!("scenecast-{}-{name}", std::process::id()));
        let _ = fs::remove_dir_all(&path);
        path
    }

    fn open(path: &Path) -> (Journal<Folder>, Option<Vec<u8>>) {
        Journal::open(Folder::hold(path).unwrap(), NAME, 4 * record::BLOCK).unwrap()
    }

    #[test]
    fn a_journal_in_a_new_folder_is_read_without_its_torn_end() {
        let path = scratch("journal").join("a/b");
        let (mut journal, found) = open(&path);
        assert_eq!(found, None);
        (0..10u8).for_each(|n| journal.persist(&[n]).unwrap());
        drop(journal);
        let file = path.join(NAME);
        let whole = fs::read(&file).unwrap();
        fs::write(&file, [&whole[..], &record::encode(11, b"torn")[..20]].concat()).unwrap();
        fs::write(path.join("test.journal.part"), "left by a power cut").unwrap();
        let (mut journal, found) = open(&path);
        assert_eq!(found, Some(vec![9]));
        journal.persist(&[10]).unwrap();
        assert_eq!(fs::read(&file).unwrap(), record::encode(11, &[10]), "a run begins a new file");
        assert_eq!(fs::read_dir(&path).unwrap().count(), 1);
    }

    #[test]
    fn a_folder_is_held_by_one_process() {
        let path = scratch("held");
        let first = Folder::hold(&path).unwrap();
        assert_eq!(Folder::hold(&path).err().unwrap().to_string(), HELD);
        drop(first);
        assert!(Folder::hold(&path).is_ok());
    }
}
