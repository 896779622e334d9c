//! The summary of a dive in sentences.

use super::dive::{Dive, DiveVehicle};
use super::maps::MapsAt;
use super::order_step::OrderStep;
use super::words::{self, area, counted, interval};
use super::{extent, gaps, trouble, way};
use scenecast_core::utc_text;
use scenecast_messages::scenecast_msgs::OrderStatus;
use scenecast_protocol::directive::SlotId;
use scenecast_protocol::map::{Cell, UNEXPLORED};
use scenecast_protocol::wire::VehicleMode;
use scenecast_surface::state::{PrincipalRole, VehicleState};
use serde_json::Value;
use std::collections::BTreeMap;

/// A heading, and the sentences below it.
pub(super) type Part = (&'static str, Vec<String>);

/// Where, when, how long, how far, what was found, what was ordered and what failed.
pub(super) fn summary(dive: &Dive, state: &VehicleState, vehicle: &DiveVehicle) -> Vec<Part> {
    let dates = (dive.settings.is_rehearsal() && utc_text(dive.span_s.0).starts_with("2000-01-01"))
        .then(|| "Its dates mean nothing: a rehearsal in virtual time begins on 2000-01-01.".to_owned());
    let made_up = vehicle.made_up(dive).map(|what| format!("This was {what}."));
    let way = [when(dive, state, vehicle), way::place(dive, state, vehicle), way::equipment(dive, vehicle)];
    let alone = is_coarse(vehicle).then(|| alone(vehicle));
    let surveyed = surveyed(dive, state, vehicle);
    let map = [
        Some(found(state, vehicle, alone)),
        extent::of_map(dive, state, vehicle),
        extent::sea_floor(dive, state, vehicle),
        arrived(dive, state, vehicle, alone),
        agreement(vehicle, &surveyed),
        lag(dive, vehicle, &surveyed),
    ];
    let mut sent = vec![orders(dive, state, vehicle)];
    sent.extend(dive.link_sentences(vehicle));
    sent.extend(gaps::heard(dive, vehicle));
    sent.extend(trouble::modes(dive, state, vehicle));
    let refused = trouble::refused(dive, state, vehicle);
    let parts = [
        ("Where and when", made_up.into_iter().chain(dates).chain(way).collect()),
        ("What was found", map.into_iter().flatten().collect()),
        ("What was ordered and sent", sent),
        ("What went wrong", trouble::told(dive, state, vehicle)),
        ("What was refused", refused),
    ];
    parts.into_iter().filter(|(_, told)| !told.is_empty()).collect()
}

/// The moments of the comparison at which the vehicle surveyed, or all of them where its modes are not known.
fn surveyed(dive: &Dive, state: &VehicleState, vehicle: &DiveVehicle) -> Vec<MapsAt> {
    let modes = dive.mode_changes(state, vehicle);
    // After its record it may have been ended.
    let is_recorded = |at_s: f64| {
        let mut runs = vehicle.own.runs_s.iter();
        runs.len() == 0 || runs.any(|(from_s, to_s)| (*from_s..=*to_s).contains(&at_s))
    };
    let did_survey = |maps: &&MapsAt| is_recorded(maps.at_s) && modes.at(maps.at_s) == Some(VehicleMode::Survey.name());
    let surveyed: Vec<MapsAt> = vehicle.maps.iter().filter(did_survey).copied().collect();
    if surveyed.is_empty() { vehicle.maps.clone() } else { surveyed }
}

/// How far the operator's map was that of the vehicle, where its record says so.
fn agreement(vehicle: &DiveVehicle, surveyed: &[MapsAt]) -> Option<String> {
    let shares = |maps: &[MapsAt]| -> Vec<f64> {
        maps.iter().map(|maps| maps.agreement).filter(|share| share.is_finite()).collect()
    };
    let [all, surveyed] = [shares(&vehicle.maps), shares(surveyed)];
    let mean = |shares: &[f64]| shares.iter().sum::<f64>() / shares.len() as f64 * 100.0;
    let means = match surveyed.is_empty() || surveyed.len() == all.len() {
        true => format!("{:.0} % on average over the record", mean(&all)),
        false => {
            format!("{:.0} % on average while it surveyed, {:.0} % over the whole record", mean(&surveyed), mean(&all))
        }
    };
    all.last().map(|last| {
        format!(
            "Of the cells of the vehicle's map that were meant for the operator, {:.0} % had the same label on the operator's map at the end, \
             and {means}.",
            last * 100.0,
        )
    })
}

/// How far the operator's map was behind.
fn lag(dive: &Dive, vehicle: &DiveVehicle, surveyed: &[MapsAt]) -> Option<String> {
    let lags: Vec<f64> = surveyed.iter().map(|maps| maps.lag_s).filter(|lag_s| lag_s.is_finite()).collect();
    let (median_s, most) = (words::median(&lags)?, dive.mission_lasted(lags.iter().copied().fold(0.0, f64::max)));
    let median = dive.mission_lasted(median_s);
    let when = if surveyed.len() == vehicle.maps.len() { "over the record" } else { "while it surveyed" };
    Some(match vehicle.own.runs_s.is_empty() {
        false if median_s < 1.0 => format!(
            "Both records were compared at {1} moments {when}: at {0} of them no change of the vehicle's map was missing on the operator's; at \
             the worst one, changes had been missing for {most}.",
            lags.iter().filter(|lag_s| **lag_s < 1.0).count(),
            lags.len()
        ),
        true => format!(
            "By the surface's forecast of when all that waits on board will have been sent, {when} the operator's map was behind the vehicle's \
             by {median} or less half of the time; the longest forecast was {most}."
        ),
        false => format!(
            "Both records were compared at {} moments {when}: at half of them the operator's map had lacked changes of the vehicle's for \
             {median} or less, at the worst one for {most}.",
            lags.len()
        ),
    })
}

fn when(dive: &Dive, state: &VehicleState, vehicle: &DiveVehicle) -> String {
    let (begin, end) = dive.span_s;
    let speed = match dive.is_scaled() {
        true => format!(
            ", as it was played {:.1} times as fast as real time: times are those of the clock, with those of the mission in brackets, and speeds and \
             rates are those of the mission",
            dive.state.mission.speed
        ),
        false => String::new(),
    };
    let own_end_s = vehicle.own.runs_s.last().map(|run| run.1).filter(|own_s| (own_s - dive.surface_s.1).abs() > 5.0);
    let ends = own_end_s.map_or_else(String::new, |own_s| {
        format!(
            " (the surface's record ends at {}, the vehicle's own at {})",
            utc_text(dive.surface_s.1),
            utc_text(own_s)
        )
    });
    format!(
        "{} {} (address {}) cover {} to {}{ends}, {}{speed}; the vehicle reported its place {}.{}",
        if vehicle.own.runs_s.is_empty() { "The surface's records of" } else { "The records of the surface and of" },
        state.name,
        state.id,
        utc_text(begin),
        utc_text(end),
        dive.lasted(end - begin),
        counted(vehicle.track.len(), "time", "times"),
        people(dive)
    )
}

/// Who had access at the surface, where people had names there.
fn people(dive: &Dive) -> String {
    let role = |role: PrincipalRole| match role {
        PrincipalRole::Viewer => "viewer",
        PrincipalRole::Operator => "operator",
        PrincipalRole::Administrator => "administrator",
    };
    let named = dive.state.command.principals.iter().filter(|principal| principal.name != "local");
    let all: Vec<String> = named.map(|principal| format!("{} ({})", principal.name, role(principal.role))).collect();
    if all.is_empty() { String::new() } else { format!(" People with access at the surface: {}.", all.join(", ")) }
}

/// How much of the vehicle's map has arrived; `alone`: cells without a neighbour, if every fourth one was sent.
fn arrived(dive: &Dive, state: &VehicleState, vehicle: &DiveVehicle, alone: Option<u64>) -> Option<String> {
    let status = state.status.as_ref()?;
    let (reported, before_end_s) = (u64::from(status.cells), dive.span_s.1 - dive.unix_s(status.at_s));
    let held = vehicle.map.labels.explored() as u64;
    let share = (held as f64 / reported.max(1) as f64 * 100.0).min(100.0);
    let coarse = match alone {
        None => String::new(),
        Some(0) => {
            " As ordered or configured, only every fourth cell in each direction was sent at the end.".to_owned()
        }
        Some(alone) => format!(
            " As ordered or configured, only every fourth cell in each direction was sent at the end: {} for 16 and {} as one, so that \
             areas may be {} too small.",
            counted(alone as usize, "cell without a neighbour stands", "cells without a neighbour stand"),
            if alone == 1 { "counts" } else { "each count" },
            area(15.0 * alone as f64 * vehicle.map.cell_m * vehicle.map.cell_m)
        ),
    };
    (reported > 0).then(|| {
        format!(
            "In its last report{}, the vehicle had {reported} cells; {held} had arrived by the end{}.{coarse}",
            match before_end_s < 1.0 {
                true => String::new(),
                false => format!(", {} before the end of the record", dive.lasted(before_end_s)),
            },
            match held > reported {
                true => ", as it mapped and sent more after that".to_owned(),
                false => format!(", {share:.0} %"),
            }
        )
    })
}

/// Cells without any neighbour on the map.
fn alone(vehicle: &DiveVehicle) -> u64 {
    let labels = &vehicle.map.labels;
    let around = |cell: Cell| (-1..=1).flat_map(move |y| (-1..=1).map(move |x| Cell::new(cell.x + x, cell.y + y)));
    let is_alone = |cell: Cell| around(cell).filter(|near| labels.get(*near) != UNEXPLORED).count() == 1;
    labels.iter().filter(|(cell, _)| is_alone(*cell)).count() as u64
}

/// Whether the last order about it, or else the vehicle's configuration, was to send coarse cells only.
fn is_coarse(vehicle: &DiveVehicle) -> bool {
    let settings = vehicle.given.iter().filter(|((slot, _), _)| slot == SlotId::Settings.name());
    let ordered = settings.filter_map(|((_, version), order)| {
        let content = serde_json::from_str::<Value>(&order.content).ok()?;
        Some((*version, content.get("cells")?.clone()))
    });
    let last = ordered.max_by_key(|(version, _)| *version).map(|(_, cells)| cells).filter(|cells| !cells.is_null());
    let configured = || vehicle.own.settings.settings.get("map.cells").cloned();
    last.or_else(configured).is_some_and(|cells| cells == "coarse")
}

fn found(state: &VehicleState, vehicle: &DiveVehicle, alone: Option<u64>) -> String {
    let all: u64 = vehicle.map.classes.iter().map(|class| class.cells).sum();
    let Some(largest) = vehicle.map.classes.first() else { return "No part of the map arrived.".to_owned() };
    // Cells that were sent for 16 count as one.
    let is_least = alone.is_some_and(|alone| alone > 0);
    let doubt = largest.interval_m2.filter(|_| !is_least).map_or_else(String::new, |_| {
        format!("; 95 % interval by the model's own confidence: {}", interval(largest.interval_m2))
    });
    let confident = vehicle.map.layer_cells.get("confidence").copied().unwrap_or_default() as u64;
    let confident = match doubt.is_empty() || confident >= all {
        true => String::new(),
        false => format!(" (the confidence of {confident} of the {all} cells arrived)"),
    };
    let rivals = vehicle.map.classes.iter().skip(1).filter(|class| class.may_exceed(largest)).count();
    let rivals = match rivals {
        _ if is_least => String::new(),
        0 => String::new(),
        1 => " By these intervals one other class may be larger.".to_owned(),
        n => {
            format!(" By these intervals {n} other classes may be larger, so which one is the largest is not decided.")
        }
    };
    format!(
        "The map that arrived has {all} cells of {0:.2} m x {0:.2} m, {1}, with {2} classes; the largest is {3} with {4} ({5:.0} %){doubt}{confident}.{rivals}",
        vehicle.map.cell_m,
        area(all as f64 * vehicle.map.cell_m * vehicle.map.cell_m),
        vehicle.map.classes.len(),
        words::class(state, vehicle, largest.label),
        if is_least { format!("at least {}", area(largest.area_m2)) } else { area(largest.area_m2) },
        largest.cells as f64 / all as f64 * 100.0
    )
}

fn orders(dive: &Dive, state: &VehicleState, vehicle: &DiveVehicle) -> String {
    let ends = |status: u8| {
        let is_end = |way: &[OrderStep]| way.last().is_some_and(|last| last.status == status);
        vehicle.orders_of_people().filter(|(_, way)| is_end(way)).count()
    };
    let all = vehicle.orders_of_people().count();
    let fixes = vehicle.orders.len() - all;
    let mut of_author: BTreeMap<String, usize> = BTreeMap::new();
    for (order, _) in vehicle.orders_of_people() {
        *of_author.entry(dive.ordered(state, vehicle, order).0).or_default() += 1;
    }
    of_author.remove("");
    let authors: Vec<String> = match of_author.len() {
        1 => of_author.into_keys().collect(),
        _ => of_author.into_iter().map(|(author, count)| format!("{author} ({count})")).collect(),
    };
    let authors = if authors.is_empty() { String::new() } else { format!(" by {}", authors.join(", ")) };
    let fixes = match fixes {
        0 => " The surface sent no position fix.".to_owned(),
        _ => format!(" The surface sent {}.", counted(fixes, "position fix", "position fixes")),
    };
    match all {
        0 => format!("No order was given.{}{fixes}", not_sent(dive, state)),
        n => {
            let [applied, refused, withdrawn] =
                [OrderStatus::APPLIED, OrderStatus::REFUSED, OrderStatus::WITHDRAWN].map(ends);
            let replaced = vehicle.orders_of_people().filter(|(order, way)| vehicle.is_replaced(order, way)).count();
            let replaced_text = match replaced {
                0 => String::new(),
                n => format!(
                    " {n} had not been applied when a later one of its kind replaced {}.",
                    if n == 1 { "it" } else { "them" }
                ),
            };
            let unsent = vehicle.orders_of_people().filter(|(order, way)| {
                way.last().is_some_and(|last| last.status == OrderStatus::QUEUED) && !vehicle.is_replaced(order, way)
            });
            let unsent = unsent.count();
            let unsent_text = match unsent {
                0 => String::new(),
                n => format!(" {n} {} never sent.", if n == 1 { "was" } else { "were" }),
            };
            let open = match n - applied - refused - withdrawn - replaced - unsent {
                0 => replaced_text + &unsent_text,
                open => format!("{replaced_text}{unsent_text} The outcome of {open} is not known."),
            };
            let ends = [(applied, "applied"), (refused, "refused"), (withdrawn, "withdrawn")];
            let ends = ends.iter().filter(|(count, _)| *count > 0).map(|(count, end)| format!("{count} {end}"));
            let ends: Vec<String> = ends.collect();
            let ends = if ends.is_empty() { String::new() } else { format!("; {}", ends.join(", ")) };
            format!(
                "{} given{authors}{ends}.{open}{}{fixes}",
                counted(n, "order was", "orders were"),
                not_sent(dive, state)
            )
        }
    }
}

/// How many requests the surface refused itself.
fn not_sent(dive: &Dive, state: &VehicleState) -> String {
    match dive.not_sent(state).count() {
        0 => String::new(),
        n => format!(
            " The surface refused {} of people and did not send {}: see what was refused.",
            counted(n, "request", "requests"),
            if n == 1 { "it" } else { "them" }
        ),
    }
}
