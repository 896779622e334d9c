//! What is new between two states.

use super::figures::{self, is_silent, mode, slot, span};
use crate::state::{ExemplarState, Picture, State, Vehicle};
use serde::Serialize;

/// A change.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Change {
    /// When it was seen, mission time.
    pub(super) t_s: f64,
    /// Of which vehicle; null: of the surface.
    pub(super) vehicle: Option<u8>,
    /// What changed: mission, vehicle, mode, silence, map, label, directive, exemplar, budget.
    pub(super) what: &'static str,
    /// The change in words.
    pub(super) text: String,
}

impl Change {
    /// The change as a line.
    pub(super) fn line(&self) -> String {
        let whose = self.vehicle.map_or(String::new(), |id| format!("vehicle {id}: "));
        format!("{:>10}  {whose}{}", span(self.t_s), self.text)
    }
}

/// What is there to begin with.
pub(super) fn first(state: &State) -> Vec<Change> {
    let text = format!("mission {}, {} vehicles", state.mission.name, state.vehicles.len());
    vec![Change { t_s: state.now_s, vehicle: None, what: "mission", text }]
}

/// What has changed.
pub(super) fn changes(before: &State, after: &State) -> Vec<Change> {
    let mut all = Vec::new();
    let mut add = |vehicle, what, text| all.push(Change { t_s: after.now_s, vehicle, what, text });
    if before.mission.id != after.mission.id {
        add(None, "mission", "the surface has restarted".to_owned());
    }
    if after.mission.ended && !before.mission.ended {
        add(None, "mission", "the survey is over".to_owned());
    }
    if before.link.budget_bps != after.link.budget_bps {
        add(None, "budget", format!("the budget is {} bit/s", after.link.budget_bps));
    }
    if before.link.shares != after.link.shares {
        let shares: Vec<String> = after.link.shares.iter().map(|(c, p)| format!("{c} {p} %")).collect();
        add(None, "budget", format!("the shares are {}", shares.join(", ")));
    }
    if before.link.background != after.link.background {
        add(None, "budget", format!("left-over bits go to {}", figures::spend(&after.link)));
    }
    for new in &after.vehicles {
        match before.vehicles.iter().find(|v| v.id == new.id) {
            None => add(Some(new.id), "vehicle", format!("{} is there", new.name)),
            Some(old) => of_vehicle((old, before), (new, after), &mut |what, text| add(Some(new.id), what, text)),
        }
    }
    all
}

fn of_vehicle(
    (old, before): (&Vehicle, &State),
    (new, after): (&Vehicle, &State),
    add: &mut dyn FnMut(&'static str, String),
) {
    match (is_silent(old, before), is_silent(new, after)) {
        (false, true) => add("silence", format!("silent, expected within {}", span(new.expected_interval_s))),
        (true, false) => add("silence", "heard again".to_owned()),
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
    for label in &new.labels {
        let Some(was) = old.labels.iter().find(|l| l.id == label.id) else {
            add("label", format!("label {} appeared", label.id));
            continue;
        };
        let (was, is) = (&was.exemplar, &label.exemplar);
        let is_new = |p: &&Picture| !p.asked && was.pictures.iter().all(|old| old.picture != p.picture);
        for p in is.pictures.iter().filter(is_new) {
            add("exemplar", format!("image of label {} came unasked, {} bytes", label.id, p.bytes));
        }
        if (was.state, was.progress) != (is.state, is.progress)
            || was.at_s != is.at_s && is.state == ExemplarState::Here
        {
            let state = serde_json::to_value(is.state).unwrap_or_default();
            let state = state.as_str().unwrap_or_default().replace('_', " ");
            add("exemplar", format!("image of label {}: {state}, {:.0} %", label.id, 100.0 * is.progress));
        }
    }
    for s in &new.directive.slots {
        let was = old.directive.slots.iter().find(|o| o.slot == s.slot);
        if was.is_none_or(|w| (w.version, w.state) != (s.version, s.state)) {
            add("directive", format!("{} {}", s.slot, slot(s)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_stays_the_same_is_no_change_and_what_does_not_is_one() {
        let before = State { now_s: 5.0, ..State::default() };
        let mut after = State { now_s: 6.0, ..before.clone() };
        assert_eq!(changes(&before, &after), []);
        after.link.budget_bps = 700;
        after.mission.ended = true;
        let told: Vec<String> = changes(&before, &after).iter().map(Change::line).collect();
        assert_eq!(told, ["       6 s  the survey is over", "       6 s  the budget is 700 bit/s"]);
    }
}
