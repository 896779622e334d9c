//! Weights, budget, weighted areas, the destination, and who has command.

use super::constraints::{OrderView, degrees, send, slot};
use super::names;
use super::session::{Session, follow};
use super::text::{self, span};
use scenecast_core::UserError;
use scenecast_files::{AreaShape, CoordinateFrame, read_areas};
use scenecast_surface::state::{CommandState, DryRun, MissionState, PrincipalInfo};
use scenecast_surface::{
    AreaOrder, AreasOrder, BudgetOrder, CommandOrder, DestinationOrder, SharesOrder, UtilityOrder,
};
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;

/// A change of the budget.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct BudgetChange {
    /// Bits on air a second; `None` leaves it unchanged.
    pub bits_per_s: Option<u32>,
    /// Minimum shares in percent by class; classes that are not listed stay unchanged.
    pub shares: BTreeMap<String, u8>,
    /// The background streams in order; `None` leaves them unchanged.
    pub background: Option<Vec<String>>,
}

/// Prints the last weights sent.
pub async fn show_utility(session: &Session) -> Result<(), UserError> {
    let state = session.state().await?;
    let vehicle = session.choose(&state)?;
    let weights = vehicle.labels.iter().filter(|l| l.weight != 0.0).map(|l| (l.id.to_string(), l.weight)).collect();
    let order = UtilityOrder {
        weights,
        exploration: vehicle.orders.utility.exploration,
        curiosity: vehicle.orders.utility.curiosity,
    };
    session.print(&order, || {
        let weighted = vehicle.labels.iter().filter(|l| l.weight != 0.0);
        let name = |name: &Option<String>| name.as_ref().map(|name| format!(" ({name})")).unwrap_or_default();
        let weights = weighted.map(|l| format!("label {}{}: {:.2}\n", l.id, name(&l.book.name), l.weight));
        format!("{}unexplored cells: {:.2}\n", weights.collect::<String>(), order.exploration)
    })
}

/// Sends weights of labels, by number or by name, which stands also for labels that are merged into its own. Labels that are not
/// listed keep their last weight if `keep`, else they get 0.
pub async fn set_utility(
    session: &Session,
    weights: &[(String, f64)],
    exploration: Option<f64>,
    keep: bool,
) -> Result<(), UserError> {
    let (id, order) = utility_order(session, weights, exploration, keep).await?;
    let accepted = session.client.post(&format!("/api/v2/vehicles/{id}/utility"), &order).await?;
    follow(session, accepted).await
}

/// Prints what the vehicle would do by weights, and sends nothing.
pub async fn try_utility(
    session: &Session,
    weights: &[(String, f64)],
    exploration: Option<f64>,
    keep: bool,
) -> Result<(), UserError> {
    let (id, order) = utility_order(session, weights, exploration, keep).await?;
    let run: DryRun = session.client.post(&format!("/api/v2/vehicles/{id}/dry-run"), &order).await?;
    session.print(&run, || format!("{}\n{}\n", run.text, run.rests_on))
}

/// The number of the vehicle, and the weights for it.
async fn utility_order(
    session: &Session,
    weights: &[(String, f64)],
    exploration: Option<f64>,
    keep: bool,
) -> Result<(u8, UtilityOrder), UserError> {
    let state = session.state().await?;
    let vehicle = session.choose(&state)?;
    let mut given: BTreeMap<u8, f64> = BTreeMap::new();
    for (text, weight) in weights {
        for label in names::labels(&vehicle.label_book, text)? {
            if given.insert(label, *weight).is_some_and(|other| other != *weight) {
                return Err(UserError::Input(format!("{text}: label {label} has two weights")));
            }
        }
    }
    let mut order = UtilityOrder { weights: BTreeMap::new(), exploration: exploration.unwrap_or(0.0), curiosity: 0.0 };
    if keep {
        let last = vehicle.labels.iter().filter(|l| l.weight != 0.0).map(|l| (l.id.to_string(), l.weight));
        order.weights.extend(last);
        order.exploration = exploration.unwrap_or(vehicle.orders.utility.exploration);
        order.curiosity = vehicle.orders.utility.curiosity;
    }
    order.weights.extend(given.into_iter().map(|(label, w)| (label.to_string(), w)));
    Ok((vehicle.id, order))
}

