//! Who may ask.

use axum::extract::Request;
use axum::http::{HeaderMap, HeaderValue, Method, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

const POLICY: &str = "default-src 'self'; img-src 'self' data: blob:; object-src 'none'; base-uri 'none'; \
                      form-action 'none'; frame-ancestors 'none'";

/// Refuses requests that another site's page could have made, and adds the headers that keep ours to itself.
pub(super) async fn guard(request: Request, next: Next) -> Response {
    if let Err(why) = check(request.method(), request.headers()) {
        return (StatusCode::FORBIDDEN, axum::Json(serde_json::json!({ "error": why }))).into_response();
    }
    let mut response = next.run(request).await;
    let headers = response.headers_mut();
    headers.insert(header::CONTENT_SECURITY_POLICY, HeaderValue::from_static(POLICY));
    headers.insert(header::X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff"));
    headers.insert(header::REFERRER_POLICY, HeaderValue::from_static("no-referrer"));
    headers.entry(header::CACHE_CONTROL).or_insert(HeaderValue::from_static("no-store"));
    response
}

/// A name that another site's DNS points here, or a page of another origin, is no operator of ours.
fn check(method: &Method, headers: &HeaderMap) -> Result<(), &'static str> {
    let text = |name| headers.get(name).and_then(|v: &HeaderValue| v.to_str().ok());
    let host = text(header::HOST).ok_or("the request has no Host")?;
    if !is_loopback(host) {
        return Err("this page is served to this machine only");
    }
    if let Some(origin) = text(header::ORIGIN)
        && origin != format!("http://{host}")
    {
        return Err("the request comes from another site's page");
    }
    if *method == Method::POST && text(header::HeaderName::from_static("x-scenecast")) != Some("1") {
        return Err("a POST needs the header X-Scenecast: 1");
    }
    Ok(())
}

fn is_loopback(host: &str) -> bool {
    let name = match host.strip_prefix('[') {
        Some(rest) => rest.split(']').next().unwrap_or_default(),
        None => host.rsplit_once(':').map_or(host, |(name, _)| name),
    };
    name == "localhost" || name.parse::<std::net::IpAddr>().is_ok_and(|ip| ip.is_loopback())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(method: Method, pairs: &[(&'static str, &'static str)]) -> Result<(), &'static str> {
        let headers = pairs.iter().map(|(k, v)| (header::HeaderName::from_static(k), HeaderValue::from_static(v)));
        check(&method, &headers.collect())
    }

    #[test]
    fn only_our_own_page_on_this_machine_may_ask() {
        assert!(said(Method::GET, &[("host", "127.0.0.1:8460")]).is_ok());
        assert!(said(Method::GET, &[("host", "[::1]:8460")]).is_ok());
        assert!(said(Method::GET, &[("host", "evil.example")]).is_err());
        assert!(said(Method::GET, &[("host", "localhost:1"), ("origin", "http://evil.example")]).is_err());
        assert!(said(Method::POST, &[("host", "localhost:1")]).is_err());
        assert!(
            said(Method::POST, &[("host", "localhost:1"), ("x-scenecast", "1"), ("origin", "http://localhost:1")])
                .is_ok()
        );
    }
}
