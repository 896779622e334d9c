//! The surface's knowledge, folded from its events.

use super::event::{Event, EventKind, EventTime, StoredBudget, StoredCommand, StoredCommandChange};
use super::vehicle_memory::VehicleMemory;
use crate::log::{StoredLogEntry, make_room};
use std::collections::{BTreeMap, VecDeque};

/// Changes of command that are kept.
pub(crate) const MAX_COMMAND_CHANGES: usize = 32;

/// How a store was begun.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Began {
    /// A random name, under which browsers keep their own data.
    pub id: u32,
    /// The number of the mission.
    pub mission: u32,
    /// The series of the orders' versions.
    pub series: u64,
}

/// Everything that the surface keeps.
#[derive(Debug, Default)]
pub struct SurfaceMemory {
    /// The sequence number of the last event.
    pub(crate) sequence: u64,
    /// The time of the last event.
    pub(crate) last: EventTime,
    /// How the store was begun.
    pub(crate) began: Option<Began>,
    /// The last order of a budget, and the configured one at that time.
    pub(crate) budget: Option<(StoredBudget, StoredBudget)>,
    pub(crate) vehicles: BTreeMap<u8, VehicleMemory>,
    /// The last entries of the log.
    pub(crate) log: VecDeque<StoredLogEntry>,
    /// The holder of command and the requests for it.
    pub(crate) command: StoredCommand,
    /// The last changes of command.
    pub(crate) command_changes: VecDeque<StoredCommandChange>,
}

impl SurfaceMemory {
    /// The state after these events, oldest first.
    pub fn fold(events: impl IntoIterator<Item = Event>) -> Self {
        let mut memory = Self::default();
        events.into_iter().for_each(|event| memory.apply(&event));
        memory
    }

    pub fn apply(&mut self, event: &Event) {
        (self.sequence, self.last) = (event.sequence, event.time);
        match &event.kind {
            &EventKind::Began { id, mission, series } => self.began = Some(Began { id, mission, series }),
            EventKind::Budget { ordered, configured } => self.budget = Some((ordered.clone(), configured.clone())),
            EventKind::Vehicle(address, event) => self.vehicles.entry(*address).or_default().apply(event),
            EventKind::Logged(entry) => {
                self.log.push_back(entry.clone());
                make_room(&mut self.log, StoredLogEntry::group);
            }
            EventKind::Command(command) => self.command = command.clone(),
            EventKind::CommandChanged(change) => {
                self.command_changes.push_back(change.clone());
                self.command_changes.drain(..self.command_changes.len().saturating_sub(MAX_COMMAND_CHANGES));
            }
        }
    }

    /// The time of the last event.
    pub fn last(&self) -> EventTime {
        self.last
    }

    /// How the store was begun; `None` before the first event.
    pub fn began(&self) -> Option<Began> {
        self.began
    }

    /// The state as events that make it from nothing.
    pub fn to_events(&self) -> Vec<EventKind> {
        let began = self.began.map(|Began { id, mission, series }| EventKind::Began { id, mission, series });
        let mut all: Vec<EventKind> = began.into_iter().collect();
        let budget = self.budget.clone();
        all.extend(budget.map(|(ordered, configured)| EventKind::Budget { ordered, configured }));
        for (&address, vehicle) in &self.vehicles {
            all.extend(vehicle.to_events().into_iter().map(|event| EventKind::Vehicle(address, event)));
        }
        all.extend(self.log.iter().cloned().map(EventKind::Logged));
        all.extend(Some(self.command.clone()).filter(|c| *c != StoredCommand::default()).map(EventKind::Command));
        all.extend(self.command_changes.iter().cloned().map(EventKind::CommandChanged));
        all
    }

    /// A vehicle by its address.
    pub fn vehicle(&self, address: u8) -> Option<&VehicleMemory> {
        self.vehicles.get(&address)
    }

    /// The knowledge about one vehicle alone.
    pub fn take_vehicle(mut self, address: u8) -> Option<VehicleMemory> {
        self.vehicles.remove(&address)
    }

    /// The vehicles by their addresses.
    pub fn vehicles(&self) -> impl Iterator<Item = (u8, &VehicleMemory)> {
        self.vehicles.iter().map(|(&address, vehicle)| (address, vehicle))
    }
}
