//! The surface keeps the log of the mission.

use super::Surface;
use super::command::{COMMAND_SILENCE, CommandChange, CommandChangeKind};
use super::log::{LogEntry, LogKind, MissionLog};
use super::orders::order_name;
use super::record::StoredLogEntry;
use super::reported_orders::why_refused;
use scenecast_protocol::directive::{OrderStatus, SlotId};
use scenecast_protocol::map::Relabelled;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::{Address, SurfaceName};

impl Surface {
    /// The log of the mission.
    pub fn log(&self) -> &MissionLog {
        &self.log
    }

    /// Adds what a principal has done.
    pub fn log_action(&mut self, vehicle: Option<Address>, kind: LogKind, by: &str, text: &str, now: Instant) {
        self.log.add(vehicle, kind, Some(by), text, now);
    }

    /// Puts the log of an earlier run of the surface back. The labels on the first map are not new then.
    pub(super) fn restore_log<'a>(&mut self, stored: impl IntoIterator<Item = &'a StoredLogEntry>) {
        self.log.restore(stored.into_iter().filter_map(StoredLogEntry::entry));
        for &vehicle in self.records.keys() {
            self.watches.entry(vehicle).or_default().assume_labels_known();
        }
    }

    pub(super) fn log_fact(&mut self, vehicle: Address, kind: LogKind, text: &str, now: Instant) {
        self.log.add(Some(vehicle), kind, None, text, now);
    }

    /// Logs that a vehicle has given many cells of its map another label, once it is done.
    pub(super) fn log_correction(&mut self, vehicle: Address, now: Instant) {
        let Some(view) = self.link.vehicle(vehicle) else { return };
        let (map, cells) = (view.replica(), view.replica().received_cells());
        let Some(record) = self.records.get_mut(&vehicle) else { return };
        if let Some(Relabelled { cells: changed, bytes }) = record.corrections.handle_sample(map.relabelled(), cells) {
            let kbit = bytes as f64 * 8.0 / 1000.0;
            let text =
                format!("the map is corrected: {changed} of {cells} cells have another label, in {kbit:.1} kbit");
            self.log_fact(vehicle, LogKind::Label, &text, now);
        }
    }

    pub(super) fn log_command(&mut self, change: &CommandChange) {
        let silence_min = COMMAND_SILENCE.as_secs() / 60;
        let text = match (change.kind, &change.to) {
            (CommandChangeKind::Taken, _) => match &change.from {
                Some(from) => format!("takes command from {from}, who has given no sign for {silence_min} min"),
                None => "takes command".to_owned(),
            },
            (CommandChangeKind::Moved, _) => "moves command to another client".to_owned(),
            (CommandChangeKind::HandedOver, Some(to)) => format!("hands command over to {to}"),
            (CommandChangeKind::HandedOver, None) => "hands command over".to_owned(),
            (CommandChangeKind::Released, _) => "releases command".to_owned(),
            (CommandChangeKind::Requested, _) => "requests command".to_owned(),
            (CommandChangeKind::Withdrawn, _) => "withdraws the request for command".to_owned(),
        };
        self.log.add(None, LogKind::Command, Some(&change.by), &text, change.at);
    }

    pub(super) fn log_decision(&mut self, vehicle: Address, slot: SlotId, now: Instant) {
        // Fixes are measured and sent by the program, several a minute.
        let Some(decided) = self.link.vehicle(vehicle).and_then(|v| v.slots().find(|s| s.id == slot)) else { return };
        let (name, version) = (order_name(&decided.slot), decided.version);
        let text = match decided.status {
            OrderStatus::Applied if slot == SlotId::Fix => return,
            OrderStatus::Applied => format!("{name} version {version} applied"),
            OrderStatus::Withdrawn(_) if matches!(slot, SlotId::Fix | SlotId::Requests) => return,
            OrderStatus::Refused(reason) => {
                let why = self.records.get(&vehicle).map(|record| why_refused(record, &decided.slot, reason));
                format!("{name} version {version} refused: {}", why.as_deref().unwrap_or(reason.explain()))
            }
            OrderStatus::Withdrawn(why) => format!("{name} version {version} withdrawn: {}", why.explain()),
            _ => return,
        };
        self.log_fact(vehicle, LogKind::Answer, &text, now);
    }

    /// What the log says about the last order of a kind, if a newer one takes its place before its end is known.
    pub(super) fn replaced(&self, vehicle: Address, slot: SlotId) -> Option<String> {
        let last = self.link.vehicle(vehicle)?.slots().find(|order| order.id == slot)?;
        let is_told = last.status.is_pending() && !matches!(slot, SlotId::Fix | SlotId::Requests);
        let (name, version) = (order_name(&last.slot), last.version);
        is_told
            .then(|| format!("{name} version {version} was replaced before the vehicle was known to have applied it"))
    }

    /// Frames of these vehicles were accepted.
    pub(super) fn log_received(&mut self, vehicles: &[Address], now: Instant) {
        for &vehicle in vehicles {
            if let Some(text) = self.watches.entry(vehicle).or_default().handle_frame(now) {
                self.log_fact(vehicle, LogKind::Contact, &text, now);
            }
        }
    }

    /// Time passes: vehicles may have fallen silent.
    pub(super) fn log_silences(&mut self, now: Instant) {
        for vehicle in self.records.keys().copied().collect::<Vec<_>>() {
            let usual = self.records.get(&vehicle).and_then(|record| record.pauses.expected());
            if let Some(text) = self.watches.entry(vehicle).or_default().handle_time(usual, now) {
                self.log_fact(vehicle, LogKind::Contact, &text, now);
            }
        }
    }

    /// Another surface holds a vehicle, calls it, or holds it no more.
    pub(super) fn log_rivalry(&mut self, vehicle: Address, now: Instant) {
        let Some(view) = self.link.vehicle(vehicle) else { return };
        let text = match (view.holder(), view.caller(now)) {
            (Some(holder), _) => format!("{} holds the vehicle", surface_name(holder.name)),
            (None, Some(caller)) => format!("{} calls the vehicle", surface_name(caller.name)),
            (None, None) => "no other surface holds the vehicle any more".to_owned(),
        };
        self.log_fact(vehicle, LogKind::Contact, &text, now);
    }

    pub(super) fn log_mode(&mut self, vehicle: Address, now: Instant) {
        let Some((status, _)) = self.link.vehicle(vehicle).and_then(|view| view.status()) else { return };
        let Some((record, view)) = self.records.get(&vehicle).zip(self.link.vehicle(vehicle)) else { return };
        let text = record.mode_text(status, &view);
        let is_mode = |entry: &&LogEntry| entry.vehicle == Some(vehicle) && entry.kind == LogKind::Mode;
        let logged = || self.log.entries().rev().find(is_mode).map(|entry| entry.text.as_str());
        let mode = (status.mode, status.reason);
        if self.watches.entry(vehicle).or_default().handle_mode(mode, &text, logged) {
            self.log_fact(vehicle, LogKind::Mode, &text, now);
        }
    }

    pub(super) fn log_faults(&mut self, vehicle: Address, now: Instant) {
        let Some((status, _)) = self.link.vehicle(vehicle).and_then(|view| view.status()) else { return };
        let (faults, is_silent) = (status.faults, status.autopilot_silent);
        if let Some(text) = self.watches.entry(vehicle).or_default().handle_faults(faults, is_silent, now) {
            self.log_fact(vehicle, LogKind::Fault, &text, now);
        }
    }

    /// The labels on the map of a vehicle are these.
    pub(super) fn log_labels(&mut self, vehicle: Address, labels: impl Iterator<Item = u8>, now: Instant) {
        let epoch = self.records.get(&vehicle).map_or(0, |record| record.epoch);
        for label in self.watches.entry(vehicle).or_default().handle_labels(epoch, labels) {
            let name = self.records.get(&vehicle).and_then(|record| record.label_name(label));
            let name = name.map_or(String::new(), |name| format!(" ({name})"));
            self.log_fact(vehicle, LogKind::Label, &format!("label {label}{name} is on the map"), now);
        }
    }
}

/// How texts for people name another surface.
pub(super) fn surface_name(name: SurfaceName) -> String {
    match name.as_str() {
        "" => "another surface".to_owned(),
        name => format!("the surface {name}"),
    }
}
