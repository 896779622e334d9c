//! Settings of the scene model that fit a budget.

use super::orders::SettingsOrder;
use super::surface::Surface;
use scenecast_core::tuning_table::{self, NoRow, Row};
use scenecast_protocol::wire::Address;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The most informative settings whose stream fits a budget, and the trade-off. The figures come from the tuning table of the
/// surface; they hold for a sea floor and a survey similar to those of its measurements.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Fit {
    /// The budget of the stream of the map, bit/s.
    pub bits_per_s: f64,
    /// The settings with the highest mutual information within the budget; null if none fit.
    pub chosen: Option<FittedSettings>,
    /// The settings with the highest mutual information.
    pub best: FittedSettings,
    /// The settings with the lowest rate.
    pub lowest_rate: FittedSettings,
    /// The loss in comparison with the best settings, or that no settings fit: one line for people.
    pub trade_off: String,
}

/// Settings with the figures that they reach.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FittedSettings {
    /// The settings as an order. A null member has no influence on the stream of the map.
    pub settings: SettingsOrder,
    /// Mutual information of labels and annotated classes, nats.
    pub mutual_information_nats: f64,
    /// The difference from the best settings, nats.
    pub lost_nats: f64,
    /// The number of different labels on the map.
    pub labels: usize,
    /// The rate of the stream of the map, bit/s.
    pub stream_bps: f64,
}

impl FittedSettings {
    fn new(fit: &tuning_table::Fit, row: &Row) -> Self {
        let (s, m) = (&row.setting, &row.measurement);
        let of_topics = |value: f64| (!s.is_of_habitats()).then_some(value);
        Self {
            settings: SettingsOrder {
                cells: Some(s.cells.name().to_owned()),
                alpha: of_topics(s.alpha),
                beta: of_topics(s.beta),
                gamma: of_topics(s.gamma),
                // 0 would mean as configured.
                refine_words_per_s: of_topics(s.refine_words_per_s.max(1.0)),
                labels: u8::try_from(s.max_labels).ok().filter(|_| s.is_of_habitats()),
                frames_per_s: Some(s.frames_per_s),
                ..SettingsOrder::default()
            },
            mutual_information_nats: m.mutual_information_nats,
            lost_nats: fit.lost_nats(row),
            labels: m.labels,
            stream_bps: m.stream_bps,
        }
    }
}

/// Settings that fit a budget in bit/s, by default the share of the map in the vehicle's budget.
pub(crate) fn fit(surface: &Surface, vehicle: Address, cell_m: f64, bits_per_s: Option<f64>) -> Result<Fit, NoRow> {
    let bits_per_s = bits_per_s.unwrap_or_else(|| surface.map_bits_per_s(vehicle));
    let fit = surface.fit(cell_m, bits_per_s)?;
    Ok(Fit {
        bits_per_s,
        chosen: fit.chosen.as_ref().map(|row| FittedSettings::new(&fit, row)),
        best: FittedSettings::new(&fit, &fit.best),
        lowest_rate: FittedSettings::new(&fit, &fit.lowest_rate),
        trade_off: fit.trade_off(),
    })
}
