//! Replies as HTTP responses.

use crate::request::Reply;
use crate::state::{ArchiveList, ErrorBody};
use axum::Json;
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};

/// The response to a handled request.
pub(super) fn respond(reply: Reply) -> Response {
    match reply {
        Reply::Map(cells) => match cells.body(None) {
            Ok(body) => Json(body).into_response(),
            Err(reason) => error(StatusCode::UNPROCESSABLE_ENTITY, &reason),
        },
        Reply::File(content_type, bytes) => ([(header::CONTENT_TYPE, content_type)], bytes).into_response(),
        Reply::Fit(fit) => Json(*fit).into_response(),
        Reply::Accepted(accepted) => (StatusCode::ACCEPTED, Json(accepted)).into_response(),
        Reply::Done => StatusCode::NO_CONTENT.into_response(),
        // The handler of the log makes its lines.
        Reply::Log(_) => not_found(),
        Reply::FormerLabels(history) => Json(history).into_response(),
        Reply::Archives(maps) => Json(ArchiveList { maps }).into_response(),
        Reply::Command(command) => Json(command).into_response(),
        Reply::Forbidden(reason) => error(StatusCode::FORBIDDEN, &reason),
        Reply::NotInCommand(reason) => error(StatusCode::CONFLICT, &reason),
        Reply::NotFound => not_found(),
        Reply::Refused(reason) => error(StatusCode::UNPROCESSABLE_ENTITY, &reason),
    }
}

/// An error with one line for people.
pub(super) fn error(status: StatusCode, line: &str) -> Response {
    (status, Json(ErrorBody { error: line.to_owned() })).into_response()
}

pub(super) fn not_found() -> Response {
    error(StatusCode::NOT_FOUND, "there is no such page, vehicle, label or image")
}
