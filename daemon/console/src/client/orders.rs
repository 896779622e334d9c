//! Weights and budget.

use super::follow::follow;
use super::session::Session;
use super::text;
use crate::orders::{BudgetOrder, SharesOrder, UtilityOrder};
use scenecast_core::UserError;
use std::collections::BTreeMap;

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
        let weights = order.weights.iter().map(|(label, w)| format!("label {label}: {w:.2}\n"));
        format!("{}unexplored cells: {:.2}\n", weights.collect::<String>(), order.exploration)
    })
}

/// Sends weights. Labels that are not listed keep their last weight if `keep`, else they get 0.
pub async fn set_utility(
    session: &Session,
    weights: BTreeMap<u8, f64>,
    exploration: Option<f64>,
    keep: bool,
) -> Result<(), UserError> {
    let state = session.state().await?;
    let vehicle = session.choose(&state)?;
    let mut order = UtilityOrder { weights: BTreeMap::new(), exploration: exploration.unwrap_or(0.0), curiosity: 0.0 };
    if keep {
        let last = vehicle.labels.iter().filter(|l| l.weight != 0.0).map(|l| (l.id.to_string(), l.weight));
        order.weights.extend(last);
        order.exploration = exploration.unwrap_or(vehicle.orders.utility.exploration);
        order.curiosity = vehicle.orders.utility.curiosity;
    }
    order.weights.extend(weights.into_iter().map(|(label, w)| (label.to_string(), w)));
    let accepted = session.client.post(&format!("/api/v2/vehicles/{}/utility", vehicle.id), &order).await?;
    follow(session, accepted).await
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
