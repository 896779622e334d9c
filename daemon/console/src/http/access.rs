//! Access by tokens: programs send one in a header, the page a cookie from the login. Also the limits of each principal: streams
//! of events, and edits a second.

use axum::http::{HeaderMap, header};
use scenecast_config::TokenGrant;
use scenecast_surface::Principal;
use std::collections::{BTreeMap, VecDeque};
use std::net::IpAddr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use subtle::ConstantTimeEq;
use tokio::sync::oneshot;

/// Sessions of a principal; a further login ends the oldest one of the address that has most of them.
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
    /// Whoever reaches the listener, where there are no tokens.
    pub(super) local: Principal,
    grants: Vec<TokenGrant>,
    /// The open sessions of all principals, the oldest first; a principal has at most [`MAX_SESSIONS`].
    sessions: Mutex<VecDeque<Session>>,
}

/// Where a request comes from.
#[derive(Debug, Clone, Copy)]
pub(super) struct PeerAddress(pub(super) IpAddr);

/// A login of the page.
#[derive(Debug)]
struct Session {
    cookie: String,
    principal: Principal,
    address: IpAddr,
}

/// Whether anybody may read this path.
pub(super) fn is_open(path: &str) -> bool {
    OPEN.contains(&path)
}

impl Access {
    /// Without tokens, all who reach the listener are administrators.
    pub(super) fn new(names: HostNames, grants: Vec<TokenGrant>) -> Self {
        Self { names, origins: Vec::new(), local: Principal::local(), grants, sessions: Mutex::default() }
    }

    /// The principal that the headers of a request identify.
    pub(super) fn identify(&self, headers: &HeaderMap) -> Option<Principal> {
        if self.grants.is_empty() {
            return Some(self.local.clone());
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
            return Some(self.local.clone());
        }
        let is_it = |grant: &TokenGrant| bool::from(grant.token.as_bytes().ct_eq(candidate.as_bytes()));
        let found = self.grants.iter().fold(None, |found, grant| if is_it(grant) { Some(grant) } else { found });
        found.map(|grant| grant.principal.clone())
    }

    fn principal_of_session(&self, candidate: &str) -> Option<Principal> {
        let sessions = self.sessions.lock().unwrap_or_else(PoisonError::into_inner);
        let is_it = |session: &str| bool::from(session.as_bytes().ct_eq(candidate.as_bytes()));
        let found = sessions.iter().fold(None, |found, s| if is_it(&s.cookie) { Some(&s.principal) } else { found });
        found.cloned()
    }

    /// Begins a session of a client at an address; `None` if the system has no random bytes.
    pub(super) fn begin_session(&self, principal: Principal, address: IpAddr) -> Option<String> {
        let mut bytes = [0; 16];
        getrandom::fill(&mut bytes).ok()?;
        let cookie = format!("{:032x}", u128::from_be_bytes(bytes));
        let mut sessions = self.sessions.lock().unwrap_or_else(PoisonError::into_inner);
        sessions.push_back(Session { cookie: cookie.clone(), principal: principal.clone(), address });
        let mut held: BTreeMap<IpAddr, usize> = BTreeMap::new();
        let own = sessions.iter().filter(|session| session.principal == principal);
        own.for_each(|session| *held.entry(session.address).or_default() += 1);
        if held.values().sum::<usize>() > MAX_SESSIONS {
            let most = held.into_iter().max_by_key(|(_, count)| *count).map(|(address, _)| address);
            let is_of_it = |session: &Session| session.principal == principal && Some(session.address) == most;
            let oldest = sessions.iter().position(is_of_it);
            oldest.map(|index| sessions.remove(index));
        }
        Some(cookie)
    }

    /// Ends the sessions of a request's cookies.
    pub(super) fn end_session(&self, headers: &HeaderMap) {
        let mut sessions = self.sessions.lock().unwrap_or_else(PoisonError::into_inner);
        let is_ended = |session: &str| cookies(headers).any(|c| bool::from(c.as_bytes().ct_eq(session.as_bytes())));
        sessions.retain(|session| !is_ended(&session.cookie));
    }
}

/// The sessions in the cookies of a request.
fn cookies(headers: &HeaderMap) -> impl Iterator<Item = &str> {
    let lists = headers.get_all(header::COOKIE).iter().filter_map(|v| v.to_str().ok());
    let pairs = lists.flat_map(|list| list.split(';')).filter_map(|one| one.trim().split_once('='));
    pairs.filter(|(name, _)| *name == COOKIE).map(|(_, session)| session)
}

/// Open streams at a time.
pub(super) const MAX_STREAMS: usize = 64;
/// When one principal has all seats, its oldest stream gives up its seat once it has had it for this time. The server cannot
/// see whether a client reads: the system's buffers hold what it does not read.
pub(super) const MIN_TIME: Duration = Duration::from_secs(8);

/// The seats, shared by all requests.
#[derive(Debug, Clone, Default)]
pub(super) struct Seats(Arc<Mutex<Taken>>);

#[derive(Debug, Default)]
struct Taken {
    next: u64,
    seats: BTreeMap<u64, Holder>,
}

#[derive(Debug)]
struct Holder {
    principal: String,
    since: Instant,
    /// Ends the stream when it is dropped.
    _end: oneshot::Sender<()>,
}

/// A seat; it is free again when this is dropped.
#[derive(Debug)]
pub(super) struct Seat {
    seats: Seats,
    number: u64,
    /// Resolves once the stream must end.
    pub(super) end: oneshot::Receiver<()>,
}

