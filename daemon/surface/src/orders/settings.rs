//! Settings of a vehicle as the operator types them.

use crate::refusal::OrderRefusal;
use scenecast_protocol::directive::{AtEnd, CellBand, Change, PlannerKind, Registration, Settings, ShortDecimal};
use scenecast_protocol::map::{LayerMask, LayerSet};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Settings as they are typed. A value that is left out or null stays as it is on the vehicle; 0 or an empty text is as
/// configured there. Numbers have three significant digits.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SettingsOrder {
    /// The planner: lawnmower, greedy or horizon.
    #[schemars(extend("enum" = ["lawnmower", "greedy", "horizon", "", null]))]
    pub planner: Option<String>,
    /// What an adaptive survey does once no look pays any more: repeat (explore the rest of the area, then look at the
    /// favoured labels again), explore (explore the rest, then hold) or hold.
    #[schemars(extend("enum" = ["repeat", "explore", "hold", "", null]))]
    pub at_end: Option<String>,
    /// Whether images place the frames of the camera on the map: on, or off for odometry and compass alone.
    #[schemars(extend("enum" = ["on", "off", "", null]))]
    pub registration: Option<String>,
    /// The cells of the map that are sent: fine (all), coarse (every fourth in both directions), or coarse-to-fine (the
    /// coarse ones first where the backlog is large). The scene model keeps all cells.
    #[schemars(extend("enum" = ["fine", "coarse-to-fine", "coarse", "", null]))]
    pub cells: Option<String>,
    /// The layers that are sent in addition to the labels: none, or names of layers in any order, separated by commas.
    pub layers: Option<String>,
    /// Preference for topics that are common elsewhere in the map, 1e-9 to 1e3. Alpha, beta and gamma have an effect on the labels only
    /// where these are topics.
    #[schemars(range(min = 0.0, max = 1e3))]
    pub alpha: Option<f64>,
    /// Prior weight of each word in a topic, 1e-9 to 1e3.
    #[schemars(range(min = 0.0, max = 1e3))]
    pub beta: Option<f64>,
    /// Weight of a new topic, 1e-12 to 1e3.
    #[schemars(range(min = 0.0, max = 1e3))]
    pub gamma: Option<f64>,
    /// Words resampled a second of mission time, 1 to 1e8.
    #[schemars(range(min = 0.0, max = 1e8))]
    pub refine_words_per_s: Option<f64>,
    /// Maximum number of camera frames a second that are mapped, 0.01 to 30.
    #[schemars(range(min = 0.0, max = 30.0))]
    pub frames_per_s: Option<f64>,
    /// Most labels that the map tells apart at one time, 2 to 32, where labels are habitats.
    #[schemars(range(max = 32))]
    pub labels: Option<u8>,
}

/// The layers of these names, separated by commas; `None` if one is unknown or named twice.
fn layer_mask(names: &str, layers: &LayerSet) -> Option<LayerMask> {
    let names: Vec<&str> = if names == "none" { Vec::new() } else { names.split(',').map(str::trim).collect() };
    layers.mask(names.iter().copied()).ok().filter(|mask| mask.iter().count() == names.len())
}

fn layer_names(mask: LayerMask, layers: &LayerSet) -> String {
    let names: Vec<String> = mask.iter().map(|id| layers.name(id)).collect();
    if names.is_empty() { "none".to_owned() } else { names.join(",") }
}

impl SettingsOrder {
    /// Converts the order into the content of the slot.
    pub fn read(&self, layers: &LayerSet) -> Result<Settings, OrderRefusal> {
        let names: Vec<&str> = layers.iter().map(|(_, layer)| &*layer.name).collect();
        let mut settings = Settings {
            planner: choice("planner", &self.planner, PlannerKind::from_name, "lawnmower, greedy or horizon")?,
            at_end: choice("at_end", &self.at_end, AtEnd::from_name, "repeat, explore or hold")?,
            registration: choice("registration", &self.registration, Registration::from_name, "on or off")?,
            cells: choice("cells", &self.cells, CellBand::from_name, "fine, coarse-to-fine or coarse")?,
            layers: choice(
                "layers",
                &self.layers,
                |names| layer_mask(names, layers),
                &format!("none, or different ones of {}", names.join(", ")),
            )?,
            labels: match self.labels {
                None => Change::Keep,
                Some(0) => Change::Configured,
                Some(labels) => Change::To(labels),
            },
            ..Settings::default()
        };
        settings.check()?;
        let given = [self.alpha, self.beta, self.gamma, self.refine_words_per_s, self.frames_per_s];
        let mut changes = [Change::Keep; 5];
        for ((change, value), (name, _, range)) in changes.iter_mut().zip(given).zip(settings.numbers()) {
            *change = match value {
                None => Change::Keep,
                Some(0.0) => Change::Configured,
                Some(value) => {
                    let figure = ShortDecimal::new(value).filter(|figure| range.contains(&figure.value()));
                    let (least, most) = (*range.start(), *range.end());
                    Change::To(figure.ok_or(OrderRefusal::Setting { name, value, least, most })?)
                }
            };
        }
        [settings.alpha, settings.beta, settings.gamma, settings.refine_words_per_s, settings.frames_per_s] = changes;
        Ok(settings)
    }
}

