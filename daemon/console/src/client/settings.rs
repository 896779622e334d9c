//! Settings of a vehicle: shown, sent, or fitted to a budget.

use super::session::{Session, follow};
use super::text;
use scenecast_core::UserError;
use scenecast_protocol::map::{BUILT_IN_LAYERS, LayerDescriptor, LayerSet};
use scenecast_surface::SettingsOrder;
use scenecast_surface::fit::{Fit, FittedSettings};
use scenecast_surface::state::{MissionState, VehicleState};

#[derive(Debug, Clone, PartialEq, Default)]
pub struct SettingsChange {
    pub order: SettingsOrder,
    /// Whether to fit the other settings to a budget: bit/s, or `None` for the share of the map.
    pub fit: Option<Option<f64>>,
    /// Whether to print the order instead of sending it.
    pub dry_run: bool,
}

/// Sends settings, or prints those requested and in force if there is no change.
pub async fn change_settings(session: &Session, change: SettingsChange) -> Result<(), UserError> {
    let state = session.state().await?;
    let vehicle = session.choose(&state)?;
    if change == SettingsChange::default() {
        return session.print(&vehicle.orders.settings, || table(vehicle));
    }
    // An order that no vehicle can obey is refused before a fit is requested.
    change.order.read(&layers_of(&state)).map_err(UserError::input)?;
    let order = match change.fit {
        None => change.order,
        Some(bits_per_s) => {
            let (fit, chosen) = fit(session, vehicle.id, bits_per_s).await?;
            eprintln!("fits {:.0} bit/s with {:.0} bit/s: {}", fit.bits_per_s, chosen.stream_bps, fit.trade_off);
            merged(change.order, chosen.settings)
        }
    };
    if change.dry_run {
        return session.print(&order, || lines(&order, |name, value| format!("{name:<20} {value}\n")));
    }
    let accepted = session.client.post(&format!("/api/v2/vehicles/{}/settings", vehicle.id), &order).await?;
    follow(session, accepted).await
}

/// The layers that the surface knows by name; their meaning is of no use here.
fn layers_of(state: &MissionState) -> LayerSet {
    let mut layers = LayerSet::default();
    for layer in &state.layers {
        let any = BUILT_IN_LAYERS[0].descriptor.clone();
        layers.add(LayerDescriptor { name: layer.name.clone().into(), ..any });
    }
    layers
}

async fn fit(session: &Session, vehicle: u8, bits_per_s: Option<f64>) -> Result<(Fit, FittedSettings), UserError> {
    let query = bits_per_s.map_or(String::new(), |b| format!("?bits_per_s={b}"));
    let (bytes, _) = session.client.get(&format!("/api/v2/vehicles/{vehicle}/fit{query}")).await?;
    let fit: Fit = serde_json::from_slice(&bytes).map_err(|e| session.client.unreadable(&e))?;
    let chosen = fit.chosen.clone().ok_or_else(|| UserError::Failed(fit.trade_off.clone()))?;
    Ok((fit, chosen))
}

/// The given settings, and fitted ones for the others.
fn merged(given: SettingsOrder, fitted: SettingsOrder) -> SettingsOrder {
    SettingsOrder {
        planner: given.planner.or(fitted.planner),
        at_end: given.at_end.or(fitted.at_end),
        registration: given.registration.or(fitted.registration),
        cells: given.cells.or(fitted.cells),
        layers: given.layers.or(fitted.layers),
        alpha: given.alpha.or(fitted.alpha),
        beta: given.beta.or(fitted.beta),
        gamma: given.gamma.or(fitted.gamma),
        refine_words_per_s: given.refine_words_per_s.or(fitted.refine_words_per_s),
        frames_per_s: given.frames_per_s.or(fitted.frames_per_s),
        labels: given.labels.or(fitted.labels),
    }
}

/// The name of each setting, and its value if the order has one.
fn values(order: &SettingsOrder) -> [(&'static str, Option<String>); 11] {
    let text = |value: &Option<String>| value.as_ref().map(|v| if v.is_empty() { configured() } else { v.clone() });
    let number = |value: Option<f64>| value.map(|v| if v == 0.0 { configured() } else { v.to_string() });
    [
        ("planner", text(&order.planner)),
        ("at_end", text(&order.at_end)),
        ("registration", text(&order.registration)),
        ("cells", text(&order.cells)),
        ("layers", text(&order.layers)),
        ("alpha", number(order.alpha)),
        ("beta", number(order.beta)),
        ("gamma", number(order.gamma)),
        ("refine_words_per_s", number(order.refine_words_per_s)),
        ("frames_per_s", number(order.frames_per_s)),
        ("labels", number(order.labels.map(f64::from))),
    ]
}

fn configured() -> String {
    "as configured".to_owned()
}

fn lines(order: &SettingsOrder, line: impl Fn(&str, &str) -> String) -> String {
    values(order).iter().filter_map(|(name, value)| Some(line(name, value.as_ref()?))).collect()
}

fn table(vehicle: &VehicleState) -> String {
    let settings = &vehicle.orders.settings;
    let unset = || "not set".to_owned();
    let in_force = settings.in_force.as_ref().map(values);
    let mut out = format!("{:<20} {:<26} in force\n", "setting", "requested");
    for (index, (name, requested)) in values(&settings.requested).into_iter().enumerate() {
        let in_force = match &in_force {
            Some(all) => all[index].1.clone().unwrap_or_else(unset),
            None => "unknown".to_owned(),
        };
        out += &format!("{name:<20} {:<26} {in_force}\n", requested.unwrap_or_else(unset));
    }
    let slot = vehicle.orders.directive.slots.iter().find(|s| s.slot == "settings");
    out + &slot.map_or("no settings sent by this surface yet\n".to_owned(), |s| format!("{}\n", text::order(s)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn given_settings_precede_fitted_ones() {
        let fitted =
            SettingsOrder { alpha: Some(0.1), gamma: Some(1e-4), cells: Some("coarse".into()), ..Default::default() };
        let given = SettingsOrder { alpha: Some(0.0), layers: Some(String::new()), ..Default::default() };
        let order = merged(given, fitted);
        assert_eq!((order.alpha, order.gamma, order.cells.as_deref()), (Some(0.0), Some(1e-4), Some("coarse")));
        let text = lines(&order, |name, value| format!("{name} {value}; "));
        assert_eq!(text, "cells coarse; layers as configured; alpha as configured; gamma 0.0001; ");
    }
}