impl Seats {
    fn lock(&self) -> MutexGuard<'_, Taken> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A seat for a new stream of a principal. If all are taken, the principal with most seats gives up its oldest one: at once to a
    /// principal with fewer seats, or else after [`MIN_TIME`]; `None` before.
    pub(super) fn take(&self, principal: &str, now: Instant) -> Option<Seat> {
        let mut taken = self.lock();
        if taken.seats.len() >= MAX_STREAMS {
            let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
            taken.seats.values().for_each(|holder| *counts.entry(&holder.principal).or_default() += 1);
            let held = counts.get(principal).copied().unwrap_or(0);
            let (greediest, most) = counts.into_iter().max_by_key(|(_, seats)| *seats)?;
            let (&oldest, holder) = taken.seats.iter().find(|(_, holder)| holder.principal == greediest)?;
            if held + 1 >= most && now.saturating_duration_since(holder.since) < MIN_TIME {
                return None;
            }
            taken.seats.remove(&oldest);
        }
        let number = taken.next;
        taken.next += 1;
        let (sender, end) = oneshot::channel();
        taken.seats.insert(number, Holder { principal: principal.to_owned(), since: now, _end: sender });
        Some(Seat { seats: self.clone(), number, end })
    }
}

impl Drop for Seat {
    fn drop(&mut self) {
        self.seats.lock().seats.remove(&self.number);
    }
}

/// Edits of a principal in a second in the long run, and at once.
const PER_SECOND: f64 = 10.0;
const AT_ONCE: f64 = 100.0;

/// A token bucket (RFC 2215) for each principal, shared by all requests. Principals are those of the token file.
#[derive(Debug, Clone, Default)]
pub(super) struct EditRate(Arc<Mutex<BTreeMap<String, Bucket>>>);

#[derive(Debug)]
struct Bucket {
    edits: f64,
    at: Instant,
}

impl EditRate {
    /// Takes one edit of a principal; whether there was one left.
    pub(super) fn take(&self, principal: &str, now: Instant) -> bool {
        let mut buckets = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let bucket = buckets.entry(principal.to_owned()).or_insert(Bucket { edits: AT_ONCE, at: now });
        let since_s = now.saturating_duration_since(bucket.at).as_secs_f64();
        *bucket = Bucket { edits: (bucket.edits + PER_SECOND * since_s).min(AT_ONCE), at: now };
        let is_left = bucket.edits >= 1.0;
        bucket.edits -= f64::from(u8::from(is_left));
        is_left
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::http::HeaderValue;
    use scenecast_surface::Role;
    use std::time::Duration;
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
        let at = |last| IpAddr::from([192, 0, 2, last]);
        let begin_at = |token, last| access.begin_session(access.principal_of_token(token).unwrap(), at(last)).unwrap();
        let begin = |token| begin_at(token, 1);
        let cookie = |session: &str| with(header::COOKIE, &format!("theme=dark; {COOKIE}={session}"));
        let [first, second] = ["fedcba9876543210", "0123456789abcdef"].map(|token| cookie(&begin(token)));
        assert_eq!([&first, &second].map(|c| name(&access, c).unwrap()), ["victor", "anna"]);
        assert_eq!(name(&access, &cookie("")), None);
        access.end_session(&first);
        assert_eq!((name(&access, &first), name(&access, &second).as_deref()), (None, Some("anna")));
        (0..9 * MAX_SESSIONS).for_each(|_| drop(begin("fedcba9876543210")));
        assert_eq!(name(&access, &second).as_deref(), Some("anna"), "logins of others");
        (0..9 * MAX_SESSIONS).for_each(|_| drop(begin_at("0123456789abcdef", 2)));
        assert_eq!(name(&access, &second).as_deref(), Some("anna"), "logins elsewhere by the same token");
        (0..MAX_SESSIONS).for_each(|_| drop(begin("0123456789abcdef")));
        assert_eq!(name(&access, &second), None);
    }

    #[test]
    fn only_a_stream_that_had_its_time_gives_up_its_seat() {
        let (seats, begin) = (Seats::default(), Instant::now());
        let mut held: Vec<_> = (0..MAX_STREAMS).map(|_| seats.take("ann", begin).unwrap()).collect();
        assert!(seats.take("ann", begin + MIN_TIME / 2).is_none());
        let newer = seats.take("ann", begin + MIN_TIME).unwrap();
        assert_eq!(held[0].end.try_recv(), Err(oneshot::error::TryRecvError::Closed), "the oldest must end");
        assert_eq!(held[1].end.try_recv(), Err(oneshot::error::TryRecvError::Empty));
        drop(held);
        let seated = seats.lock().seats.len();
        assert_eq!(seated, 1, "the seat of the newest stream alone is taken");
        drop(newer);
    }

    #[test]
    fn a_principal_with_all_seats_keeps_no_other_one_out() {
        let (seats, begin) = (Seats::default(), Instant::now());
        let mut crowd: Vec<_> = (0..MAX_STREAMS).map(|_| seats.take("victor", begin).unwrap()).collect();
        let mut operator = seats.take("ann", begin).unwrap();
        assert_eq!(crowd[0].end.try_recv(), Err(oneshot::error::TryRecvError::Closed));
        assert!(seats.take("victor", begin).is_none());
        assert!(seats.take("victor", begin + MIN_TIME).is_some());
        assert_eq!(operator.end.try_recv(), Err(oneshot::error::TryRecvError::Empty));
    }

    #[test]
    fn only_a_principal_that_edits_too_fast_waits() {
        let (rate, now) = (EditRate::default(), Instant::now());
        let taken = |at| (0..1000).filter(|_| rate.take("ann", at)).count();
        assert_eq!(taken(now), 100);
        assert!(rate.take("bob", now));
        assert_eq!(taken(now + Duration::from_secs(2)), 20);
        assert_eq!(taken(now + Duration::from_secs(3600)), 100);
    }
}
