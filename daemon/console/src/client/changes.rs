//! The differences between two states, changes as they happen, and the log of the mission.

use super::names;
use super::session::{Session, json, write};
use super::text::{self, is_silent, mode, span};
use crate::bodies::{LogLine, LogList};
use scenecast_core::{UserError, one_line};
use scenecast_surface::state::{ExemplarImage, ExemplarStage, MissionState, VehicleState};
use serde::Serialize;
use std::path::Path;

/// A change of the state.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct StateChange {
    /// Mission time of the new state.
    pub(super) t_s: f64,
    /// The address of the vehicle; null for the surface.
    pub(super) vehicle: Option<u8>,
    /// mission, command, vehicle, mode, silence, map, label, directive, exemplar or budget.
    pub(super) kind: &'static str,
    /// One line of text for people.
    pub(super) text: String,
}

impl StateChange {
    /// The change as a line with its time.
    pub(super) fn line(&self) -> String {
        let vehicle = self.vehicle.map_or(String::new(), |id| format!("vehicle {id}: "));
        format!("{:>10}  {vehicle}{}", span(self.t_s), one_line(&self.text))
    }
}

/// The line at the beginning.
pub(super) fn first(state: &MissionState) -> Vec<StateChange> {
    let text = format!("mission {}, {} vehicles", state.mission.name, state.vehicles.len());
    vec![StateChange { t_s: state.now_s, vehicle: None, kind: "mission", text }]
}

/// All changes from one state to the next.
pub(super) fn changes(before: &MissionState, after: &MissionState) -> Vec<StateChange> {
    let mut all = Vec::new();
    let mut add = |vehicle, kind, text| all.push(StateChange { t_s: after.now_s, vehicle, kind, text });
    if before.mission.id != after.mission.id {
        add(None, "mission", "the surface has restarted".to_owned());
    }
    if after.mission.ended && !before.mission.ended {
        add(None, "mission", "the survey has ended".to_owned());
    }
    if before.link.budget_bps != after.link.budget_bps {
        add(None, "budget", format!("the budget is {} bit/s", after.link.budget_bps));
    }
    if before.link.shares != after.link.shares {
        let shares: Vec<String> = after.link.shares.iter().map(|(c, p)| format!("{c} {p} %")).collect();
        add(None, "budget", format!("the shares are {}", shares.join(", ")));
    }
    if before.link.background != after.link.background {
        add(None, "budget", format!("the background streams are {}", text::background(&after.link)));
    }
    for change in after.command.history.iter().filter(|c| !before.command.history.contains(c)) {
        add(None, "command", text::command_change(change));
    }
    for new in &after.vehicles {
        match before.vehicles.iter().find(|v| v.id == new.id) {
            None => add(Some(new.id), "vehicle", format!("{} appeared", new.name)),
            Some(old) => of_vehicle((old, before), (new, after), &mut |kind, text| add(Some(new.id), kind, text)),
        }
    }
    all
}

