//! Files in memory, the damage to them, and the scripts that choose it.

use super::journal::Storage;
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::io;
use std::path::PathBuf;
use std::rc::Rc;

/// Files in memory; clones share them.
#[derive(Clone, Default)]
pub struct Files(pub Rc<RefCell<BTreeMap<String, File>>>);

pub type File = Rc<RefCell<Vec<u8>>>;

impl Storage for Files {
    type File = File;

    fn path(&self, name: &str) -> PathBuf {
        name.into()
    }

    fn read(&self, name: &str) -> io::Result<Option<Vec<u8>>> {
        Ok(self.0.borrow().get(name).map(|file| file.borrow().clone()))
    }

    fn create(&mut self, name: &str) -> io::Result<File> {
        let file = File::default();
        self.0.borrow_mut().insert(name.to_owned(), file.clone());
        Ok(file)
    }

    fn open(&mut self, name: &str, bytes: usize) -> io::Result<Option<File>> {
        Ok(self.0.borrow().get(name).filter(|file| file.borrow().len() == bytes).cloned())
    }

    fn overwrite(&mut self, _name: &str, file: &mut File, bytes: &[u8]) -> io::Result<()> {
        let mut content = file.borrow_mut();
        let end = bytes.len().min(content.len());
        content.splice(..end, bytes.iter().copied());
        Ok(())
    }

    fn append(&mut self, _name: &str, file: &mut File, bytes: &[u8]) -> io::Result<()> {
        file.borrow_mut().extend_from_slice(bytes);
        Ok(())
    }

    fn sync(&mut self, _file: &mut File) -> io::Result<()> {
        Ok(())
    }

    fn rename(&mut self, from: &str, to: &str) -> io::Result<()> {
        let file = self.0.borrow_mut().remove(from).ok_or(io::ErrorKind::NotFound)?;
        self.0.borrow_mut().insert(to.to_owned(), file);
        Ok(())
    }

    fn list(&self) -> io::Result<Vec<String>> {
        Ok(self.0.borrow().keys().cloned().collect())
    }

    fn sync_folder(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Bytes as the arguments of a script; zeros after its end.
pub struct Script<'a>(pub &'a [u8]);

impl<'a> Script<'a> {
    pub fn u8(&mut self) -> u8 {
        let (first, rest) = self.0.split_first().unwrap_or((&0, &[]));
        self.0 = rest;
        *first
    }

    pub fn u16(&mut self) -> usize {
        usize::from(self.u8()) << 8 | usize::from(self.u8())
    }

    pub fn bytes(&mut self) -> &'a [u8] {
        let wanted = usize::from(self.u8());
        let (bytes, rest) = self.0.split_at(wanted.min(self.0.len()));
        self.0 = rest;
        bytes
    }
}

/// The damage that a script does to one file.
pub struct Damaged<'a> {
    pub files: &'a Files,
    pub name: &'static str,
}

impl Damaged<'_> {
    /// Changes a file that exists, up to 64 kB.
    pub fn change(&self, change: impl FnOnce(&mut Vec<u8>)) {
        if let Some(file) = self.files.0.borrow().get(self.name) {
            let mut bytes = file.borrow_mut();
            change(&mut bytes);
            bytes.truncate(1 << 16);
        }
    }

    /// Does what a broken disk or a person may do: no record is written that has a valid checksum of its own.
    pub fn damage(&self, action: u8, script: &mut Script<'_>) {
        let at = script.u16();
        match action {
            0 => self.change(|file| file.truncate(at)),
            1 => self.change(|file| drop(file.drain(..at.min(file.len())))),
            2 => self.change(|file| file.splice(..0, vec![0; at]).for_each(drop)),
            3 => {
                let bytes = script.bytes();
                self.change(|file| file.iter_mut().skip(at).zip(bytes).for_each(|(byte, xor)| *byte ^= xor));
            }
            4 => self.change(|file| file.extend(vec![at as u8; at])),
            _ => self.change(|file| file.iter_mut().skip(at).for_each(|byte| *byte = 0)),
        }
    }
}
