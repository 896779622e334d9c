//! The log of the mission: orders and edits with their authors, the answers of the vehicles, silences, new labels, images.

mod watch;

pub(super) use watch::Watch;
pub use watch::{AUTOPILOT_SILENT, NO_FAULT};

use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::Address;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, VecDeque};

/// Entries that are kept of the mission's log.
pub(crate) const MAX_LOG: usize = 2000;

/// An entry of the mission's log.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct StoredLogEntry {
    /// One more than that of the entry before.
    pub number: u64,
    pub at: u64,
    /// The address of the vehicle that it concerns, if one.
    pub vehicle: Option<u8>,
    /// 0 order, 1 answer, 2 contact, 3 mode, 4 label, 5 image, 6 record, 7 command.
    pub kind: u8,
    pub by: Option<String>,
    pub text: String,
}

/// The kind of an entry.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum LogKind {
    /// An order was given, whether or not it arrives.
    Order,
    /// A vehicle has applied or refused an order.
    Answer,
    /// A vehicle has fallen silent, is received again, or has begun another run.
    Contact,
    /// The mode of a vehicle has changed.
    Mode,
    /// A label is on the map for the first time, or many cells of the map have got another label.
    Label,
    /// An image of a label has arrived.
    Image,
    /// Something that stays at the surface was changed: a name, a note, a marker.
    Record,
    /// Command was requested, taken, handed over or released.
    Command,
    /// The equipment of a vehicle has failed, or works again.
    Fault,
    /// An order was refused here, and not sent.
    Refused,
}

impl LogKind {
    /// Every kind, in the order of the numbers in files.
    pub const ALL: [Self; 10] = [
        Self::Order,
        Self::Answer,
        Self::Contact,
        Self::Mode,
        Self::Label,
        Self::Image,
        Self::Record,
        Self::Command,
        Self::Fault,
        Self::Refused,
    ];

    /// Whether entries give room first to orders, answers, modes and faults.
    fn is_minor(self) -> bool {
        !matches!(self, Self::Order | Self::Answer | Self::Mode | Self::Fault)
    }

    /// The name for people and in the API.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Order => "order",
            Self::Answer => "answer",
            Self::Contact => "contact",
            Self::Mode => "mode",
            Self::Label => "label",
            Self::Image => "image",
            Self::Record => "record",
            Self::Command => "command",
            Self::Fault => "fault",
            Self::Refused => "refused",
        }
    }
}

/// One entry of the log.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LogEntry {
    /// One more than that of the entry before.
    pub number: u64,
    pub at: Instant,
    /// `None`: the entry concerns the surface, or all vehicles.
    pub vehicle: Option<Address>,
    pub kind: LogKind,
    /// The principal who caused it; `None`: the surface or the vehicle.
    pub by: Option<String>,
    /// One line for people, of at most 240 characters.
    pub text: String,
}

impl LogEntry {
    /// The text, with the principal who caused it.
    pub fn line(&self) -> String {
        let by = self.by.as_deref().map(|by| format!("{by}: ")).unwrap_or_default();
        format!("{by}{}", self.text)
    }
}

/// The last entries of the log.
#[derive(Debug, Default)]
pub struct MissionLog {
    entries: VecDeque<LogEntry>,
    last: u64,
}

impl MissionLog {
    /// The most entries that are kept; [`make_room`] says which of them go.
    pub const MAX: usize = MAX_LOG;
    /// The most characters of a text.
    const MAX_TEXT: usize = 240;

    /// The entries, the oldest first.
    pub fn entries(&self) -> impl DoubleEndedIterator<Item = &LogEntry> {
        self.entries.iter()
    }

    /// The number of the last entry; 0 before the first.
    pub fn last(&self) -> u64 {
        self.last
    }

    pub(super) fn add(&mut self, vehicle: Option<Address>, kind: LogKind, by: Option<&str>, text: &str, at: Instant) {
        let text = text.chars().take(Self::MAX_TEXT).collect();
        let number = self.last + 1;
        self.push(LogEntry { number, at, vehicle, kind, by: by.map(str::to_owned), text });
    }

    fn push(&mut self, entry: LogEntry) {
        self.last = entry.number;
        self.entries.push_back(entry);
        make_room(&mut self.entries, LogEntry::group);
    }

    /// Puts the entries of an earlier run of the surface back, before any other entry.
    pub(super) fn restore(&mut self, stored: impl IntoIterator<Item = LogEntry>) {
        stored.into_iter().for_each(|entry| self.push(entry));
    }
}

/// The kind of an entry, its author, and the first word of its text, which names what was ordered.
type Group<'a> = (u8, Option<&'a str>, &'a str);

fn subject(text: &str) -> &str {
    text.split([':', ' ']).next().unwrap_or_default()
}

