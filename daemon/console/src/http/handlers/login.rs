//! Who a client is: the login form, which exchanges a token for a cookie, the end of the session, and the client's principal.

use crate::http::access::{COOKIE, PeerAddress};
use crate::http::response::{error, find_page_file, not_found};
use crate::http::shared::Shared;
use axum::extract::State;
use axum::extract::rejection::FormRejection;
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{Html, IntoResponse, Redirect, Response};
use axum::{Extension, Form, Json};
use scenecast_surface::{Giver, principal_info};
use serde::Deserialize;
use zeroize::Zeroizing;

fn form(message: &str) -> Html<String> {
    let (_, page) = find_page_file("login.html").unwrap_or_default();
    Html(String::from_utf8_lossy(page).replace("<!-- message -->", message))
}

/// The form that requests the token.
pub(in crate::http) async fn login_form() -> Response {
    form("").into_response()
}

/// The fields of the form.
#[derive(Deserialize)]
pub(in crate::http) struct LoginForm {
    token: String,
}

/// Sets a cookie in exchange for the token.
pub(in crate::http) async fn login(
    State(shared): State<Shared>,
    Extension(PeerAddress(address)): Extension<PeerAddress>,
    login: Result<Form<LoginForm>, FormRejection>,
) -> Response {
    let token = match login {
        Ok(Form(login)) => Zeroizing::new(login.token),
        Err(e) => return error(e.status(), e.body_text()),
    };
    let Some(principal) = shared.access.principal_of_token(token.trim()) else {
        let message = "<p class=\"warn\" role=\"alert\">This is not the token.</p>";
        return (StatusCode::UNAUTHORIZED, form(message)).into_response();
    };
    let Some(session) = shared.access.begin_session(principal, address) else {
        return StatusCode::INTERNAL_SERVER_ERROR.into_response();
    };
    let cookie = format!("{COOKIE}={session}; HttpOnly; SameSite=Strict; Path=/");
    ([(header::SET_COOKIE, cookie)], Redirect::to("/")).into_response()
}

/// Ends the session of the cookie. A client with a token has no session and loses none.
pub(in crate::http) async fn logout(State(shared): State<Shared>, headers: HeaderMap) -> Response {
    shared.access.end_session(&headers);
    let cookie = format!("{COOKIE}=; HttpOnly; SameSite=Strict; Path=/; Max-Age=0");
    ([(header::SET_COOKIE, cookie)], Redirect::to("/login")).into_response()
}

/// Name and role of the client's principal.
pub(in crate::http) async fn principal(by: Option<Extension<Giver>>) -> Response {
    by.map_or_else(not_found, |Extension(by)| Json(principal_info(&by.principal)).into_response())
}