fn choice<T>(
    what: &'static str,
    name: &Option<String>,
    find: impl Fn(&str) -> Option<T>,
    allowed: &str,
) -> Result<Change<T>, OrderRefusal> {
    match name.as_deref() {
        None => Ok(Change::Keep),
        Some("") => Ok(Change::Configured),
        Some(name) => {
            let found = find(name).map(Change::To);
            let (name, allowed) = (name.to_owned(), allowed.to_owned());
            found.ok_or(OrderRefusal::Choice { what, name, allowed })
        }
    }
}

impl SettingsOrder {
    /// Settings as a person would type them, with the names of these layers.
    pub fn of(settings: &Settings, layers: &LayerSet) -> Self {
        fn typed<T, U>(change: Change<T>, configured: U, format: impl FnOnce(T) -> U) -> Option<U> {
            match change {
                Change::Keep => None,
                Change::Configured => Some(configured),
                Change::To(value) => Some(format(value)),
            }
        }
        let text = |name: &str| name.to_owned();
        let figure = |change| typed(change, 0.0, ShortDecimal::value);
        Self {
            planner: typed(settings.planner, String::new(), |p| text(p.name())),
            at_end: typed(settings.at_end, String::new(), |choice| text(choice.name())),
            registration: typed(settings.registration, String::new(), |choice| text(choice.name())),
            cells: typed(settings.cells, String::new(), |c| text(c.name())),
            layers: typed(settings.layers, String::new(), |mask| layer_names(mask, layers)),
            alpha: figure(settings.alpha),
            beta: figure(settings.beta),
            gamma: figure(settings.gamma),
            refine_words_per_s: figure(settings.refine_words_per_s),
            frames_per_s: figure(settings.frames_per_s),
            labels: typed(settings.labels, 0, |labels| labels),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenecast_protocol::map::BUILT_IN_LAYERS;

    fn read(json: &str) -> Result<Settings, String> {
        let order: SettingsOrder = serde_json::from_str(json).map_err(|e| e.to_string())?;
        order.read(&LayerSet::default()).map_err(|e| e.to_string())
    }

    #[test]
    fn invalid_settings_are_refused_with_the_allowed_values() {
        let refused = |json: &str| read(json).unwrap_err();
        assert_eq!(refused(r#"{"alpha": 5000}"#), "alpha 5000: it takes 0.000000001 to 1000, or 0 as configured");
        assert_eq!(refused(r#"{"gamma": -1}"#), "gamma -1: it takes 0.000000000001 to 1000, or 0 as configured");
        assert_eq!(
            refused(r#"{"frames_per_s": 0.001}"#),
            "frames_per_s 0.001: it takes 0.01 to 30, or 0 as configured"
        );
        assert_eq!(
            refused(r#"{"refine_words_per_s": 0.5}"#),
            "refine_words_per_s 0.5: it takes 1 to 100000000, or 0 as configured"
        );
        assert_eq!(
            refused(r#"{"cells": "huge"}"#),
            "cells \"huge\": it takes fine, coarse-to-fine or coarse, or \"\" as configured"
        );
        let names: Vec<&str> = BUILT_IN_LAYERS.iter().map(|layer| &*layer.descriptor.name).collect();
        let allowed = format!("none, or different ones of {}", names.join(", "));
        for layers in ["perplexity", "depth,depth", "depth,", "none,depth"] {
            let said = refused(&format!(r#"{{"layers": "{layers}"}}"#));
            assert!(said.contains(&allowed), "{said}");
        }
        assert_eq!(
            refused(r#"{"registration": "no"}"#),
            "registration \"no\": it takes on or off, or \"\" as configured"
        );
        assert!(refused(r#"{"planner": "random"}"#).contains("lawnmower, greedy or horizon"));
        assert!(refused(r#"{"delta": 1}"#).contains("unknown field `delta`"));
    }

    #[test]
    fn an_order_is_shown_as_it_was_typed() {
        let typed = r#"{"planner":"","registration":"off","cells":"coarse","layers":"depth","alpha":0.05,"gamma":0.0,"frames_per_s":0.2}"#;
        let order: SettingsOrder = serde_json::from_str(typed).unwrap();
        assert_eq!(SettingsOrder::of(&order.read(&LayerSet::default()).unwrap(), &LayerSet::default()), order);
        let layers = |names: &str| read(&format!(r#"{{"layers": "{names}"}}"#)).unwrap();
        let told = |names: &str| SettingsOrder::of(&layers(names), &LayerSet::default()).layers.unwrap();
        assert_eq!(["none", "curiosity, depth"].map(told), ["none", "depth,curiosity"]);
        assert_eq!(read("{}").unwrap(), Settings::default());
    }

    #[test]
    fn allowed_ranges_are_those_of_the_configuration() {
        use scenecast_config::Key;
        let keys = ["scene.alpha", "scene.beta", "scene.gamma", "scene.refine_words_per_s", "camera.rate_hz"];
        for (name, (_, _, range)) in keys.into_iter().zip(Settings::default().numbers()) {
            let key = Key::find(name).unwrap();
            // A configuration can set 0 words a second, for no refinement.
            let low = if name == "scene.refine_words_per_s" { 0.0 } else { *range.start() };
            assert_eq!(key.rule.range, (low, *range.end()), "{name}");
        }
    }
}
