//! Orders: each is handed to the surface.

use crate::http::body::JsonOrder;
use crate::http::response::error;
use crate::http::shared::{Shared, VehicleId};
use crate::order_changes::OrderChanges;
use crate::orders::{
    AgainOrder, BudgetOrder, ConstraintsOrder, DismissOrder, DraftOrder, ExemplarOrder, LabelOrder, MarkerOrder,
    NoteOrder, RemoveMarkerOrder, RestoreOrder, TakeOverOrder, UtilityOrder,
};
use crate::request::SurfaceRequest;
use axum::Extension;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::Response;
use scenecast_protocol::directive::SlotId;
use scenecast_surface::{AreasOrder, DestinationOrder, FenceOrder, LimitsOrder, Principal, SettingsOrder};
use std::collections::BTreeMap;

pub(in crate::http) async fn utility(
    State(shared): State<Shared>,
    Extension(principal): Extension<Principal>,
    VehicleId(id): VehicleId,
    JsonOrder(order): JsonOrder<UtilityOrder>,
) -> Response {
    match by_label(order.weights) {
        Ok(weights) => {
            shared.order(principal, SurfaceRequest::Utility(id, weights, (order.exploration, order.curiosity))).await
        }
        Err(line) => error(StatusCode::UNPROCESSABLE_ENTITY, &line),
    }
}

pub(in crate::http) async fn draft(
    State(shared): State<Shared>,
    Extension(principal): Extension<Principal>,
    VehicleId(id): VehicleId,
    JsonOrder(order): JsonOrder<DraftOrder>,
) -> Response {
    let author = principal.name().to_owned();
    match by_label(order.weights) {
        Ok(weights) => {
            let terms = (order.exploration, order.curiosity);
            shared.order(principal, SurfaceRequest::Draft(id, author, weights, terms)).await
        }
        Err(line) => error(StatusCode::UNPROCESSABLE_ENTITY, &line),
    }
}

/// The weights by the numbers of their labels. The error is one line for the operator.
fn by_label(weights: BTreeMap<String, f64>) -> Result<BTreeMap<u8, f64>, String> {
    let number =
        |(label, w): (String, f64)| label.parse().map(|l| (l, w)).map_err(|_| format!("{label:?} is not a label"));
    weights.into_iter().map(number).collect()
}

pub(in crate::http) async fn exemplar(
    State(shared): State<Shared>,
    Extension(principal): Extension<Principal>,
    VehicleId(id): VehicleId,
    JsonOrder(order): JsonOrder<ExemplarOrder>,
) -> Response {
    shared.order(principal, SurfaceRequest::ExemplarOrder(id, order)).await
}

pub(in crate::http) async fn constraints(
    State(shared): State<Shared>,
    Extension(principal): Extension<Principal>,
    VehicleId(id): VehicleId,
    JsonOrder(order): JsonOrder<ConstraintsOrder>,
) -> Response {
    shared.order(principal, SurfaceRequest::Constraints(id, order.action.into())).await
}

pub(in crate::http) async fn fence(
    State(shared): State<Shared>,
    Extension(principal): Extension<Principal>,
    VehicleId(id): VehicleId,
    JsonOrder(order): JsonOrder<OrderChanges<FenceOrder>>,
) -> Response {
    shared.order(principal, SurfaceRequest::Fence(id, order)).await
}

pub(in crate::http) async fn limits(
    State(shared): State<Shared>,
    Extension(principal): Extension<Principal>,
    VehicleId(id): VehicleId,
    JsonOrder(order): JsonOrder<OrderChanges<LimitsOrder>>,
) -> Response {
    shared.order(principal, SurfaceRequest::Limits(id, order)).await
}

pub(in crate::http) async fn areas(
    State(shared): State<Shared>,
    Extension(principal): Extension<Principal>,
    VehicleId(id): VehicleId,
    JsonOrder(order): JsonOrder<AreasOrder>,
) -> Response {
    shared.order(principal, SurfaceRequest::Areas(id, order)).await
}

