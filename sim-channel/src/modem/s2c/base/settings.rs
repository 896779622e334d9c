//! The settings `!X`: ranges, defaults, and values that wait for the connection to end; the switches `@Z..` and `@CTRL` of the
//! port, which a restart clears.

use std::collections::BTreeMap;

struct SettingRule {
    key: &'static str,
    allowed: AllowedValues,
    default: u32,
    /// Takes effect only while no connection is up; until then it reads back as `[*]value`.
    waits: bool,
}

enum AllowedValues {
    Range(u32, u32),
    OneOf(&'static [u32]),
}

const fn rule(key: &'static str, low: u32, high: u32, default: u32, waits: bool) -> SettingRule {
    SettingRule { key, allowed: AllowedValues::Range(low, high), default, waits }
}

const RULES: [SettingRule; 20] = [
    rule("AL", 1, 254, 1, false),
    rule("AR", 0, 254, 0, false),
    SettingRule { key: "AM", allowed: AllowedValues::OneOf(&[2, 6, 14, 30, 62, 126, 254]), default: 14, waits: true },
    rule("L", 0, 3, 3, true),
    rule("LC", 0, 1, 0, false),
    rule("G", 0, 1, 0, true),
    rule("C", 0, 3, 2, true),
    rule("ZC", 1, 32, 10, true),
    rule("ZP", 50, 1200, 750, true),
    rule("RC", 0, 255, 3, false),
    rule("RT", 500, 12_000, 4000, false),
    rule("RI", 0, 255, 0, false),
    rule("ZI", 0, 3600, 120, false),
    rule("KO", 0, 3600, 0, false),
    rule("RP", 0, 1, 0, false),
    rule("CA", 1300, 1700, 1500, false),
    rule("DA", 0, 3600, 12, false),
    rule("DT", 0, 3600, 12, false),
    rule("ZH", 0, 3600, 0, false),
    rule("ZS", 0, 7, 0, false),
];

/// Names and keys of `AT&V`, in the order of firmware 1.9.
const LISTED: [(&str, &str); 18] = [
    ("Source Level", "L"),
    ("Source Level Control", "LC"),
    ("Gain", "G"),
    ("Carrier Waveform ID", "C"),
    ("Local Address", "AL"),
    ("Highest Address", "AM"),
    ("Cluster Size", "ZC"),
    ("Packet Time", "ZP"),
    ("Retry Count", "RC"),
    ("Retry Timeout", "RT"),
    ("Wake Up Active Time", "DA"),
    ("Wake Up Period", "DT"),
    ("Promiscuous Mode", "RP"),
    ("Sound Speed", "CA"),
    ("IM Retry Count", "RI"),
    ("Pool Size", "ZL"),
    ("Hold Timeout", "ZH"),
    ("Idle Timeout", "ZI"),
];

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum SettingError {
    Unknown,
    NotANumber,
    OutOfRange,
}

/// The values in force and those that wait for the connection to end.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Settings {
    values: BTreeMap<&'static str, u32>,
    pending: BTreeMap<&'static str, u32>,
    /// Capacity of the burst pool, bytes; `@ZL`.
    pub pool: usize,
}

impl Settings {
    /// The factory values, with the given local and remote address.
    pub(crate) fn factory(address: u8, remote: u8) -> Self {
        let mut values: BTreeMap<_, _> = RULES.iter().map(|rule| (rule.key, rule.default)).collect();
        values.insert("AL", u32::from(address));
        values.insert("AR", u32::from(remote));
        Self { values, pending: BTreeMap::new(), pool: 16_384 }
    }

    /// The value in force; 0 for a key that does not exist.
    pub(crate) fn get(&self, key: &str) -> u32 {
        self.values.get(key).copied().unwrap_or_default()
    }

    /// The value of a setting whose range fits a byte.
    pub(crate) fn byte(&self, key: &str) -> u8 {
        u8::try_from(self.get(key)).unwrap_or(u8::MAX)
    }

    /// The value as `?X` shows it, marked if it waits.
    pub(crate) fn shown(&self, key: &str) -> Option<String> {
        let pending = self.pending.get(key).map(|value| format!("[*]{value}"));
        pending.or_else(|| self.values.get(key).map(u32::to_string))
    }

