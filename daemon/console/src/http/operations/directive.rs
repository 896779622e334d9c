//! The operations that give orders.

use super::{Content, Operation, change, order, schema};
use crate::http::handlers::orders as handlers;
use axum::routing::post;
use scenecast_surface::state::DryRun;
use scenecast_surface::{
    AgainOrder, AreasOrder, BudgetOrder, ConstraintsOrder, DestinationOrder, DryRunOrder, ExemplarOrder, FenceOrder,
    LimitsOrder, RestoreOrder, Role, SettingsOrder, SurfaceRequest, TakeOverOrder, UtilityOrder,
};

/// The operations that give a vehicle orders.
pub(super) fn operations() -> Vec<Operation> {
    vec![
        order(
            "/api/v2/vehicles/{id}/utility",
            "set_utility",
            "Sends the weights of labels, of unexplored cells and of curiosity",
            schema::<UtilityOrder>,
            || post(handlers::utility),
        ),
        Operation {
            role: Some(Role::Viewer),
            success: (200, Content::Json(schema::<DryRun>)),
            ..order(
                "/api/v2/vehicles/{id}/dry-run",
                "dry_run",
                "Plans what the vehicle would do by these weights and within this fence, with its own planner on the surface's map, and tells how long one \
                 pass in straight legs takes; nothing is sent",
                schema::<DryRunOrder>,
                || post(handlers::dry_run),
            )
        },
        order(
            "/api/v2/vehicles/{id}/exemplars",
            "request_exemplar",
            "Requests an image of a label: first the best, then another or a larger one; or cancels the request. At most 8 \
             requests are pending at a time.",
            schema::<ExemplarOrder>,
            || handlers::to_vehicle(SurfaceRequest::ExemplarOrder),
        ),
        order(
            "/api/v2/vehicles/{id}/constraints",
            "set_constraints",
            "Orders the vehicle to hold, to abort, or to resume its survey; each ends the one before it. A hold and an abort do \
             not need command.",
            schema::<ConstraintsOrder>,
            || handlers::to_vehicle(|id, order: ConstraintsOrder| SurfaceRequest::Constraints(id, order.action.into())),
        ),
        order(
            "/api/v2/vehicles/{id}/fence",
            "set_fence",
            "Changes fence, keep-outs and return point. A member that is absent stays as it is, and null removes it; without \
             knowledge of the present fence, all must be named. Vertices are in metres east and north in the world frame and stay there when a fix moves the \
             vehicle's map; 3 to 34 for each outline, at most 15 keep-outs. Refused: edges that cross or touch, no area, a \
             keep-out around the whole fence, a return point where the vehicle must not be, more than fits a frame. The \
             vehicle refuses a fence that it is outside of.",
            schema::<FenceOrder>,
            || handlers::to_vehicle(SurfaceRequest::Fence),
        ),
        order(
            "/api/v2/vehicles/{id}/limits",
            "set_limits",
            "Changes limits. A member that is absent stays as it is, and null removes it; without knowledge of the present \
             limits, all must be named. Reactions are hold, return or surface. The vehicle refuses a band that it is outside of.",
            schema::<LimitsOrder>,
            || handlers::to_vehicle(SurfaceRequest::Limits),
        ),
        order(
            "/api/v2/vehicles/{id}/areas",
            "set_areas",
            "Replaces the weighted areas: 0 to 4 outlines in metres east and north in the world frame, each with a weight from -1 \
             to 1 that its cells have in addition to that of their label. Refused: edges that cross or touch, no area, more \
             than fits a frame.",
            schema::<AreasOrder>,
            || handlers::to_vehicle(SurfaceRequest::Areas),
        ),
        order(
            "/api/v2/vehicles/{id}/destination",
            "set_destination",
            "Sends the vehicle to a place in the world frame at once; there it resumes its survey. Null withdraws the order. The \
             vehicle refuses a place that the fence does not allow, or to which no allowed path leads.",
            schema::<DestinationOrder>,
            || handlers::to_vehicle(SurfaceRequest::Destination),
        ),
        order(
            "/api/v2/vehicles/{id}/orders/again",
            "give_order_again",
            "Gives an order again, as a new one, that the surface has withdrawn: its state is `withdrawn`",
            schema::<AgainOrder>,
            || post(handlers::again),
        ),
        change(
            "/api/v2/vehicles/{id}/orders/restore",
            "restore_orders",
            "Sends every order that the vehicle has lost again, as new ones, except one to resume",
            schema::<RestoreOrder>,
            || handlers::to_vehicle(|id, RestoreOrder {}| SurfaceRequest::Restore(id)),
        ),
        change(
            "/api/v2/vehicles/{id}/take-over",
            "take_over_vehicle",
            "Takes the vehicle over from another surface with the same key: an administrator at any time, an operator after \
             that surface was silent for 120 s",
            schema::<TakeOverOrder>,
            || handlers::to_vehicle(|id, TakeOverOrder {}| SurfaceRequest::TakeOver(id)),
        ),
        Operation {
            role: Some(Role::Administrator),
            ..order(
                "/api/v2/vehicles/{id}/settings",
                "set_settings",
                "Changes how the vehicle builds its map, the cells and layers that it sends, and its planner. A member that is \
             missing or null leaves the setting unchanged; 0 or an empty text sets it as configured on the vehicle. Labels \
             keep their meaning.",
                schema::<SettingsOrder>,
                || handlers::to_vehicle(SurfaceRequest::Settings),
            )
        },
        order(
            "/api/v2/budget",
            "set_budget",
            "Changes the budget of the surface, at once, and of each vehicle, with the directive, and the use of spare \
             capacity",
            schema::<BudgetOrder>,
            || post(handlers::budget),
        ),
    ]
}
