//! Admits requests.

use super::access::{self, Access, HostNames};
use super::handlers::viewers::VIEWERS;
use super::response::error;
use super::shared::Shared;
use axum::Extension;
use axum::extract::{Request, State};
use axum::http::uri::Authority;
use axum::http::{HeaderMap, HeaderName, HeaderValue, Method, StatusCode, Uri, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Redirect, Response};
use scenecast_surface::{ClientName, Giver, Principal, Role, SurfaceRequest};
use std::net::IpAddr;
use std::sync::Arc;
use std::time::Duration;

const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; \
                      connect-src 'self'; base-uri 'none'; form-action 'self'; frame-ancestors 'none'";
/// The longest body of a refused request that the log has, bytes.
const MAX_LOGGED_BODY: usize = 256;
/// From the head of a request to the head of its response.
const RESPONSE_TIMEOUT: Duration = Duration::from_secs(15);

/// Refuses requests that the page of another site could have made and those without a token, notes the principal, and
/// adds the headers that isolate our page.
pub(super) async fn guard(State(access): State<Arc<Access>>, mut request: Request, next: Next) -> Response {
    let principal = access.identify(request.headers()).or_else(|| viewer(&access, request.uri()));
    let is_admitted = principal.is_some() || access::is_open(request.uri().path());
    let client = client_name(request.headers());
    if let (Some(principal), Some(client)) = (principal, client.clone()) {
        request.extensions_mut().insert(Giver { principal, client });
    }
    let mut response = match check(request.method(), request.uri(), request.headers(), &access) {
        // It names no resource.
        _ if *request.method() == Method::CONNECT => no_method(),
        _ if client.is_none() => error(
            StatusCode::BAD_REQUEST,
            "X-Scenecast-Client takes 1 to 32 letters, digits, dots, hyphens or underscores of ASCII",
        ),
        Err(reason) => error(StatusCode::FORBIDDEN, reason),
        Ok(()) if !is_admitted => unauthorized(request.uri().path()),
        Ok(()) => match tokio::time::timeout(RESPONSE_TIMEOUT, next.run(request)).await {
            Ok(response) => explained(response),
            Err(_) => error(StatusCode::REQUEST_TIMEOUT, "the request took too long"),
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

/// The principal whose token is in the address, for viewers: they can set no header.
fn viewer(access: &Access, uri: &Uri) -> Option<Principal> {
    let pairs = uri.query().filter(|_| uri.path() == VIEWERS)?.split('&');
    let token =
        pairs.filter_map(|pair| pair.split_once('=')).find_map(|(name, token)| (name == "token").then_some(token))?;
    access.principal_of_token(token)
}

/// Whether an origin is that of a viewer: a program on this machine, or a page that another program on it serves. The pages of other
/// sites have neither.
fn is_viewer(path: &str, origin: &str) -> bool {
    let is_local = |host: &str| ["localhost", "127.0.0.1", "[::1]"].contains(&host);
    let page = origin.strip_prefix("http://").map(|place| match place.rsplit_once(':') {
        Some((host, port)) if port.parse::<u16>().is_ok() => host,
        _ => place,
    });
    path == VIEWERS && (origin == "file://" || page.is_some_and(is_local))
}

/// What an operation needs, and how the log names it.
#[derive(Clone)]
pub(super) struct Need {
    pub(super) role: Role,
    /// A text that begins with what it does.
    pub(super) what: &'static str,
    /// Whether it changes something, so that the log has who wanted it.
    pub(super) is_logged: bool,
}

/// Refuses principals below a role. The log has what they asked for, if it is short.
pub(super) async fn require_role(
    State((need, shared)): State<(Need, Shared)>,
    by: Option<Extension<Giver>>,
    request: Request,
    next: Next,
) -> Response {
    match by {
        Some(Extension(by)) if by.role() >= need.role => next.run(request).await,
        Some(Extension(by)) => {
            let (parts, body) = request.into_parts();
            let line = format!("this needs the role {}; the role of {} is {}", need.role, by.name(), by.role());
            if need.is_logged {
                let mut path = parts.uri.path().split('/').skip_while(|part| *part != "vehicles");
                let vehicle = path.nth(1).and_then(|id| id.parse().ok());
                let what = need.what.split(['.', ';']).next().unwrap_or_default();
                let asked = axum::body::to_bytes(body, MAX_LOGGED_BODY).await.unwrap_or_default();
                let asked = String::from_utf8_lossy(&asked).replace(char::is_control, " ");
                let what = format!("{}{} {asked}: not sent: {line}", what[..1].to_lowercase(), &what[1..]);
                shared.note(by, SurfaceRequest::Barred(vehicle, what));
            }
            error(StatusCode::FORBIDDEN, &line)
        }
        None => unauthorized(request.uri().path()),
    }
}

/// The name that a client gives itself; `None` if it is not allowed.
fn client_name(headers: &HeaderMap) -> Option<ClientName> {
    let Some(name) = headers.get("x-scenecast-client") else { return Some(ClientName::default()) };
    name.to_str().ok().and_then(ClientName::new)
}

/// A refusal of the method has the reason, too. The router adds the methods of the resource to it.
fn explained(routed: Response) -> Response {
    if routed.status() == StatusCode::METHOD_NOT_ALLOWED { no_method() } else { routed }
}

fn no_method() -> Response {
    error(StatusCode::METHOD_NOT_ALLOWED, "the resource has no such method")
}

fn unauthorized(path: &str) -> Response {
    if path == "/" {
        return Redirect::to("/login").into_response();
    }
    let line = "this requires a token of console.token_file, as in Authorization: Bearer TOKEN";
    let mut response = error(StatusCode::UNAUTHORIZED, line);
    response.headers_mut().insert(header::WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"));
    response
}

/// Refuses a host name that the DNS of another site points here, and requests of pages from another origin.
fn check(method: &Method, uri: &Uri, headers: &HeaderMap, access: &Access) -> Result<(), &'static str> {
    let names = &access.names;
    let text = |name| headers.get(name).and_then(|v: &HeaderValue| v.to_str().ok());
    let host = text(header::HOST).ok_or("the request has no Host")?;
    // A program between may read another one of two names than this one.
    if headers.get_all(header::HOST).iter().count() > 1 {
        return Err("the request has several Hosts");
    }
    if uri.authority().is_some_and(|named| !named.as_str().eq_ignore_ascii_case(host)) {
        return Err("the request names one host in its address and another one in Host");
    }
    if !is_ours(host, names) {
        return Err(match names.is_on_network {
            true => "the request must name this page by an address, or by the name in console.host",
            false => "this page is served to this machine only; console.host is the name that a proxy on it passes on",
        });
    }
    if let Some(origin) = text(header::ORIGIN)
        && !["http://", "https://"]
            .iter()
            .any(|scheme| origin.strip_prefix(scheme).is_some_and(|o| o.eq_ignore_ascii_case(host)))
        && !access.origins.iter().any(|own| own.eq_ignore_ascii_case(origin))
        && !is_viewer(uri.path(), origin)
    {
        return Err("the request comes from the page of another site; console.origins has those of a proxy");
    }
    // A form cannot send the header; our login form has the token instead.
    if *method == Method::POST && uri.path() != "/login" && text(HeaderName::from_static("x-scenecast")) != Some("1") {
        return Err("a POST needs the header X-Scenecast: 1");
    }
    Ok(())
}

fn is_ours(host: &str, names: &HostNames) -> bool {
    let Some(name) = host_name(host) else { return false };
    let address: Option<IpAddr> = name.parse().ok();
    let is_loopback = name.eq_ignore_ascii_case("localhost") || address.is_some_and(|ip| ip.is_loopback());
    let is_own = !names.own.is_empty() && name.eq_ignore_ascii_case(&names.own);
    is_loopback || is_own || names.is_on_network && address.is_some()
}

/// The name or the address in `HOST[:PORT]` (RFC 9110, section 7.2), without the brackets of IPv6.
fn host_name(host: &str) -> Option<String> {
    let authority: Authority = host.parse().ok()?;
    let name = authority.host();
    let exact = authority.port_u16().map_or(name.to_owned(), |port| format!("{name}:{port}"));
    if host != exact {
        return None;
    }
    Some(name.strip_prefix('[').and_then(|name| name.strip_suffix(']')).unwrap_or(name).to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn checked_with(
        names: &HostNames,
        method: Method,
        pairs: &[(&'static str, &'static str)],
    ) -> Result<(), &'static str> {
        let headers = pairs.iter().map(|(k, v)| (HeaderName::from_static(k), HeaderValue::from_static(v)));
        check(&method, &Uri::from_static("/api/v2/budget"), &headers.collect(), &Access::new(names.clone(), Vec::new()))
    }

    #[test]
    fn a_request_names_one_host() {
        let named = |uri: &'static str, hosts: &[&'static str]| {
            let mut headers = HeaderMap::new();
            headers.extend(hosts.iter().map(|host| (header::HOST, HeaderValue::from_static(host))));
            check(&Method::GET, &Uri::from_static(uri), &headers, &Access::new(HostNames::default(), Vec::new()))
        };
        assert!(named("http://localhost:1/", &["localhost:1"]).is_ok());
        assert!(named("/", &["localhost:1", "evil.example"]).unwrap_err().contains("several Hosts"));
        assert!(named("/", &["localhost:1", "localhost:1"]).is_err());
        assert!(named("http://evil.example/", &["localhost:1"]).unwrap_err().contains("in its address"));
    }

    fn checked(method: Method, pairs: &[(&'static str, &'static str)]) -> Result<(), &'static str> {
        checked_with(&HostNames::default(), method, pairs)
    }

    #[test]
    fn only_our_page_on_this_machine_is_admitted() {
        assert!(checked(Method::GET, &[("host", "127.0.0.1:8460")]).is_ok());
        assert!(checked(Method::GET, &[("host", "[::1]:8460")]).is_ok());
        assert!(checked(Method::GET, &[("host", "evil.example")]).is_err());
        let wrong =
            ["127.0.0.1:", "127.0.0.1:99999", "localhost:x", "[::1]evil:1", "[::1", "a@localhost", "localhost/x"];
        for host in wrong {
            assert!(checked(Method::GET, &[("host", host)]).is_err(), "{host}");
        }
        assert!(checked(Method::GET, &[("host", "192.168.1.7:8460")]).is_err());
        assert!(checked(Method::GET, &[("host", "localhost:1"), ("origin", "http://evil.example")]).is_err());
        assert!(checked(Method::POST, &[("host", "localhost:1"), ("x-scenecast", "1"), ("origin", "null")]).is_err());
        assert!(checked(Method::POST, &[("host", "localhost:1")]).is_err());
        assert!(
            checked(Method::POST, &[("host", "localhost:1"), ("x-scenecast", "1"), ("origin", "http://localhost:1")])
                .is_ok()
        );
    }

    #[test]
    fn viewers_on_this_machine_read_and_other_sites_do_not() {
        let from = |path: &'static str, origin: &'static str| {
            let pairs = [("host", "127.0.0.1:8460"), ("origin", origin)];
            let headers = pairs.map(|(k, v)| (HeaderName::from_static(k), HeaderValue::from_static(v)));
            let access = Access::new(HostNames::default(), Vec::new());
            check(&Method::GET, &Uri::from_static(path), &HeaderMap::from_iter(headers), &access).is_ok()
        };
        for origin in ["file://", "http://localhost:8080", "http://127.0.0.1", "http://[::1]:9"] {
            assert!(from(VIEWERS, origin) && !from("/api/v2/state", origin), "{origin}");
        }
        for origin in ["null", "http://evil.example", "http://localhost.evil.example:80", "https://localhost:1"] {
            assert!(!from(VIEWERS, origin), "{origin}");
        }
    }

    fn on_network(own: &str) -> HostNames {
        HostNames { own: own.to_owned(), is_on_network: true }
    }

    #[test]
    fn a_page_behind_a_proxy_that_encrypts_gives_orders() {
        let post = |origin: &'static str, origins: &[&str]| {
            let mut access = Access::new(on_network("surface.ship"), Vec::new());
            access.origins = origins.iter().map(|origin| (*origin).to_owned()).collect();
            let pairs = [("host", "surface.ship"), ("x-scenecast", "1"), ("origin", origin)];
            let headers = pairs.map(|(k, v)| (HeaderName::from_static(k), HeaderValue::from_static(v)));
            check(&Method::POST, &Uri::from_static("/api/v2/budget"), &HeaderMap::from_iter(headers), &access)
        };
        assert!(post("https://surface.ship", &[]).is_ok());
        assert!(post("https://page.example", &[]).unwrap_err().contains("console.origins"));
        assert!(post("https://page.example", &["https://page.example"]).is_ok());
        for wrong in ["https://evil.example", "http://page.example", "https://page.example:444", "null"] {
            assert!(post(wrong, &["https://page.example"]).is_err(), "{wrong}");
        }
    }

    #[test]
    fn on_a_network_a_request_names_an_address_or_our_name() {
        let admits = |own: &str, host| checked_with(&on_network(own), Method::GET, &[("host", host)]).is_ok();
        assert!(admits("", "192.168.1.7:8460") && admits("", "[fe80::1]:8460") && admits("", "localhost"));
        assert!(!admits("", "evil.example") && !admits("", ":8460"));
        let behind_proxy = HostNames { own: "surface.ship".to_owned(), is_on_network: false };
        assert!(checked_with(&behind_proxy, Method::GET, &[("host", "surface.ship")]).is_ok());
        assert!(checked_with(&behind_proxy, Method::GET, &[("host", "192.168.1.7:8460")]).is_err());
        assert!(admits("surface.ship", "Surface.Ship:8460") && !admits("surface.ship", "evil.example"));
    }
}
