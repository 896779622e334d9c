//! Orders and changes of command: each is handed to the surface.

use crate::http::response::{JsonOrder, error};
use crate::http::shared::{Shared, VehicleId};
use axum::Extension;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::Response;
use axum::routing::{MethodRouter, post};
use scenecast_protocol::directive::SlotId;
use scenecast_surface::{
    AgainOrder, BudgetOrder, CONSTRAINT_NAMES, CommandAction, CommandOrder, CommandOrderAction, DraftOrder,
    DryRunOrder, Giver, MarkerOrder, NoteOrder, SurfaceRequest, UtilityOrder,
};
use serde::de::DeserializeOwned;
use std::collections::BTreeMap;

/// A route that hands the surface the request that an order to a vehicle makes.
pub(in crate::http) fn to_vehicle<T>(request: fn(u8, T) -> SurfaceRequest) -> MethodRouter<Shared>
where
    T: DeserializeOwned + Send + 'static,
{
    post(
        move |State(shared): State<Shared>,
              Extension(by): Extension<Giver>,
              VehicleId(id): VehicleId,
              JsonOrder(order): JsonOrder<T>| async move { shared.order(by, request(id, order)).await },
    )
}

pub(in crate::http) async fn utility(
    State(shared): State<Shared>,
    Extension(by): Extension<Giver>,
    VehicleId(id): VehicleId,
    JsonOrder(order): JsonOrder<UtilityOrder>,
) -> Response {
    match by_label(order.weights) {
        Ok(weights) => {
            shared.order(by, SurfaceRequest::Utility(id, weights, (order.exploration, order.curiosity))).await
        }
        Err(unknown) => error(StatusCode::UNPROCESSABLE_ENTITY, unknown),
    }
}

/// What the vehicle would do by an order that is not given.
pub(in crate::http) async fn dry_run(
    State(shared): State<Shared>,
    VehicleId(id): VehicleId,
    JsonOrder(order): JsonOrder<DryRunOrder>,
) -> Response {
    match by_label(order.weights) {
        Ok(weights) => {
            let terms = (order.exploration, order.curiosity);
            shared.respond(SurfaceRequest::DryRun(id, weights, terms, order.fence)).await
        }
        Err(unknown) => error(StatusCode::UNPROCESSABLE_ENTITY, unknown),
    }
}

pub(in crate::http) async fn draft(
    State(shared): State<Shared>,
    Extension(by): Extension<Giver>,
    VehicleId(id): VehicleId,
    JsonOrder(order): JsonOrder<DraftOrder>,
) -> Response {
    let author = by.name().to_owned();
    match by_label(order.weights) {
        Ok(weights) => {
            let terms = (order.exploration, order.curiosity);
            shared.order(by, SurfaceRequest::Draft(id, author, weights, terms)).await
        }
        Err(unknown) => error(StatusCode::UNPROCESSABLE_ENTITY, unknown),
    }
}

/// A name of a weight that is not the number of a label.
#[derive(Debug, thiserror::Error)]
#[error("{0:?} is not a label")]
struct NoLabel(String);

/// The weights by the numbers of their labels.
fn by_label(weights: BTreeMap<String, f64>) -> Result<BTreeMap<u8, f64>, NoLabel> {
    // `+1` and `01` would name label 1 a second time.
    let number = |(label, weight): (String, f64)| match label.parse::<u8>() {
        Ok(number) if number.to_string() == label => Ok((number, weight)),
        _ => Err(NoLabel(label)),
    };
    weights.into_iter().map(number).collect()
}

pub(in crate::http) async fn budget(
    State(shared): State<Shared>,
    Extension(by): Extension<Giver>,
    JsonOrder(order): JsonOrder<BudgetOrder>,
) -> Response {
    shared.order(by, SurfaceRequest::Budget(order)).await
}

pub(in crate::http) async fn again(
    State(shared): State<Shared>,
    Extension(by): Extension<Giver>,
    VehicleId(id): VehicleId,
    JsonOrder(AgainOrder { slot }): JsonOrder<AgainOrder>,
) -> Response {
    // Hold, resume and abort share a slot.
    let of_constraints = CONSTRAINT_NAMES.contains(&slot.as_str()).then_some(SlotId::Constraints);
    let Some(found) = of_constraints.or_else(|| SlotId::ALL.into_iter().find(|id| id.name() == slot)) else {
        let names: Vec<&str> = SlotId::ALL.map(SlotId::name).into_iter().chain(CONSTRAINT_NAMES).collect();
        return error(StatusCode::UNPROCESSABLE_ENTITY, format!("slot {slot:?}: it takes {}", names.join(", ")));
    };
    shared.order(by, SurfaceRequest::Again(id, found, slot)).await
}

pub(in crate::http) async fn note(
    State(shared): State<Shared>,
    Extension(by): Extension<Giver>,
    VehicleId(id): VehicleId,
    JsonOrder(order): JsonOrder<NoteOrder>,
) -> Response {
    let author = by.name().to_owned();
    shared.order(by, SurfaceRequest::Note(id, author, order)).await
}

pub(in crate::http) async fn marker(
    State(shared): State<Shared>,
    Extension(by): Extension<Giver>,
    VehicleId(id): VehicleId,
    JsonOrder(order): JsonOrder<MarkerOrder>,
) -> Response {
    let author = by.name().to_owned();
    shared.order(by, SurfaceRequest::Marker(id, author, order)).await
}

pub(in crate::http) async fn command(
    State(shared): State<Shared>,
    Extension(by): Extension<Giver>,
    JsonOrder(order): JsonOrder<CommandOrder>,
) -> Response {
    let action = match order.action {
        CommandOrderAction::Request => CommandAction::Request,
        CommandOrderAction::Withdraw => CommandAction::Withdraw,
        CommandOrderAction::Take => CommandAction::Take,
        CommandOrderAction::HandOver => CommandAction::HandOver(order.to),
        CommandOrderAction::Release => CommandAction::Release,
        CommandOrderAction::Keep => CommandAction::Keep,
    };
    shared.order(by, SurfaceRequest::Command(action)).await
}
