//! Who may ask.

use super::token::Access;
use axum::extract::{Request, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, Method, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Redirect, Response};
use std::net::IpAddr;
use std::sync::Arc;
use std::time::Duration;

const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; \
                      connect-src 'self'; base-uri 'none'; form-action 'self'; frame-ancestors 'none'";
/// Longest time from the head of a request to the head of its answer.
const PATIENCE: Duration = Duration::from_secs(15);

/// By which names this machine is asked.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Names {
    /// Names of the loopback addresses only.
    Loopback,
    /// Any address, and a name if it has one. A name of somebody else's could be made to point here by his DNS; an
    /// address cannot.
    Network(String),
}

/// Refuses requests that another site's page could have made or that know no token, and adds the headers that keep our
/// page to itself.
pub(super) async fn guard(State(access): State<Arc<Access>>, request: Request, next: Next) -> Response {
    let mut response = match check(request.method(), request.uri().path(), request.headers(), &access.names) {
        Err(why) => super::server::refusal(StatusCode::FORBIDDEN, why),
        Ok(()) if !access.admits(request.uri().path(), request.headers()) => stranger(request.uri().path()),
        Ok(()) => match tokio::time::timeout(PATIENCE, next.run(request)).await {
            Ok(response) => response,
            Err(_) => super::server::refusal(StatusCode::REQUEST_TIMEOUT, "the request took too long"),
        },
    };
    let headers = response.headers_mut();
    headers.insert(header::CONTENT_SECURITY_POLICY, HeaderValue::from_static(POLICY));
    headers.insert(header::X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff"));
    headers.insert(header::REFERRER_POLICY, HeaderValue::from_static("same-origin"));
    headers.insert(HeaderName::from_static("cross-origin-resource-policy"), HeaderValue::from_static("same-origin"));
    headers.entry(header::CACHE_CONTROL).or_insert(HeaderValue::from_static("no-store"));
    response
}

fn stranger(path: &str) -> Response {
    if path == "/" {
        return Redirect::to("/login").into_response();
    }
    let why = "this needs the token of console.token_file, as in Authorization: Bearer TOKEN";
    let mut response = super::server::refusal(StatusCode::UNAUTHORIZED, why);
    response.headers_mut().insert(header::WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"));
    response
}

/// A name that another site's DNS points here, or a page of another origin, is no operator of ours.
fn check(method: &Method, path: &str, headers: &HeaderMap, names: &Names) -> Result<(), &'static str> {
    let text = |name| headers.get(name).and_then(|v: &HeaderValue| v.to_str().ok());
    let host = text(header::HOST).ok_or("the request has no Host")?;
    if !is_ours(host, names) {
        return Err(match names {
            Names::Loopback => "this page is served to this machine only",
            Names::Network(_) => "this page is asked for by an address, or by the name in console.host",
        });
    }
    if let Some(origin) = text(header::ORIGIN)
        && !origin.strip_prefix("http://").is_some_and(|o| o.eq_ignore_ascii_case(host))
    {
        return Err("the request comes from another site's page");
    }
    // A form cannot send it; that of ours has the token instead.
    let is_read = matches!(*method, Method::GET | Method::HEAD);
    if !is_read && path != "/login" && text(HeaderName::from_static("x-scenecast")) != Some("1") {
        return Err("a POST needs the header X-Scenecast: 1");
    }
    Ok(())
}

fn is_ours(host: &str, names: &Names) -> bool {
    let name = match host.strip_prefix('[') {
        Some(rest) => rest.split(']').next().unwrap_or_default(),
        None => host.rsplit_once(':').map_or(host, |(name, _)| name),
    };
    let address: Option<IpAddr> = name.parse().ok();
    let is_loopback = name.eq_ignore_ascii_case("localhost") || address.is_some_and(|ip| ip.is_loopback());
    is_loopback
        || match names {
            Names::Loopback => false,
            Names::Network(own) => address.is_some() || (!own.is_empty() && name.eq_ignore_ascii_case(own)),
        }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said_to(names: &Names, method: Method, pairs: &[(&'static str, &'static str)]) -> Result<(), &'static str> {
        let headers = pairs.iter().map(|(k, v)| (HeaderName::from_static(k), HeaderValue::from_static(v)));
        check(&method, "/api/v1/budget", &headers.collect(), names)
    }

    fn said(method: Method, pairs: &[(&'static str, &'static str)]) -> Result<(), &'static str> {
        said_to(&Names::Loopback, method, pairs)
    }

    #[test]
    fn only_our_own_page_on_this_machine_may_ask() {
        assert!(said(Method::GET, &[("host", "127.0.0.1:8460")]).is_ok());
        assert!(said(Method::GET, &[("host", "[::1]:8460")]).is_ok());
        assert!(said(Method::GET, &[("host", "evil.example")]).is_err());
        assert!(said(Method::GET, &[("host", "192.168.1.7:8460")]).is_err());
        assert!(said(Method::GET, &[("host", "localhost:1"), ("origin", "http://evil.example")]).is_err());
        assert!(said(Method::POST, &[("host", "localhost:1"), ("x-scenecast", "1"), ("origin", "null")]).is_err());
        assert!(said(Method::POST, &[("host", "localhost:1")]).is_err());
        assert!(said(Method::PUT, &[("host", "localhost:1")]).is_err());
        assert!(
            said(Method::POST, &[("host", "localhost:1"), ("x-scenecast", "1"), ("origin", "http://localhost:1")])
                .is_ok()
        );
    }

    #[test]
    fn on_a_network_an_address_or_the_own_name_is_asked_for() {
        let asked = |own: &str, host| said_to(&Names::Network(own.to_owned()), Method::GET, &[("host", host)]).is_ok();
        assert!(asked("", "192.168.1.7:8460") && asked("", "[fe80::1]:8460") && asked("", "localhost"));
        assert!(!asked("", "evil.example") && !asked("", ":8460"));
        assert!(asked("surface.ship", "Surface.Ship:8460") && !asked("surface.ship", "evil.example"));
    }
}