pub(in crate::http) async fn destination(
    State(shared): State<Shared>,
    Extension(principal): Extension<Principal>,
    VehicleId(id): VehicleId,
    JsonOrder(order): JsonOrder<DestinationOrder>,
) -> Response {
    shared.order(principal, SurfaceRequest::Destination(id, order)).await
}

pub(in crate::http) async fn settings(
    State(shared): State<Shared>,
    Extension(principal): Extension<Principal>,
    VehicleId(id): VehicleId,
    JsonOrder(order): JsonOrder<SettingsOrder>,
) -> Response {
    shared.order(principal, SurfaceRequest::Settings(id, order)).await
}

pub(in crate::http) async fn budget(
    State(shared): State<Shared>,
    Extension(principal): Extension<Principal>,
    JsonOrder(order): JsonOrder<BudgetOrder>,
) -> Response {
    shared.order(principal, SurfaceRequest::Budget(order)).await
}

pub(in crate::http) async fn again(
    State(shared): State<Shared>,
    Extension(principal): Extension<Principal>,
    VehicleId(id): VehicleId,
    JsonOrder(AgainOrder { slot }): JsonOrder<AgainOrder>,
) -> Response {
    let Some(slot) = SlotId::ALL.into_iter().find(|id| id.name() == slot) else {
        let names = SlotId::ALL.map(SlotId::name).join(", ");
        return error(StatusCode::UNPROCESSABLE_ENTITY, &format!("slot {slot:?}: it takes {names}"));
    };
    shared.order(principal, SurfaceRequest::Again(id, slot)).await
}

pub(in crate::http) async fn restore(
    State(shared): State<Shared>,
    Extension(principal): Extension<Principal>,
    VehicleId(id): VehicleId,
    JsonOrder(RestoreOrder {}): JsonOrder<RestoreOrder>,
) -> Response {
    shared.order(principal, SurfaceRequest::Restore(id)).await
}

pub(in crate::http) async fn take_over(
    State(shared): State<Shared>,
    Extension(principal): Extension<Principal>,
    VehicleId(id): VehicleId,
    JsonOrder(TakeOverOrder {}): JsonOrder<TakeOverOrder>,
) -> Response {
    shared.order(principal, SurfaceRequest::TakeOver(id)).await
}

pub(in crate::http) async fn label(
    State(shared): State<Shared>,
    Extension(principal): Extension<Principal>,
    VehicleId(id): VehicleId,
    JsonOrder(order): JsonOrder<LabelOrder>,
) -> Response {
    shared.order(principal, SurfaceRequest::Label(id, order)).await
}

pub(in crate::http) async fn note(
    State(shared): State<Shared>,
    Extension(principal): Extension<Principal>,
    VehicleId(id): VehicleId,
    JsonOrder(order): JsonOrder<NoteOrder>,
) -> Response {
    let author = principal.name().to_owned();
    shared.order(principal, SurfaceRequest::Note(id, author, order)).await
}

pub(in crate::http) async fn marker(
    State(shared): State<Shared>,
    Extension(principal): Extension<Principal>,
    VehicleId(id): VehicleId,
    JsonOrder(order): JsonOrder<MarkerOrder>,
) -> Response {
    let author = principal.name().to_owned();
    shared.order(principal, SurfaceRequest::Marker(id, author, order)).await
}

pub(in crate::http) async fn remove_marker(
    State(shared): State<Shared>,
    Extension(principal): Extension<Principal>,
    VehicleId(id): VehicleId,
    JsonOrder(order): JsonOrder<RemoveMarkerOrder>,
) -> Response {
    shared.order(principal, SurfaceRequest::RemoveMarker(id, order)).await
}

pub(in crate::http) async fn dismiss(
    State(shared): State<Shared>,
    Extension(principal): Extension<Principal>,
    VehicleId(id): VehicleId,
    JsonOrder(DismissOrder {}): JsonOrder<DismissOrder>,
) -> Response {
    shared.order(principal, SurfaceRequest::DismissEarlierMap(id)).await
}
