//! Access by tokens: programs send it in a header, the page sends a cookie that it received at the login.

use axum::http::{HeaderMap, header};
use scenecast_config::TokenGrant;
use scenecast_surface::Principal;
use std::collections::VecDeque;
use std::sync::{Mutex, PoisonError};
use subtle::ConstantTimeEq;

/// Sessions of a principal; a further login ends the oldest of them, and never that of another principal.
const MAX_SESSIONS: usize = 16;
pub(super) const COOKIE: &str = "scenecast-session";
/// Paths that the login form needs.
const OPEN: [&str; 3] = ["/login", "/style.css", "/icon.svg"];

/// The names under which requests may address this machine.
///
/// Another name could belong to an attacker, whose DNS points it here; an address cannot.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct HostNames {
    /// The configured name, beside those of the loopback addresses; empty without one.
    pub(super) own: String,
    /// Whether other machines reach the listener, under any of its addresses.
    pub(super) is_on_network: bool,
}

/// Who may use the API.
#[derive(Debug)]
pub(super) struct Access {
    pub(super) names: HostNames,
    /// Further origins of the page, as of a proxy that encrypts.
    pub(super) origins: Vec<String>,
    grants: Vec<TokenGrant>,
    sessions: Mutex<VecDeque<(String, Principal)>>,
}

/// Whether anybody may read this path.
pub(super) fn is_open(path: &str) -> bool {
    OPEN.contains(&path)
}

impl Access {
    /// Without tokens, all who reach the listener are administrators.
    pub(super) fn new(names: HostNames, grants: Vec<TokenGrant>) -> Self {
        Self { names, origins: Vec::new(), grants, sessions: Mutex::default() }
    }

    /// The principal that the headers of a request identify.
    pub(super) fn identify(&self, headers: &HeaderMap) -> Option<Principal> {
        if self.grants.is_empty() {
            return Some(Principal::local());
        }
        if let Some(credentials) = headers.get(header::AUTHORIZATION) {
            let (scheme, token) = credentials.to_str().ok()?.split_once(' ')?;
            return self.principal_of_token(token.trim()).filter(|_| scheme.eq_ignore_ascii_case("bearer"));
        }
        cookies(headers).find_map(|session| self.principal_of_session(session))
    }

    /// The principal with this token. All tokens are compared, so that the duration does not depend on the candidate.
    pub(super) fn principal_of_token(&self, candidate: &str) -> Option<Principal> {
        if self.grants.is_empty() {
            return Some(Principal::local());
        }
        let is_it = |grant: &TokenGrant| bool::from(grant.token.as_bytes().ct_eq(candidate.as_bytes()));
        let found = self.grants.iter().fold(None, |found, grant| if is_it(grant) { Some(grant) } else { found });
        found.map(|grant| grant.principal.clone())
    }

    fn principal_of_session(&self, candidate: &str) -> Option<Principal> {
        let sessions = self.sessions.lock().unwrap_or_else(PoisonError::into_inner);
        let is_it = |session: &str| bool::from(session.as_bytes().ct_eq(candidate.as_bytes()));
        let found = sessions.iter().fold(None, |found, (s, principal)| if is_it(s) { Some(principal) } else { found });
        found.cloned()
    }

    /// Begins a session; `None` if the system has no random bytes.
    pub(super) fn begin_session(&self, principal: Principal) -> Option<String> {
        let mut bytes = [0; 16];
        getrandom::fill(&mut bytes).ok()?;
        let session = format!("{:032x}", u128::from_be_bytes(bytes));
        let mut sessions = self.sessions.lock().unwrap_or_else(PoisonError::into_inner);
        let held: Vec<usize> = (0..sessions.len()).filter(|&index| sessions[index].1 == principal).collect();
        if held.len() >= MAX_SESSIONS {
            sessions.remove(held[0]);
        }
        sessions.push_back((session.clone(), principal));
        Some(session)
    }

    /// Ends the sessions of a request's cookies.
    pub(super) fn end_session(&self, headers: &HeaderMap) {
        let mut sessions = self.sessions.lock().unwrap_or_else(PoisonError::into_inner);
        let is_ended = |session: &str| cookies(headers).any(|c| bool::from(c.as_bytes().ct_eq(session.as_bytes())));
        sessions.retain(|(session, _)| !is_ended(session));
    }
}

/// The sessions in the cookies of a request.
fn cookies(headers: &HeaderMap) -> impl Iterator<Item = &str> {
    let lists = headers.get_all(header::COOKIE).iter().filter_map(|v| v.to_str().ok());
    let pairs = lists.flat_map(|list| list.split(';')).filter_map(|one| one.trim().split_once('='));
    pairs.filter(|(name, _)| *name == COOKIE).map(|(_, session)| session)
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::http::HeaderValue;
    use scenecast_surface::Role;
    use zeroize::Zeroizing;

    fn access() -> Access {
        let grant = |name, role, token: &str| TokenGrant {
            principal: Principal::new(name, role).unwrap(),
            token: Zeroizing::new(token.to_owned()),
        };
        let grants =
            vec![grant("anna", Role::Operator, "0123456789abcdef"), grant("victor", Role::Viewer, "fedcba9876543210")];
        Access::new(HostNames::default(), grants)
    }

    fn with(name: header::HeaderName, value: &str) -> HeaderMap {
        HeaderMap::from_iter([(name, HeaderValue::from_str(value).unwrap())])
    }

    fn name(access: &Access, headers: &HeaderMap) -> Option<String> {
        access.identify(headers).map(|p| p.name().to_owned())
    }

    #[test]
    fn each_token_identifies_its_principal() {
        let found = |value: &str| name(&access(), &with(header::AUTHORIZATION, value));
        assert_eq!(found("Bearer 0123456789abcdef").as_deref(), Some("anna"));
        assert_eq!(found("bearer  fedcba9876543210").as_deref(), Some("victor"));
        for wrong in ["Bearer 0123456789abcdeg", "Bearer ", "0123456789abcdef", "Basic 0123456789abcdef"] {
            assert_eq!(found(wrong), None, "{wrong}");
        }
        assert_eq!(name(&access(), &HeaderMap::new()), None);
        assert!(is_open("/login") && !is_open("/login/") && !is_open("/logout"));
    }

    #[test]
    fn clients_without_tokens_are_administrators() {
        let open = Access::new(HostNames::default(), Vec::new());
        assert_eq!(open.identify(&HeaderMap::new()).map(|p| p.role()), Some(Role::Administrator));
    }

    #[test]
    fn a_session_ends_at_the_logout_and_after_many_of_its_principal() {
        let access = access();
        let begin = |token| access.begin_session(access.principal_of_token(token).unwrap()).unwrap();
        let cookie = |session: &str| with(header::COOKIE, &format!("theme=dark; {COOKIE}={session}"));
        let [first, second] = ["fedcba9876543210", "0123456789abcdef"].map(|token| cookie(&begin(token)));
        assert_eq!([&first, &second].map(|c| name(&access, c).unwrap()), ["victor", "anna"]);
        assert_eq!(name(&access, &cookie("")), None);
        access.end_session(&first);
        assert_eq!((name(&access, &first), name(&access, &second).as_deref()), (None, Some("anna")));
        (0..9 * MAX_SESSIONS).for_each(|_| drop(begin("fedcba9876543210")));
        assert_eq!(name(&access, &second).as_deref(), Some("anna"), "logins of others");
        (0..MAX_SESSIONS).for_each(|_| drop(begin("0123456789abcdef")));
        assert_eq!(name(&access, &second), None);
    }
}
