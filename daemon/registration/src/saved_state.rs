//! The state of a registration as bytes.
//!
//! ```text
//!  0        8         10
//!  | magic  | version | state in postcard |
//! ```

use crate::registrar::Registrar;

const MAGIC: [u8; 8] = *b"SCNREGIS";
const VERSION: u16 = 2;

/// The reason why bytes are no registration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum RestoreError {
    #[error("no registration")]
    Foreign,
    #[error("a registration of version {0}, this program reads version {VERSION}")]
    Version(u16),
    #[error("its content is inconsistent")]
    Inconsistent,
}

impl Registrar {
    /// The state for [`Registrar::restore`], at most about 21 MB.
    pub fn save(&self) -> Vec<u8> {
        let mut bytes = MAGIC.to_vec();
        bytes.extend(VERSION.to_le_bytes());
        bytes.extend(postcard::to_allocvec(self).unwrap_or_default());
        bytes
    }

    /// Restores a state. Its poses continue exactly as those of the saved registrar would.
    ///
    /// # Errors
    /// The bytes are no state, of another version, or contradict themselves.
    pub fn restore(bytes: &[u8]) -> Result<Self, RestoreError> {
        let content = bytes.strip_prefix(&MAGIC).ok_or(RestoreError::Foreign)?;
        let (version, content) = content.split_first_chunk::<2>().ok_or(RestoreError::Inconsistent)?;
        if u16::from_le_bytes(*version) != VERSION {
            return Err(RestoreError::Version(u16::from_le_bytes(*version)));
        }
        let restored: Self = postcard::from_bytes(content).map_err(|_| RestoreError::Inconsistent)?;
        if restored.is_sound() { Ok(restored) } else { Err(RestoreError::Inconsistent) }
    }
}
