//! The keys that the surface has given the vehicle, in place of those of its key file.

use scenecast_protocol::link::Authenticity;
use scenecast_protocol::seal::{HeldKey, VehicleKey};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::sync::Arc;

/// The keys that the surface has given the vehicle, each the text of a key file. Another key file ends them.
#[derive(Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct KeptKeys {
    /// The fingerprint of the key file under which they were given.
    file: u32,
    /// The present one, if it is not that of the key file.
    present: Option<String>,
    /// The next one, until the surface has proven that it uses it.
    next: Option<String>,
}

impl KeptKeys {
    /// What the vehicle authenticates by, from what its key file says.
    pub(crate) fn begin(&mut self, of_file: Authenticity) -> Authenticity {
        let file = of_file.key.fingerprint();
        if self.file != file {
            if self.present.is_some() || self.next.is_some() {
                tracing::info!("link.key_file is another one: the key that the surface has given is forgotten");
            }
            *self = Self { file, ..Self::default() };
        }
        let present = parse(self.present.as_ref()).map(|key| Arc::new(HeldKey::Vehicle(key)));
        let next = self.next().map(|key| Arc::new(HeldKey::Vehicle(key)));
        Authenticity { key: present.unwrap_or(of_file.key), next, ..of_file }
    }

    pub(super) fn next(&self) -> Option<VehicleKey> {
        parse(self.next.as_ref())
    }

    pub(super) fn keep(&mut self, next: &VehicleKey) {
        self.next = Some(next.to_text().to_string());
    }

    /// The next key is the present one from now on.
    pub(super) fn change(&mut self) {
        self.present = self.next.take().or(self.present.take());
    }
}

impl fmt::Debug for KeptKeys {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let fingerprint = |text: &Option<String>| parse(text.as_ref()).map(|key| format!("{:08x}", key.mission));
        write!(f, "KeptKeys({:08x}, {:?}, {:?})", self.file, fingerprint(&self.present), fingerprint(&self.next))
    }
}

fn parse(text: Option<&String>) -> Option<VehicleKey> {
    match HeldKey::parse(text?) {
        Ok(HeldKey::Vehicle(key)) => Some(key),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenecast_protocol::seal::MissionKey;

    fn key(byte: u8) -> VehicleKey {
        VehicleKey::derive(&MissionKey::from_bytes([byte; 16]), 1)
    }

    fn of_file(byte: u8) -> Authenticity {
        Authenticity::new(HeldKey::Vehicle(key(byte)), true, false)
    }

    #[test]
    fn a_given_key_counts_until_the_key_file_changes() {
        let mut kept = KeptKeys::default();
        assert_eq!(kept.begin(of_file(1)).key.fingerprint(), key(1).mission);
        kept.keep(&key(2));
        let both = kept.begin(of_file(1));
        assert_eq!(both.key.fingerprint(), key(1).mission);
        assert_eq!(both.next.map(|next| next.fingerprint()), Some(key(2).mission));
        kept.change();
        let one = kept.begin(of_file(1));
        assert_eq!(one.key.fingerprint(), key(2).mission);
        assert!(one.next.is_none());
        let other = kept.begin(of_file(3));
        assert_eq!(other.key.fingerprint(), key(3).mission);
        assert_eq!(kept, KeptKeys { file: key(3).mission, ..KeptKeys::default() });
    }

    #[test]
    fn debug_output_reveals_no_key() {
        let mut kept = KeptKeys::default();
        kept.keep(&key(2));
        let said = format!("{kept:?}");
        assert_eq!(said, format!("KeptKeys(00000000, None, Some(\"{:08x}\"))", key(2).mission));
    }
}
