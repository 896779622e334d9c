//! Settings of a vehicle: shown, sent, or picked to fit a budget.

use super::{Ctl, figures};
use crate::fit::{Fit, Fitted};
use crate::state::Vehicle;
use scenecast_core::UserError;
use scenecast_surface::SettingsOrder;

/// What is to be sent.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SettingsChange {
    /// What is named.
    pub order: SettingsOrder,
    /// Whether the rest is to fit a budget: bits a second, or none for the map's share.
    pub fit: Option<Option<f64>>,
    /// Whether to say what would be sent, and to send nothing.
    pub dry_run: bool,
}

impl Ctl {
    /// Sends settings, or prints those asked for and in force if there is nothing to send.
    pub async fn settings(&self, change: SettingsChange) -> Result<(), UserError> {
        let state = self.state().await?;
        let vehicle = self.choose(&state)?;
        if change == SettingsChange::default() {
            return self.tell(&vehicle.settings, || table(vehicle));
        }
        // The refusal of what no vehicle could obey needs no surface.
        change.order.read().map_err(UserError::Input)?;
        let order = match change.fit {
            None => change.order,
            Some(bits_per_s) => {
                let (fit, chosen) = self.fit(vehicle.id, bits_per_s).await?;
                eprintln!("fits {:.0} bit/s with {:.0} bit/s: {}", fit.bits_per_s, chosen.stream_bps, fit.given_up);
                merged(change.order, chosen.settings)
            }
        };
        if change.dry_run {
            return self.tell(&order, || lines(&order, |name, value| format!("{name:<20} {value}\n")));
        }
        let accepted = self.client.post(&format!("/api/v1/vehicles/{}/settings", vehicle.id), &order).await?;
        self.follow(accepted).await
    }

    async fn fit(&self, vehicle: u8, bits_per_s: Option<f64>) -> Result<(Fit, Fitted), UserError> {
        let query = bits_per_s.map_or(String::new(), |b| format!("?bits_per_s={b}"));
        let (bytes, _) = self.client.get(&format!("/api/v1/vehicles/{vehicle}/fit{query}")).await?;
        let fit: Fit = serde_json::from_slice(&bytes).map_err(|e| self.client.unlike(&e))?;
        let chosen = fit.chosen.clone().ok_or_else(|| UserError::Failed(fit.given_up.clone()))?;
        Ok((fit, chosen))
    }
}

/// What is named goes before what fits.
fn merged(named: SettingsOrder, fitting: SettingsOrder) -> SettingsOrder {
    SettingsOrder {
        planner: named.planner.or(fitting.planner),
        cells: named.cells.or(fitting.cells),
        layers: named.layers.or(fitting.layers),
        alpha: named.alpha.or(fitting.alpha),
        beta: named.beta.or(fitting.beta),
        gamma: named.gamma.or(fitting.gamma),
        refine_words_per_s: named.refine_words_per_s.or(fitting.refine_words_per_s),
        frames_per_s: named.frames_per_s.or(fitting.frames_per_s),
    }
}

/// Name and value of each setting that an order names.
fn named(order: &SettingsOrder) -> [(&'static str, Option<String>); 8] {
    let text = |value: &Option<String>| value.as_ref().map(|v| if v.is_empty() { configured() } else { v.clone() });
    let number = |value: Option<f64>| value.map(|v| if v == 0.0 { configured() } else { v.to_string() });
    [
        ("planner", text(&order.planner)),
        ("cells", text(&order.cells)),
        ("layers", text(&order.layers)),
        ("alpha", number(order.alpha)),
        ("beta", number(order.beta)),
        ("gamma", number(order.gamma)),
        ("refine_words_per_s", number(order.refine_words_per_s)),
        ("frames_per_s", number(order.frames_per_s)),
    ]
}

fn configured() -> String {
    "as configured".to_owned()
}

fn lines(order: &SettingsOrder, line: impl Fn(&str, &str) -> String) -> String {
    named(order).iter().filter_map(|(name, value)| Some(line(name, value.as_ref()?))).collect()
}

fn table(vehicle: &Vehicle) -> String {
    let settings = &vehicle.settings;
    let unnamed = || "as it was".to_owned();
    let in_force = settings.in_force.as_ref().map(named);
    let mut out = format!("{:<20} {:<26} in force\n", "setting", "asked for");
    for (index, (name, asked)) in named(&settings.asked).into_iter().enumerate() {
        let in_force = match &in_force {
            Some(values) => values[index].1.clone().unwrap_or_else(unnamed),
            None => "not known".to_owned(),
        };
        out += &format!("{name:<20} {:<26} {in_force}\n", asked.unwrap_or_else(unnamed));
    }
    let slot = vehicle.directive.slots.iter().find(|s| s.slot == "settings");
    out + &slot.map_or("nothing sent by this surface yet\n".to_owned(), |s| format!("{}\n", figures::slot(s)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_named_goes_before_what_fits() {
        let fitting =
            SettingsOrder { alpha: Some(0.1), gamma: Some(1e-4), cells: Some("coarse".into()), ..Default::default() };
        let named = SettingsOrder { alpha: Some(0.0), layers: Some(String::new()), ..Default::default() };
        let order = merged(named, fitting);
        assert_eq!((order.alpha, order.gamma, order.cells.as_deref()), (Some(0.0), Some(1e-4), Some("coarse")));
        let said = lines(&order, |name, value| format!("{name} {value}; "));
        assert_eq!(said, "cells coarse; layers as configured; alpha as configured; gamma 0.0001; ");
    }
}
