//! Access by a token: programs send it in a header, the page sends a cookie that it received at the login.

use axum::http::{HeaderMap, header};
use std::collections::VecDeque;
use std::sync::{Mutex, PoisonError};
use subtle::ConstantTimeEq;
use zeroize::Zeroizing;

/// A further login ends the oldest session.
const MAX_SESSIONS: usize = 64;
pub(super) const COOKIE: &str = "scenecast-session";
/// Paths that the login form needs.
const OPEN: [&str; 3] = ["/login", "/style.css", "/icon.svg"];

/// The names under which requests may address this machine.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum HostNames {
    /// Names of the loopback addresses only.
    Loopback,
    /// Any address, and the configured name if it is not empty. Another name could belong to an attacker, whose DNS
    /// points it here; an address cannot.
    Network(String),
}

/// Who may use the API.
#[derive(Debug)]
pub(super) struct Access {
    pub(super) names: HostNames,
    token: Option<Zeroizing<String>>,
    sessions: Mutex<VecDeque<String>>,
}

impl Access {
    /// Without a token, all who reach the listener have access.
    pub(super) fn new(names: HostNames, token: Option<Zeroizing<String>>) -> Self {
        Self { names, token, sessions: Mutex::default() }
    }

    /// Whether the headers of a request to `path` grant access.
    pub(super) fn admits(&self, path: &str, headers: &HeaderMap) -> bool {
        if self.token.is_none() || OPEN.contains(&path) {
            return true;
        }
        let text = |name| headers.get(name).and_then(|v| v.to_str().ok());
        if let Some(credentials) = text(header::AUTHORIZATION) {
            let bearer = credentials.split_once(' ').filter(|(scheme, _)| scheme.eq_ignore_ascii_case("bearer"));
            return bearer.is_some_and(|(_, token)| self.is_token(token.trim()));
        }
        let cookies = headers.get_all(header::COOKIE).iter().filter_map(|v| v.to_str().ok());
        let mut pairs = cookies.flat_map(|list| list.split(';')).filter_map(|one| one.trim().split_once('='));
        pairs.any(|(name, session)| name == COOKIE && self.is_session(session))
    }

    /// Whether there is a token and `candidate` equals it.
    fn is_token(&self, candidate: &str) -> bool {
        self.token.as_ref().is_some_and(|token| bool::from(token.as_bytes().ct_eq(candidate.as_bytes())))
    }

    fn is_session(&self, candidate: &str) -> bool {
        let sessions = self.sessions.lock().unwrap_or_else(PoisonError::into_inner);
        // All are compared, so that the duration does not depend on the candidate.
        sessions.iter().fold(false, |found, s| found | bool::from(s.as_bytes().ct_eq(candidate.as_bytes())))
    }

    /// Whether a login with `candidate` succeeds.
    pub(super) fn admits_login(&self, candidate: &str) -> bool {
        self.token.is_none() || self.is_token(candidate)
    }

    /// Begins a session; `None` if the system has no random bytes.
    pub(super) fn begin_session(&self) -> Option<String> {
        let mut bytes = [0; 16];
        getrandom::fill(&mut bytes).ok()?;
        let session = format!("{:032x}", u128::from_be_bytes(bytes));
        let mut sessions = self.sessions.lock().unwrap_or_else(PoisonError::into_inner);
        sessions.push_back(session.clone());
        if sessions.len() > MAX_SESSIONS {
            sessions.pop_front();
        }
        Some(session)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::http::HeaderValue;

    fn access() -> Access {
        Access::new(HostNames::Loopback, Some(Zeroizing::new("0123456789abcdef".to_owned())))
    }

    fn with(name: header::HeaderName, value: &str) -> HeaderMap {
        HeaderMap::from_iter([(name, HeaderValue::from_str(value).unwrap())])
    }

    #[test]
    fn only_the_token_grants_access() {
        let admits = |value: &str| access().admits("/api/v2/state", &with(header::AUTHORIZATION, value));
        assert!(admits("Bearer 0123456789abcdef") && admits("bearer  0123456789abcdef"));
        assert!(!admits("Bearer 0123456789abcdeg") && !admits("Bearer ") && !admits("0123456789abcdef"));
        assert!(!admits("Basic 0123456789abcdef") && !access().admits("/", &HeaderMap::new()));
        assert!(access().admits("/login", &HeaderMap::new()) && !access().admits("/login/", &HeaderMap::new()));
    }

    #[test]
    fn a_session_ends_after_many_others() {
        let access = access();
        let first = access.begin_session().unwrap();
        let cookie = with(header::COOKIE, &format!("theme=dark; {COOKIE}={first}"));
        assert!(access.admits("/", &cookie));
        assert!(!access.admits("/", &with(header::COOKIE, &format!("{COOKIE}="))));
        (0..MAX_SESSIONS).for_each(|_| drop(access.begin_session()));
        assert!(!access.admits("/", &cookie));
    }
}