/// Prints the budgets, the shares and the background streams.
pub async fn show_budget(session: &Session) -> Result<(), UserError> {
    let state = session.state().await?;
    let link = &state.link;
    let value =
        serde_json::json!({ "budget_bps": link.budget_bps, "shares": link.shares, "background": link.background });
    session.print(&value, || {
        let mut out = format!("surface    {} bit/s\n", link.budget_bps);
        for (v, s) in state.vehicles.iter().filter_map(|v| Some((v, v.status.as_ref()?))) {
            let age = text::span(state.now_s - s.at_s);
            out += &format!("vehicle {:<2} {} bit/s, reported {age} ago\n", v.id, s.budget_bps);
        }
        for (class, percent) in &link.shares {
            out += &format!("{class:<10} at least {percent} %\n");
        }
        out + &format!("background {}\n", text::background(link))
    })
}

/// Changes the budget of the surface and of all vehicles.
pub async fn set_budget(session: &Session, change: BudgetChange) -> Result<(), UserError> {
    let link = session.state().await?.link;
    if let Some(unknown) = change.shares.keys().find(|class| !link.shares.contains_key(*class)) {
        let classes: Vec<&str> = link.shares.keys().map(String::as_str).collect();
        return Err(UserError::Input(format!("--shares {unknown}: the classes are {}", classes.join(", "))));
    }
    let share = |class: &str| change.shares.get(class).or_else(|| link.shares.get(class)).copied().unwrap_or(0);
    let shares = SharesOrder {
        directive: share("directive"),
        status: share("status"),
        fix: share("fix"),
        map: share("map"),
        exemplar: share("exemplar"),
    };
    let shares = (!change.shares.is_empty()).then_some(shares);
    let budget_bps = change.bits_per_s.unwrap_or(link.budget_bps);
    let order = BudgetOrder { budget_bps, shares, background: change.background };
    let accepted = session.client.post("/api/v2/budget", &order).await?;
    follow(session, accepted).await
}

/// How to read a file of weighted areas.
#[derive(Debug, Clone, Copy)]
pub struct AreasFile<'a> {
    pub path: &'a Path,
    /// The coordinates are metres east and north of the origin.
    pub in_metres: bool,
}

/// Prints the last weighted areas sent and those in force.
pub async fn show_areas(session: &Session) -> Result<(), UserError> {
    let state = session.state().await?;
    let v = session.choose(&state)?;
    let view = OrderView { sent: &v.orders.areas, slot: slot(v, "areas"), in_force: &v.orders.areas_in_force };
    session.print(&view, || view.text(state.now_s, areas_text))
}

/// Sends the weighted areas of a GeoJSON file, or removes them all.
pub async fn set_areas(session: &Session, file: Option<AreasFile<'_>>) -> Result<(), UserError> {
    let state = session.state().await?;
    let v = session.choose(&state)?;
    let order = match file {
        Some(file) => {
            let frame = if file.in_metres { CoordinateFrame::Metres } else { degrees(&state)? };
            let area = |AreaShape { outline, weight }| AreaOrder { outline, weight };
            let order = AreasOrder { areas: read_areas(file.path, frame)?.into_iter().map(area).collect() };
            order.read().map_err(|line| UserError::file(file.path, line))?;
            order
        }
        None => AreasOrder::default(),
    };
    send(session, v, "areas", &order).await
}

/// Sends the vehicle to a place, metres in the world frame, or withdraws that order.
pub async fn go(session: &Session, place: Option<[f64; 2]>) -> Result<(), UserError> {
    let state = session.state().await?;
    let order = DestinationOrder { place };
    order.read().map_err(UserError::input)?;
    send(session, session.choose(&state)?, "destination", &order).await
}

