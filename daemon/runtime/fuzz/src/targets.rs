//! Properties for any bytes: plain functions, run by libFuzzer and by the ordinary tests alike.

use super::journal::{Found, Journal, JournalNames, Storage};
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::io;
use std::path::PathBuf;
use std::rc::Rc;

const NAMES: JournalNames = JournalNames { journal: "state", copy: "state.copy" };
const MAGICS: [&[u8; 8]; 3] = [b"scVJRN03", b"scVJRN02", b"scVJRN04"];
static CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISCSI);

/// Files in memory; clones share them.
#[derive(Clone, Default)]
struct Files(Rc<RefCell<BTreeMap<String, File>>>);

type File = Rc<RefCell<Vec<u8>>>;

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
struct Script<'a>(&'a [u8]);

impl<'a> Script<'a> {
    fn u8(&mut self) -> u8 {
        let (first, rest) = self.0.split_first().unwrap_or((&0, &[]));
        self.0 = rest;
        *first
    }

    fn u16(&mut self) -> usize {
        usize::from(self.u8()) << 8 | usize::from(self.u8())
    }

    fn bytes(&mut self) -> &'a [u8] {
        let wanted = usize::from(self.u8());
        let (bytes, rest) = self.0.split_at(wanted.min(self.0.len()));
        self.0 = rest;
        bytes
    }
}

/// The damage that a script does to one file of a journal.
struct Damaged<'a> {
    files: &'a Files,
    name: &'static str,
}

impl Damaged<'_> {
    fn change(&self, change: impl FnOnce(&mut Vec<u8>)) {
        if let Some(file) = self.files.0.borrow().get(self.name) {
            let mut bytes = file.borrow_mut();
            change(&mut bytes);
            bytes.truncate(1 << 16);
        }
    }

    /// Does what a broken disk or a person may do: no record is written that has a valid checksum of its own.
    fn damage(&self, action: u8, script: &mut Script<'_>) {
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

    /// Writes a file from the script: a whole record of any layout and number, or any bytes.
    fn forge(&self, script: &mut Script<'_>) {
        let (what, number) = (script.u8(), script.u8());
        let mut record = MAGICS[usize::from(what % 3)].to_vec();
        if what.is_multiple_of(3) {
            record.push(number % 3);
        }
        let sequence = if what & 0x40 == 0 { u64::from(number) } else { u64::MAX - u64::from(number) };
        record.extend_from_slice(&sequence.to_be_bytes());
        let claimed = if what & 0x20 == 0 { None } else { Some(script.u16() as u32 * 7) };
        let body = script.bytes();
        record.extend_from_slice(&claimed.unwrap_or(body.len() as u32).to_be_bytes());
        record.extend_from_slice(body);
        let crc = CRC.checksum(&record);
        record.extend_from_slice(&crc.to_be_bytes());
        record.resize(if what & 0x10 == 0 { 16 * 1024 } else { 4096 }, 0);
        let mut files = self.files.0.borrow_mut();
        let file = files.entry(self.name.to_owned()).or_default();
        let mut bytes = file.borrow_mut();
        if what & 0x80 == 0 {
            bytes.clear();
        }
        bytes.extend_from_slice(&record);
        bytes.truncate(1 << 16);
    }
}

/// Damage never leads to an older state. Whatever the files hold, they are read or refused, and the next state is kept.
pub fn journal(data: &[u8]) {
    let mut script = Script(data);
    let files = Files::default();
    let mut run = Journal::open(files.clone(), NAMES).0;
    let mut last = None;
    for number in 0..script.u8() % 4 {
        let state = vec![number + 1; usize::from(script.u8()) * 8];
        run.persist(&state).expect("a state fits");
        last = Some(state);
    }
    let mut is_forged = false;
    while !script.0.is_empty() {
        let what = script.u8();
        let name = if what & 1 == 0 { NAMES.journal } else { NAMES.copy };
        let damaged = Damaged { files: &files, name };
        match what >> 1 & 15 {
            action @ 0..=5 => damaged.damage(action, &mut script),
            6 => {
                files.0.borrow_mut().remove(name);
                is_forged |= files.0.borrow().is_empty();
            }
            7 => {
                damaged.forge(&mut script);
                is_forged = true;
            }
            8 => {
                let state = script.bytes();
                // Damage while a run goes on is beyond the journal: it keeps its files open.
                let (mut again, found) = Journal::open(files.clone(), NAMES);
                judge(&found, last.as_deref().filter(|_| !is_forged));
                again.persist(state).expect("a state fits");
                (is_forged, last) = (false, Some(state.to_vec()));
            }
            _ => {}
        }
    }
    let (mut again, found) = Journal::open(files.clone(), NAMES);
    judge(&found, last.as_deref().filter(|_| !is_forged));
    again.persist(b"next").expect("a state fits");
    let whole = Found::State { body: b"next".to_vec(), is_earlier: false, damage: None };
    assert_eq!(Journal::open(files, NAMES).1, whole);
}

/// The state that is found is the last one, if it is known.
fn judge(found: &Found, last: Option<&[u8]>) {
    if let (Found::State { body, .. }, Some(last)) = (found, last) {
        assert_eq!(body, last, "an older state");
    }
}
