//! The client's principal, and changes of command.

use crate::http::body::JsonOrder;
use crate::http::response::not_found;
use crate::http::shared::Shared;
use crate::orders::{CommandOrder, CommandOrderAction};
use crate::request::SurfaceRequest;
use crate::snapshot::principal_info;
use axum::extract::State;
use axum::response::{IntoResponse, Response};
use axum::{Extension, Json};
use scenecast_surface::{CommandAction, Giver};

/// Name and role of the client's principal.
pub(in crate::http) async fn principal(by: Option<Extension<Giver>>) -> Response {
    by.map_or_else(not_found, |Extension(by)| Json(principal_info(&by.principal)).into_response())
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
