//! Settings of the scene model that fit a budget, as the API tells them.

use super::answer::Ask;
use super::server::{Shared, VehicleId, refusal};
use axum::extract::{Query, State};
use axum::http::StatusCode;
use axum::response::Response;
use scenecast_core::tuning_table::{self, Row};
use scenecast_protocol::wire::Address;
use scenecast_surface::{SettingsOrder, Surface};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Most bits a second that may be asked about.
const MOST_BPS: f64 = 1e7;

/// The setting that tells most of those whose stream fits, and what it gives up. Figures come from the surface's tuning table:
/// they hold for a sea floor and a survey like those that it was measured with.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Fit {
    /// Bits a second that the stream of the map may take.
    pub bits_per_s: f64,
    /// The setting with the highest mutual information that fits; null if none does.
    pub chosen: Option<Fitted>,
    /// The setting with the highest mutual information.
    pub best: Fitted,
    /// The setting with the smallest stream.
    pub leanest: Fitted,
    /// What is given up against the best, or that none fits: one line for people.
    pub given_up: String,
}

/// A setting with what it reaches.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Fitted {
    /// As an order; what it leaves null does not matter to the map's stream.
    pub settings: SettingsOrder,
    /// Of labels and annotated classes, nats.
    pub mutual_information_nats: f64,
    /// What the best setting tells more, nats.
    pub lost_nats: f64,
    /// Different labels on the map.
    pub labels: usize,
    /// Bits a second of the map's stream.
    pub stream_bps: f64,
}

impl Fitted {
    fn new(fit: &tuning_table::Fit, row: &Row) -> Self {
        let (s, m) = (&row.setting, &row.measurement);
        Self {
            settings: SettingsOrder {
                cells: Some(s.cells.name().to_owned()),
                alpha: Some(s.alpha),
                beta: Some(s.beta),
                gamma: Some(s.gamma),
                // 0 would ask for what is configured.
                refine_words_per_s: Some(s.refine_words_per_s.max(1.0)),
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

/// What fits so many bits a second, or the map's share of a vehicle's budget.
pub(super) fn fit(surface: &Surface, vehicle: Address, cell_m: f64, bits_per_s: Option<f64>) -> Result<Fit, String> {
    let bits_per_s = bits_per_s.unwrap_or_else(|| surface.map_bits_per_s(vehicle));
    let fit = surface.fit(cell_m, bits_per_s).map_err(|e| e.to_string())?;
    Ok(Fit {
        bits_per_s,
        chosen: fit.chosen.as_ref().map(|row| Fitted::new(&fit, row)),
        best: Fitted::new(&fit, &fit.best),
        leanest: Fitted::new(&fit, &fit.leanest),
        given_up: fit.said(),
    })
}

/// Serves it.
pub(super) async fn read(
    State(shared): State<Shared>,
    VehicleId(id): VehicleId,
    Query(query): Query<BTreeMap<String, String>>,
) -> Response {
    let asked = query.get("bits_per_s").map(|text| (text, text.parse().ok().filter(|b| (1.0..=MOST_BPS).contains(b))));
    match asked {
        Some((text, None)) => {
            let why = format!("bits_per_s {text:?}: it takes 1 to {MOST_BPS}");
            refusal(StatusCode::UNPROCESSABLE_ENTITY, &why)
        }
        Some((_, bits_per_s)) => shared.ask(Ask::Fit(id, bits_per_s)).await,
        None => shared.ask(Ask::Fit(id, None)).await,
    }
}
