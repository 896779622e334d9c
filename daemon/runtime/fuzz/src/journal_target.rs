//! The properties of the journal for any bytes: plain functions, run by libFuzzer and by the ordinary tests alike.

use super::files::{Damaged, Files, Script};
use super::journal::{Found, Journal, JournalNames};

const NAMES: JournalNames = JournalNames { journal: "state", copy: "state.copy" };
/// The present version, an earlier one and a later one.
const MAGICS: [&[u8; 8]; 3] = [b"scVJRN06", b"scVJRN02", b"scVJRN07"];
static CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISCSI);

/// Writes a file from the script: a whole record of any version and number, or any bytes.
fn forge(damaged: &Damaged<'_>, script: &mut Script<'_>) {
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
    let mut files = damaged.files.0.borrow_mut();
    let file = files.entry(damaged.name.to_owned()).or_default();
    let mut bytes = file.borrow_mut();
    if what & 0x80 == 0 {
        bytes.clear();
    }
    bytes.extend_from_slice(&record);
    bytes.truncate(1 << 16);
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
                forge(&damaged, &mut script);
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
    let whole = Found::State { body: b"next".to_vec(), damage: None };
    assert_eq!(Journal::open(files, NAMES).1, whole);
}

/// The state that is found is the last one, if it is known.
fn judge(found: &Found, last: Option<&[u8]>) {
    if let (Found::State { body, .. }, Some(last)) = (found, last) {
        assert_eq!(body, last, "an older state");
    }
}