/// Removes entries while there are too many: the oldest of the largest group. While minor kinds are more than a quarter, the group is
/// one of theirs. So no number of weights pushes a hold out.
pub(super) fn make_room<T>(entries: &mut VecDeque<T>, group: impl Fn(&T) -> Group<'_>) {
    let is_minor = |kind: u8| LogKind::ALL.into_iter().any(|known| known as u8 == kind && known.is_minor());
    while entries.len() > MAX_LOG {
        let minor = entries.iter().filter(|entry| is_minor(group(entry).0)).count();
        let may_go = |entry: &&T| minor <= MAX_LOG / 4 || is_minor(group(entry).0);
        let mut groups: BTreeMap<Group<'_>, usize> = BTreeMap::new();
        entries.iter().filter(may_go).for_each(|entry| *groups.entry(group(entry)).or_default() += 1);
        let largest = groups.into_iter().max_by_key(|(_, count)| *count).map(|(group, _)| group);
        let oldest = entries.iter().position(|entry| Some(group(entry)) == largest);
        entries.remove(oldest.unwrap_or(0));
    }
}

impl LogEntry {
    fn group(&self) -> Group<'_> {
        (self.kind as u8, self.by.as_deref(), subject(&self.text))
    }
}

impl From<&LogEntry> for StoredLogEntry {
    fn from(entry: &LogEntry) -> Self {
        Self {
            number: entry.number,
            at: entry.at.as_micros(),
            vehicle: entry.vehicle.map(Address::number),
            kind: entry.kind as u8,
            by: entry.by.clone(),
            text: entry.text.clone(),
        }
    }
}

impl StoredLogEntry {
    pub(super) fn group(&self) -> Group<'_> {
        (self.kind, self.by.as_deref(), subject(&self.text))
    }

    /// `None` if this build does not know the kind.
    pub(super) fn entry(&self) -> Option<LogEntry> {
        Some(LogEntry {
            number: self.number,
            at: Instant::from_micros(self.at),
            vehicle: self.vehicle.and_then(Address::vehicle),
            kind: *LogKind::ALL.get(usize::from(self.kind))?,
            by: self.by.clone(),
            text: self.text.clone(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn minor_entries_push_no_order_out_of_the_log_or_the_file() {
        let mut log = MissionLog::default();
        let mut stored = VecDeque::new();
        let mut add = |kind, text: &str| {
            log.add(Address::vehicle(1), kind, Some("ann"), text, Instant::ZERO);
            stored.push_back(StoredLogEntry::from(log.entries().next_back().unwrap()));
            make_room(&mut stored, StoredLogEntry::group);
        };
        add(LogKind::Order, "hold");
        (0..9000).for_each(|number| {
            let kind =
                [LogKind::Record, LogKind::Command, LogKind::Label, LogKind::Image, LogKind::Contact][number % 5];
            add(kind, &format!("entry {number}"));
        });
        add(LogKind::Answer, "hold version 1 applied");
        let texts: Vec<&str> = log.entries().map(|entry| entry.text.as_str()).collect();
        assert_eq!((texts.len(), texts[0], texts[1]), (MissionLog::MAX, "hold", "entry 7002"));
        assert!(log.entries().map(StoredLogEntry::from).eq(stored));
    }

    #[test]
    fn nobody_pushes_the_orders_of_another_out_by_orders_of_his_own() {
        let mut log = MissionLog::default();
        let mut add = |kind, by, text: &str| log.add(Address::vehicle(1), kind, by, text, Instant::ZERO);
        add(LogKind::Order, Some("carla"), "fence: 4 corners");
        add(LogKind::Mode, None, "it holds");
        for number in 0..3000 {
            add(LogKind::Order, Some("anna"), &format!("hold {number}"));
            add(LogKind::Answer, None, "hold applied");
        }
        let texts: Vec<&str> = log.entries().map(|entry| entry.text.as_str()).collect();
        assert_eq!((texts.len(), texts[0], texts[1]), (MissionLog::MAX, "fence: 4 corners", "it holds"));
        assert!(texts.contains(&"hold 2999"));
    }

    #[test]
    fn weights_push_no_hold_of_the_same_author_out() {
        let mut log = MissionLog::default();
        let mut add = |kind, by, text: &str| log.add(Address::vehicle(1), kind, by, text, Instant::ZERO);
        add(LogKind::Order, Some("anna"), "hold");
        add(LogKind::Answer, None, "hold version 1 applied");
        for number in 0..3000 {
            add(LogKind::Order, Some("anna"), &format!("weights: label {} +0.50", number % 254));
            add(LogKind::Answer, None, &format!("utility version {number} applied"));
        }
        let texts: Vec<&str> = log.entries().map(|entry| entry.text.as_str()).take(2).collect();
        assert_eq!(texts, ["hold", "hold version 1 applied"]);
    }

    #[test]
    fn the_log_keeps_its_last_entries_and_numbers_over_a_restart() {
        let mut log = MissionLog::default();
        let long = "x".repeat(1000);
        for second in 0..2500 {
            let at = Instant::from_secs_f64(f64::from(second));
            log.add(Address::vehicle(1), LogKind::Order, Some("ann"), &long, at);
        }
        assert_eq!((log.entries().count(), log.last()), (MissionLog::MAX, 2500));
        assert_eq!(log.entries().next().unwrap().text.len(), MissionLog::MAX_TEXT);
        let stored: Vec<StoredLogEntry> = log.entries().map(StoredLogEntry::from).collect();
        let mut restored = MissionLog::default();
        restored.restore(stored.iter().filter_map(StoredLogEntry::entry));
        assert!(restored.entries().eq(log.entries()));
        restored.add(None, LogKind::Command, None, "ann took command", Instant::ZERO);
        assert_eq!(restored.last(), 2501);
    }
}
