//! `[[fault]]`, and the same faults as commands of a running emulation.

use super::channel::MAX_S;
use super::reader::TableReader;
use super::{index_of, seconds};
use scenecast_core::UserError;
use std::time::Duration;

/// A fault of one modem.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ModemFault {
    /// Every message is refused with BUSY for this time.
    Busy(Duration),
    /// It restarts; settings that were not stored are lost.
    Reboot,
    /// Noise on the line to the host for this time.
    Garbage(Duration),
    /// The output to the host ends in half a line.
    HalfLine,
    /// The port neither reads nor writes for this time.
    Freeze(Duration),
    /// It has another address than the configured one.
    WrongAddress(u8),
    /// The supply fails in its next transmission, which is cut short, and it restarts.
    BrownOut,
    /// It accepts a megabyte of data before it reports a full buffer.
    BigBuffer,
    /// The device or the TCP port is gone for this time.
    Unplug(Duration),
}

/// Name, default of the number that may follow, and unit of that number.
const FAULTS: [(&str, Option<f64>, &str); 9] = [
    ("busy", Some(10.0), "s"),
    ("reboot", None, ""),
    ("garbage", Some(10.0), "s"),
    ("half_line", None, ""),
    ("freeze", Some(60.0), "s"),
    ("wrong_address", Some(99.0), "address"),
    ("brown_out", None, ""),
    ("big_buffer", None, ""),
    ("unplug", Some(30.0), "s"),
];

impl ModemFault {
    /// The allowed faults, separated by commas.
    pub fn names() -> String {
        FAULTS.map(|(name, ..)| name).join(", ")
    }

    fn new(name: &str, number: Option<f64>) -> Option<Self> {
        let (name, usual, _) = FAULTS.iter().find(|(known, ..)| *known == name)?;
        let number = number.or(*usual);
        let length = number.map_or(Duration::ZERO, seconds);
        Some(match *name {
            "busy" => Self::Busy(length),
            "reboot" => Self::Reboot,
            "garbage" => Self::Garbage(length),
            "half_line" => Self::HalfLine,
            "freeze" => Self::Freeze(length),
            "wrong_address" => Self::WrongAddress(number.filter(|n| (1.0..=254.0).contains(n))? as u8),
            "brown_out" => Self::BrownOut,
            "big_buffer" => Self::BigBuffer,
            _ => Self::Unplug(length),
        })
    }

    /// Reads the words of a command, as in `freeze 60`.
    pub fn parse(words: &[&str]) -> Option<Self> {
        let (name, rest) = words.split_first()?;
        let number = match rest {
            [] => None,
            [number] => Some(number.parse().ok().filter(|n| (0.0..=MAX_S).contains(n))?),
            _ => return None,
        };
        Self::new(name, number)
    }
}

/// A fault of `[[fault]]`: time, modem, kind.
pub(super) fn read(table: TableReader<'_>, names: &[&str]) -> Result<(Duration, usize, ModemFault), UserError> {
    let at = table.number("at_s", 0.0..=MAX_S, "s")?;
    let at = at.ok_or_else(|| table.missing("at_s", format!("a number from 0 to {MAX_S} s")))?;
    let modem = index_of(&table, "modem", names)?;
    let words = FAULTS.map(|(name, _, unit)| (name, (name, unit)));
    let takes = format!("one of {}", ModemFault::names());
    let (name, unit) = table.choice("what", &words)?.ok_or_else(|| table.missing("what", takes.clone()))?;
    let number = match unit {
        "s" => table.number("for_s", 0.0..=MAX_S, "s")?,
        "address" => table.whole("address", 1..=254, "")?.map(|address| address as f64),
        _ => None,
    };
    let fault = ModemFault::new(name, number).ok_or_else(|| table.wrong("what", takes))?;
    table.finish()?;
    Ok((seconds(at), modem, fault))
}
