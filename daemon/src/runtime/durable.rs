//! The vehicle's durable state as a file.

use crate::auv::Durable;
use crate::picture::write_whole;
use crate::problem::Problem;
use std::path::Path;

/// Magic bytes and version of the file.
const MAGIC: &[u8; 8] = b"scVSTA01";

static CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISCSI);

/// Why a file holds no durable state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum DurableError {
    /// Of another version, or no such file at all.
    #[error("the file is not of this version of scenecast")]
    Version,
    /// The checksum does not match.
    #[error("the file is damaged; restore it, or move it away to begin a new mission")]
    Damaged,
}

/// The bytes of the file.
///
/// ```text
/// bytes 0-7   "scVSTA01"
/// then        the state in postcard
/// last 4      CRC-32/ISCSI of everything before, big-endian
/// ```
fn encode(durable: &Durable) -> Vec<u8> {
    let mut bytes = MAGIC.to_vec();
    bytes.extend(postcard::to_allocvec(durable).unwrap_or_default());
    let crc = CRC.checksum(&bytes);
    bytes.extend_from_slice(&crc.to_be_bytes());
    bytes
}

fn decode(bytes: &[u8]) -> Result<Durable, DurableError> {
    let (covered, crc) = bytes.split_last_chunk::<4>().ok_or(DurableError::Damaged)?;
    let body = covered.strip_prefix(MAGIC).ok_or(DurableError::Version)?;
    if CRC.checksum(covered) != u32::from_be_bytes(*crc) {
        return Err(DurableError::Damaged);
    }
    match postcard::take_from_bytes(body) {
        Ok((durable, [])) => Ok(durable),
        _ => Err(DurableError::Damaged),
    }
}

/// What survived the last run; `None` before the first.
pub fn load_durable(path: &Path) -> Result<Option<Durable>, Problem> {
    match std::fs::read(path) {
        Ok(bytes) => decode(&bytes).map(Some).map_err(|e| Problem::file(path, e)),
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok(None),
        Err(e) => Err(Problem::file(path, e)),
    }
}

/// Makes the state durable: a power cut leaves the old or the new one.
pub fn save_durable(path: &Path, durable: &Durable) -> Result<(), Problem> {
    write_whole(path, &encode(durable))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_state_comes_back_and_any_damage_is_noticed() {
        let durable = Durable { epoch: 3, hold: true, budget_bps: Some(500), ..Durable::default() };
        let bytes = encode(&durable);
        assert_eq!(decode(&bytes), Ok(durable));
        for at in 0..bytes.len() {
            let mut damaged = bytes.clone();
            damaged[at] ^= 0x10;
            assert!(decode(&damaged).is_err(), "byte {at}");
            assert!(decode(&bytes[..at]).is_err(), "cut at {at}");
        }
    }
}