    /// Sets a value; true if it takes effect at once, false if it waits for the connection to end.
    pub(crate) fn set(&mut self, key: &str, text: &str, connected: bool) -> Result<bool, SettingError> {
        let rule = RULES.iter().find(|rule| rule.key == key).ok_or(SettingError::Unknown)?;
        let number = text.parse().ok().filter(|_| text.bytes().all(|byte| byte.is_ascii_digit()));
        let value: u32 = number.ok_or(SettingError::NotANumber)?;
        let allowed = match rule.allowed {
            AllowedValues::Range(low, high) => (low..=high).contains(&value),
            AllowedValues::OneOf(values) => values.contains(&value),
        };
        if !allowed {
            return Err(SettingError::OutOfRange);
        }
        let waits = rule.waits && connected;
        if waits { &mut self.pending } else { &mut self.values }.insert(rule.key, value);
        Ok(!waits)
    }

    /// `AT&V`: `Name: value` lines and an empty one; values that wait are marked before the name, as in `[*]Gain: 1`.
    pub(crate) fn listing(&self) -> String {
        let line = |(name, key): &(&str, &str)| {
            let value = if *key == "ZL" { self.pool.to_string() } else { self.shown(key).unwrap_or_default() };
            match value.strip_prefix("[*]") {
                Some(waits) => format!("[*]{name}: {waits}\r\n"),
                None => format!("{name}: {value}\r\n"),
            }
        };
        LISTED.iter().map(line).collect()
    }

    /// The values that waited take effect.
    pub(crate) fn apply_pending(&mut self) {
        self.values.append(&mut self.pending);
    }
}

#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct PortOptions {
    extended: bool,
    usbl: bool,
    networking: bool,
    other: bool,
    control: bool,
}

impl PortOptions {
    /// `@ZX`: notifications of each transmission and reception.
    pub(crate) fn extended(&self) -> bool {
        self.extended
    }

    /// `@ZU`: notifications of the USBL head.
    pub(crate) fn usbl(&self) -> bool {
        self.usbl
    }

    /// `@ZF`: extended networking, with a protocol id in every message.
    pub(crate) fn networking(&self) -> bool {
        self.networking
    }

    /// `@CTRL`: the right to change settings.
    pub(crate) fn control(&self) -> bool {
        self.control
    }

    /// Sets the option `key`; returns the reply.
    pub(crate) fn set(&mut self, key: &str, value: &str) -> &'static str {
        if (key, value) == ("CTRL", "") {
            self.control = true;
            return "OK";
        }
        let switch = match key {
            "ZX" => &mut self.extended,
            "ZU" => &mut self.usbl,
            "ZF" => &mut self.networking,
            "ZA" => &mut self.other,
            _ => return "ERROR UNKNOWN COMMAND",
        };
        *switch = match value {
            "0" => false,
            "1" => true,
            _ => return "ERROR OUT OF RANGE",
        };
        "OK"
    }

    /// The value behind `?` of an option.
    pub(crate) fn value(&self, key: &str) -> Option<String> {
        let switch = match key {
            "ZX" => self.extended,
            "ZU" => self.usbl,
            "ZF" => self.networking,
            "ZA" => self.other,
            _ => return None,
        };
        Some(u8::from(switch).to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_out_of_range_are_refused() {
        let mut settings = Settings::factory(7, 0);
        assert_eq!(settings.get("AL"), 7);
        assert_eq!(settings.set("L", "4", false), Err(SettingError::OutOfRange));
        assert_eq!(settings.set("AM", "15", false), Err(SettingError::OutOfRange));
        assert_eq!(settings.set("AM", "30", false), Ok(true));
        assert_eq!(settings.set("L", "x", false), Err(SettingError::NotANumber));
        assert_eq!(settings.set("L", "", false), Err(SettingError::NotANumber));
        assert_eq!(settings.set("L", "99999999999", false), Err(SettingError::NotANumber));
        assert_eq!(settings.set("XX", "1", false), Err(SettingError::Unknown));
    }

    #[test]
    fn pending_value_is_marked_until_it_takes_effect() {
        let mut settings = Settings::factory(1, 0);
        assert_eq!(settings.set("ZP", "765", true), Ok(false));
        assert_eq!((settings.get("ZP"), settings.shown("ZP")), (750, Some("[*]765".to_string())));
        settings.apply_pending();
        assert_eq!((settings.get("ZP"), settings.shown("ZP")), (765, Some("765".to_string())));
        assert_eq!(settings.shown("QQ"), None);
    }
}
