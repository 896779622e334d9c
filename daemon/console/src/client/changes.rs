//! The differences between two states.

use super::text::{self, is_silent, mode, span};
use crate::state::{ExemplarImage, ExemplarStage, MissionState, VehicleState};
use serde::Serialize;

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
        format!("{:>10}  {vehicle}{}", span(self.t_s), self.text)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::state::{CommandChangeName, CommandChangeState};

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
}