fn of_vehicle(
    (old, before): (&VehicleState, &MissionState),
    (new, after): (&VehicleState, &MissionState),
    add: &mut dyn FnMut(&'static str, String),
) {
    match (is_silent(old, before), is_silent(new, after)) {
        (false, true) => add("silence", format!("silent, expected within {}", span(new.expected_interval_s))),
        (true, false) => add("silence", "no longer silent".to_owned()),
        _ => {}
    }
    if let Some(status) = &new.status
        && old.status.as_ref().map(|s| s.mode) != Some(status.mode)
    {
        add("mode", format!("mode {}", mode(status.mode)));
    }
    if old.map.version != new.map.version {
        add("map", format!("map version {}, {} cells", new.map.version, new.map.explored_cells));
    }
    of_labels(old, new, add);
    for s in &new.orders.directive.slots {
        let before = old.orders.directive.slots.iter().find(|o| o.slot == s.slot);
        if before.is_none_or(|o| (o.version, o.state) != (s.version, s.state)) {
            add("directive", format!("{} {}", s.name, text::order(s)));
        }
    }
}

fn of_labels(old: &VehicleState, new: &VehicleState, add: &mut dyn FnMut(&'static str, String)) {
    for label in &new.labels {
        let Some(before) = old.labels.iter().find(|l| l.id == label.id) else {
            add("label", format!("label {} appeared", label.id));
            continue;
        };
        let (was, is) = (&before.exemplar, &label.exemplar);
        let is_new = |i: &&ExemplarImage| !i.requested && was.images.iter().all(|old| old.number != i.number);
        for image in is.images.iter().filter(is_new) {
            let text = format!("an image of label {} arrived without a request, {} bytes", label.id, image.bytes);
            add("exemplar", text);
        }
        if (was.state, was.progress) != (is.state, is.progress)
            || was.at_s != is.at_s && is.state == ExemplarStage::Received
        {
            let state = serde_json::to_value(is.state).unwrap_or_default();
            let state = state.as_str().unwrap_or_default().replace('_', " ");
            add("exemplar", format!("image of label {}: {state}, {:.0} %", label.id, 100.0 * is.progress));
        }
    }
}

pub async fn show_status(session: &Session) -> Result<(), UserError> {
    let state = session.state().await?;
    let only = session.selected(&state)?;
    session.print(&state, || text::status(&state, only))
}

/// Prints the labels of a vehicle; if `count` is given, the groups that they form where their tree is cut at that number.
pub async fn show_labels(session: &Session, count: Option<u8>) -> Result<(), UserError> {
    let state = session.state().await?;
    let vehicle = session.choose(&state)?;
    let Some(count) = count else {
        return session.print(&vehicle.labels, || text::labels(vehicle, state.now_s));
    };
    let groups = names::groups(&vehicle.labels, &vehicle.label_book, vehicle.label_tree.as_ref(), count.into())?;
    session.print(&groups, || text::groups(&groups))
}

pub async fn watch(session: &Session) -> Result<(), UserError> {
    tokio::select! {
        _ = tokio::signal::ctrl_c() => Ok(()),
        ended = print_changes(session) => ended,
    }
}

async fn print_changes(session: &Session) -> Result<(), UserError> {
    let mut events = session.client.events().await?;
    let mut before: Option<MissionState> = None;
    loop {
        let after = events.state().await?;
        let all = match &before {
            Some(before) => changes(before, &after),
            None => first(&after),
        };
        let selected = session.selected(&after)?;
        let is_selected = |id: Option<u8>| selected.is_none() || id.is_none() || id == selected;
        for change in all.iter().filter(|c| is_selected(c.vehicle)) {
            let line = if session.json { json(change)? } else { change.line() };
            if !write(&format!("{line}\n"))? {
                return Ok(());
            }
        }
        before = Some(after);
    }
}

/// The wanted entries of the log.
#[derive(Debug, Clone, Default)]
pub struct LogSelection {
    /// order, answer, contact, mode, label, image, record or command.
    pub kind: Option<String>,
    /// Only entries with a higher number.
    pub since: Option<u64>,
}

impl LogSelection {
    fn query(&self, vehicle: Option<u8>) -> String {
        let vehicle = vehicle.map(|id| format!("vehicle={id}"));
        let kind = self.kind.as_ref().map(|kind| format!("kind={kind}"));
        let since = self.since.map(|number| format!("since={number}"));
        let members: Vec<String> = [vehicle, kind, since].into_iter().flatten().collect();
        if members.is_empty() { String::new() } else { format!("?{}", members.join("&")) }
    }
}

/// Prints the entries of the log, the oldest first.
pub async fn show_log(session: &Session, selection: &LogSelection) -> Result<(), UserError> {
    let only = session.selected_now().await?;
    let (bytes, _) = session.client.get(&format!("/api/v2/log{}", selection.query(only))).await?;
    let log: LogList = serde_json::from_slice(&bytes).map_err(|e| session.client.unreadable(&e))?;
    session.print(&log, || match log.entries.is_empty() {
        true => "no entry\n".to_owned(),
        false => log.entries.iter().map(|entry| line(entry) + "\n").collect(),
    })
}

/// Writes the entries of the log to a file, as a table for a spreadsheet.
pub async fn save_log(session: &Session, selection: &LogSelection, out: &Path) -> Result<(), UserError> {
    let only = session.selected_now().await?;
    let (bytes, _) = session.client.get(&format!("/api/v2/log.csv{}", selection.query(only))).await?;
    std::fs::write(out, bytes).map_err(|e| UserError::file(out, e))
}

fn line(entry: &LogLine) -> String {
    let vehicle = entry.vehicle.map_or(String::new(), |id| format!("vehicle {id}: "));
    let by = entry.by.as_ref().map_or(String::new(), |by| format!(" (by {by})"));
    let LogLine { number, at_s, utc, kind, text, .. } = entry;
    one_line(&format!("{number:>5}  {utc}  {:>10}  {kind:<8} {vehicle}{text}{by}", span(*at_s)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenecast_surface::state::{CommandChangeName, CommandChangeState};

    #[test]
    fn only_differences_are_changes() {
        let before = MissionState { now_s: 5.0, ..MissionState::default() };
        let mut after = MissionState { now_s: 6.0, ..before.clone() };
        assert_eq!(changes(&before, &after), []);
        after.link.budget_bps = 700;
        after.mission.ended = true;
        after.command.history.push(CommandChangeState {
            at_s: 6.0,
            kind: CommandChangeName::HandedOver,
            by: "anna".to_owned(),
            from: Some("anna".to_owned()),
            to: Some("bob".to_owned()),
        });
        let lines: Vec<String> = changes(&before, &after).iter().map(StateChange::line).collect();
        let expected = ["the survey has ended", "the budget is 700 bit/s", "anna handed command over to bob"];
        assert_eq!(lines, expected.map(|line| format!("       6 s  {line}")));
    }

    #[test]
    fn a_line_has_number_times_kind_vehicle_text_and_author() {
        let entry = LogLine {
            number: 7,
            at_s: 65.0,
            utc: "2026-11-23T10:00:00Z".to_owned(),
            vehicle: Some(2),
            kind: "order".to_owned(),
            by: Some("anna".to_owned()),
            text: "hold".to_owned(),
        };
        assert_eq!(line(&entry), "    7  2026-11-23T10:00:00Z  1 min 05 s  order    vehicle 2: hold (by anna)");
    }

    #[test]
    fn the_query_has_what_was_selected() {
        assert_eq!(LogSelection::default().query(None), "");
        let selection = LogSelection { kind: Some("order".to_owned()), since: Some(7) };
        assert_eq!(selection.query(Some(2)), "?vehicle=2&kind=order&since=7");
    }
}
