//! The settings of the modem that survive a restart.

use std::collections::BTreeMap;

/// Names that have an effect in the emulator, and a few that clients set or read, with their factory values.
const FACTORY: [(&str, &str); 22] = [
    ("AGN", "250"),
    ("ASD", "0"),
    ("BND", "3"),
    ("BR1", "3"),
    ("BW0", "5000"),
    ("CST", "1"),
    ("CTO", "10"),
    ("DQF", "0"),
    ("DTO", "2"),
    ("FC0", "25000"),
    ("MFD", "0"),
    ("PCM", "0"),
    ("PTO", "14"),
    ("REV", "0"),
    ("RXP", "1"),
    ("SHF", "0"),
    ("SNR", "0"),
    ("SRC", "0"),
    ("TOA", "0"),
    ("XST", "1"),
    ("psk.packet.mod_hdr_version", "0"),
    ("recv.base64data", "0"),
];

/// Further names are echoed and forgotten.
const MAX_NAMES: usize = 512;

/// The values that `CCCFG` has set.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Nvram {
    values: BTreeMap<String, String>,
}

impl Nvram {
    pub(super) fn factory(src: u8) -> Self {
        let mut values: BTreeMap<_, _> = FACTORY.iter().map(|(k, v)| (k.to_string(), v.to_string())).collect();
        values.insert("SRC".to_string(), src.to_string());
        Self { values }
    }

    pub(super) fn set(&mut self, name: &str, value: &str) {
        if self.values.contains_key(name) || self.values.len() < MAX_NAMES {
            self.values.insert(name.to_string(), value.to_string());
        }
    }

    pub(super) fn get(&self, name: &str) -> Option<&str> {
        self.values.get(name).map(String::as_str)
    }

    pub(super) fn number(&self, name: &str) -> u32 {
        self.get(name).and_then(|value| value.parse().ok()).unwrap_or_default()
    }

    pub(super) fn is_on(&self, name: &str) -> bool {
        self.number(name) != 0
    }

    pub(super) fn all(&self) -> impl Iterator<Item = (&str, &str)> {
        self.values.iter().map(|(name, value)| (name.as_str(), value.as_str()))
    }
}