fn areas_text(order: &AreasOrder) -> String {
    let mut out = String::new();
    for (number, area) in (1..).zip(&order.areas) {
        let corners: Vec<String> = area.outline.iter().map(|[x, y]| format!(" E {x:.1} N {y:.1}")).collect();
        let _ = writeln!(out, "  area {number}  {:+.2} {}", area.weight, corners.join(","));
    }
    if out.is_empty() { "  no weighted areas\n".to_owned() } else { out }
}

/// The client's principal, and who has command.
#[derive(Debug, Serialize)]
struct CommandView<'a> {
    now_s: f64,
    you: &'a PrincipalInfo,
    #[serde(flatten)]
    command: &'a CommandState,
}

/// Prints who has command, who requests it, and the actions that are possible.
pub async fn show_command(session: &Session) -> Result<(), UserError> {
    let state = session.state().await?;
    let (bytes, _) = session.client.get("/api/v2/principal").await?;
    let you: PrincipalInfo = serde_json::from_slice(&bytes).map_err(|e| session.client.unreadable(&e))?;
    let view = CommandView { now_s: state.now_s, you: &you, command: &state.command };
    session.print(&view, || view_text(&state, &you, session.client.name()))
}

/// Requests command, hands it over, takes it or gives it up.
pub async fn change_command(session: &Session, order: &CommandOrder) -> Result<(), UserError> {
    let command: CommandState = session.client.post("/api/v2/command", order).await?;
    session.print(&command, || match &command.holder {
        Some(holder) => format!("{} has command\n", holder.name),
        None => "nobody has command\n".to_owned(),
    })
}

fn view_text(state: &MissionState, you: &PrincipalInfo, client: &str) -> String {
    let command = &state.command;
    let mut out = format!("command    {}\n", text::command(command, state.now_s));
    let _ = writeln!(out, "you        {}, {}", you.name, text::role(you.role));
    for request in &command.requests {
        let _ = writeln!(out, "requested  by {} {} ago", request.name, span(state.now_s - request.at_s));
    }
    let remedy = match &command.holder {
        None => "the first order takes it",
        Some(holder) if holder.name == you.name => match &holder.client {
            Some(name) if name != client => "move it here with: scenecast ctl command take",
            _ => "hand it over with hand-over NAME, or give it up with release",
        },
        Some(holder) if state.now_s >= holder.takeable_s => "take it with: scenecast ctl command take",
        Some(_) => "request it with: scenecast ctl command request",
    };
    let _ = writeln!(out, "possible   {remedy}");
    for change in &command.history {
        let _ = writeln!(out, "{:>10}  {}", span(change.at_s), text::command_change(change));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenecast_surface::state::{CommandHolderState, PrincipalRole};

    #[test]
    fn the_text_names_the_holder_and_the_possible_actions() {
        let you = PrincipalInfo { name: "bob".to_owned(), role: PrincipalRole::Operator };
        let mut state = MissionState { now_s: 160.0, ..MissionState::default() };
        assert!(view_text(&state, &you, "ctl").contains("nobody has it\n"));
        state.command.holder = Some(CommandHolderState {
            name: "anna".to_owned(),
            role: PrincipalRole::Operator,
            client: Some("page-1".to_owned()),
            since_s: 30.0,
            last_active_s: 100.0,
            takeable_s: 220.0,
        });
        let text = view_text(&state, &you, "ctl");
        assert!(
            text.contains("anna (page-1) for 2 min 10 s, last active 1 min 00 s ago; free to take in 1 min 00 s"),
            "{text}"
        );
        assert!(text.contains("you        bob, operator") && text.contains("command request"), "{text}");
        let elsewhere = view_text(&state, &PrincipalInfo { name: "anna".to_owned(), ..you.clone() }, "ctl");
        assert!(elsewhere.contains("move it here with: scenecast ctl command take"), "{elsewhere}");
        state.now_s = 221.0;
        assert!(view_text(&state, &you, "ctl").contains("command take"));
    }
}
