//! The token that a client on the network shows: scripts in a header, the page by a cookie after a login.

use super::guard::Names;
use super::server::Shared;
use axum::Form;
use axum::extract::State;
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{Html, IntoResponse, Redirect, Response};
use serde::Deserialize;
use std::collections::VecDeque;
use std::sync::{Mutex, PoisonError};
use subtle::ConstantTimeEq;
use zeroize::Zeroizing;

/// Most logins that are remembered; the oldest is forgotten.
const SESSIONS: usize = 64;
const COOKIE: &str = "scenecast-session";
/// What a login needs before it is one.
const OPEN: [&str; 3] = ["/login", "/style.css", "/icon.svg"];

/// Who may use the API.
#[derive(Debug)]
pub(super) struct Access {
    pub(super) names: Names,
    token: Option<Zeroizing<String>>,
    sessions: Mutex<VecDeque<String>>,
}

impl Access {
    /// Everybody who reaches the listener, or those who know the token if there is one.
    pub(super) fn new(names: Names, token: Option<Zeroizing<String>>) -> Self {
        Self { names, token, sessions: Mutex::default() }
    }

    /// Whether a request to `path` shows that it may be made.
    pub(super) fn admits(&self, path: &str, headers: &HeaderMap) -> bool {
        if self.token.is_none() || OPEN.contains(&path) {
            return true;
        }
        let text = |name| headers.get(name).and_then(|v| v.to_str().ok());
        if let Some(shown) = text(header::AUTHORIZATION) {
            let bearer = shown.split_once(' ').filter(|(scheme, _)| scheme.eq_ignore_ascii_case("bearer"));
            return bearer.is_some_and(|(_, token)| self.is_token(token.trim()));
        }
        let cookies = headers.get_all(header::COOKIE).iter().filter_map(|v| v.to_str().ok());
        let mut pairs = cookies.flat_map(|list| list.split(';')).filter_map(|one| one.trim().split_once('='));
        pairs.any(|(name, session)| name == COOKIE && self.is_session(session))
    }

    fn is_token(&self, shown: &str) -> bool {
        self.token.as_ref().is_some_and(|token| bool::from(token.as_bytes().ct_eq(shown.as_bytes())))
    }

    fn is_session(&self, shown: &str) -> bool {
        let sessions = self.sessions.lock().unwrap_or_else(PoisonError::into_inner);
        // All are compared, so that the time tells nothing.
        sessions.iter().fold(false, |found, s| found | bool::from(s.as_bytes().ct_eq(shown.as_bytes())))
    }

    /// Begins a session, if the system has random bytes.
    fn begin_session(&self) -> Option<String> {
        let mut bytes = [0; 16];
        getrandom::fill(&mut bytes).ok()?;
        let session = format!("{:032x}", u128::from_be_bytes(bytes));
        let mut sessions = self.sessions.lock().unwrap_or_else(PoisonError::into_inner);
        sessions.push_back(session.clone());
        if sessions.len() > SESSIONS {
            sessions.pop_front();
        }
        Some(session)
    }
}

fn form(said: &str) -> Html<String> {
    let (_, page) = super::assets::find("login.html").unwrap_or_default();
    Html(String::from_utf8_lossy(page).replace("<!-- said -->", said))
}

/// The form that asks for the token.
pub(super) async fn login_form() -> Response {
    form("").into_response()
}

/// What the form sends.
#[derive(Deserialize)]
pub(super) struct Login {
    token: String,
}

/// Gives a cookie for the token.
pub(super) async fn login(
    State(shared): State<Shared>,
    login: Result<Form<Login>, axum::extract::rejection::FormRejection>,
) -> Response {
    let access = &shared.access;
    let shown = match login {
        Ok(Form(login)) => Zeroizing::new(login.token),
        Err(e) => return super::server::refusal(e.status(), &e.body_text()),
    };
    if access.token.is_some() && !access.is_token(shown.trim()) {
        let said = "<p class=\"warn\" role=\"alert\">This is not the token.</p>";
        return (StatusCode::UNAUTHORIZED, form(said)).into_response();
    }
    let Some(session) = access.begin_session() else { return StatusCode::INTERNAL_SERVER_ERROR.into_response() };
    let cookie = format!("{COOKIE}={session}; HttpOnly; SameSite=Strict; Path=/");
    ([(header::SET_COOKIE, cookie)], Redirect::to("/")).into_response()
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::http::HeaderValue;

    fn access() -> Access {
        Access::new(Names::Loopback, Some(Zeroizing::new("0123456789abcdef".to_owned())))
    }

    fn with(name: header::HeaderName, value: &str) -> HeaderMap {
        HeaderMap::from_iter([(name, HeaderValue::from_str(value).unwrap())])
    }

    #[test]
    fn the_token_opens_and_nothing_else_does() {
        let shown = |value: &str| access().admits("/api/v1/state", &with(header::AUTHORIZATION, value));
        assert!(shown("Bearer 0123456789abcdef") && shown("bearer  0123456789abcdef"));
        assert!(!shown("Bearer 0123456789abcdeg") && !shown("Bearer ") && !shown("0123456789abcdef"));
        assert!(!shown("Basic 0123456789abcdef") && !access().admits("/", &HeaderMap::new()));
        assert!(access().admits("/login", &HeaderMap::new()) && !access().admits("/login/", &HeaderMap::new()));
    }

    #[test]
    fn a_session_lasts_until_too_many_others_began() {
        let access = access();
        let first = access.begin_session().unwrap();
        let cookie = with(header::COOKIE, &format!("theme=dark; {COOKIE}={first}"));
        assert!(access.admits("/", &cookie));
        assert!(!access.admits("/", &with(header::COOKIE, &format!("{COOKIE}="))));
        (0..SESSIONS).for_each(|_| drop(access.begin_session()));
        assert!(!access.admits("/", &cookie));
    }
}
