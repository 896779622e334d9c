//! Requests over HTTP.

use crate::bodies::ErrorBody;
use axum::body::Bytes;
use http_body_util::{BodyExt, Full, Limited};
use hyper::body::Incoming;
use hyper::{Method, Request, Response, StatusCode, Uri, header};
use hyper_util::rt::TokioIo;
use scenecast_core::{ClientName, UserError};
use scenecast_surface::state::MissionState;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::time::Duration;
use tokio::net::TcpStream;
use zeroize::Zeroizing;

const RESPONSE_TIMEOUT: Duration = Duration::from_secs(20);
/// For the next event. The surface sends at least one a second.
const EVENT_TIMEOUT: Duration = Duration::from_secs(15);
const MAX_BYTES: usize = 1 << 28;

/// An HTTP client of one surface.
#[derive(Debug)]
pub struct Client {
    url: String,
    /// The part `HOST:PORT` of the URL.
    authority: String,
    token: Option<Zeroizing<String>>,
    /// The name that we give ourselves.
    name: ClientName,
}

impl Client {
    /// A client of `http://HOST:PORT` with a name, and a token if the surface requires one.
    pub fn new(url: &str, token: Option<Zeroizing<String>>, name: ClientName) -> Result<Self, UserError> {
        let error = || UserError::Input(format!("--url {url}: expected http://HOST:PORT"));
        let parsed: Uri = url.parse().map_err(|_| error())?;
        let is_plain =
            parsed.scheme_str() == Some("http") && matches!(parsed.path(), "" | "/") && parsed.query().is_none();
        let authority = parsed.authority().filter(|a| is_plain && !a.as_str().contains('@')).ok_or_else(error)?;
        let port = match authority.port_u16() {
            Some(port) => port,
            None if authority.as_str() == authority.host() => 80,
            None => return Err(error()),
        };
        let authority = format!("{}:{port}", authority.host());
        Ok(Self { url: format!("http://{authority}"), authority, token, name })
    }

    pub(super) fn name(&self) -> &str {
        self.name.as_str()
    }

    /// The body and the `ETag` of a resource.
    pub(super) async fn get(&self, path: &str) -> Result<(Bytes, Option<String>), UserError> {
        let response = self.send(Method::GET, path, Bytes::new()).await?;
        let tag = response.headers().get(header::ETAG).and_then(|v| v.to_str().ok()).map(str::to_owned);
        Ok((self.body(response).await?, tag))
    }

    /// Sends an order and reads its receipt.
    pub(super) async fn post<T: DeserializeOwned>(&self, path: &str, order: &impl Serialize) -> Result<T, UserError> {
        let body = serde_json::to_vec(order).map_err(UserError::failed)?;
        let response = self.send(Method::POST, path, body.into()).await?;
        serde_json::from_slice(&self.body(response).await?).map_err(|e| self.unreadable(&e))
    }

    /// Reads a resource as JSON.
    pub async fn read<T: DeserializeOwned>(&self, path: &str) -> Result<T, UserError> {
        serde_json::from_slice(&self.get(path).await?.0).map_err(|e| self.unreadable(&e))
    }

    /// Reads the bytes of a resource.
    pub async fn read_bytes(&self, path: &str) -> Result<Bytes, UserError> {
        Ok(self.get(path).await?.0)
    }

    /// Sends an order, whose receipt does not matter.
    pub async fn send_order(&self, path: &str, order: &impl Serialize) -> Result<(), UserError> {
        let body = serde_json::to_vec(order).map_err(UserError::failed)?;
        self.send(Method::POST, path, body.into()).await.map(drop)
    }

    /// Opens the stream of events.
    pub(super) async fn events(&self) -> Result<EventStream<'_>, UserError> {
        let response = self.send(Method::GET, "/api/v2/events", Bytes::new()).await?;
        Ok(EventStream { client: self, body: response.into_body(), buffer: Vec::new() })
    }

    /// The response, if its status is a success.
    async fn send(&self, method: Method, path: &str, body: Bytes) -> Result<Response<Incoming>, UserError> {
        let response = tokio::time::timeout(RESPONSE_TIMEOUT, self.exchange(method, path, body)).await;
        let late = |_| self.failed(&format!("no response within {} s", RESPONSE_TIMEOUT.as_secs()));
        let response = response.map_err(late)??;
        let status = response.status();
        if status.is_success() {
            return Ok(response);
        }
        let body = self.body(response).await.unwrap_or_default();
        let line = serde_json::from_slice::<ErrorBody>(&body).map_or_else(|_| status.to_string(), |e| e.error);
        Err(match status {
            StatusCode::UNAUTHORIZED if self.token.is_some() => {
                self.failed("it does not accept the token of --token-file")
            }
            StatusCode::UNAUTHORIZED => self.failed("it requires a token: name its file with --token-file"),
            _ => UserError::Failed(format!("refused: {line}")),
        })
    }

    async fn exchange(&self, method: Method, path: &str, body: Bytes) -> Result<Response<Incoming>, UserError> {
        let absent = |e: std::io::Error| self.failed(&format!("{e}; is scenecast asv or demo running there?"));
        let stream = TcpStream::connect(&self.authority).await.map_err(absent)?;
        let broken = |e: hyper::Error| self.failed(&format!("the connection broke: {e}"));
        let (mut sender, connection) =
            hyper::client::conn::http1::handshake(TokioIo::new(stream)).await.map_err(broken)?;
        // It ends with the response, which reports its errors.
        tokio::spawn(connection);
        let mut request = Request::builder().method(method).uri(path).header(header::HOST, &self.authority);
        request = request.header("x-scenecast", "1").header(header::CONTENT_TYPE, "application/json");
        if !self.name.as_str().is_empty() {
            request = request.header("x-scenecast-client", self.name.as_str());
        }
        if let Some(token) = &self.token {
            request = request.header(header::AUTHORIZATION, format!("Bearer {}", **token));
        }
        let request = request.body(Full::new(body)).map_err(UserError::failed)?;
        sender.send_request(request).await.map_err(broken)
    }

    async fn body(&self, response: Response<Incoming>) -> Result<Bytes, UserError> {
        let collected =
            tokio::time::timeout(RESPONSE_TIMEOUT, Limited::new(response.into_body(), MAX_BYTES).collect()).await;
        let collected = collected.map_err(|_| self.failed("the response does not end"))?;
        collected.map(|c| c.to_bytes()).map_err(|e| self.failed(&format!("the response was interrupted: {e}")))
    }

    fn failed(&self, line: &str) -> UserError {
        UserError::Failed(format!("{}: {line}", self.url))
    }

    /// The error for a response of another version.
    pub(super) fn unreadable(&self, e: &serde_json::Error) -> UserError {
        self.failed(&format!("the response is not that of scenecast {}: {e}", env!("CARGO_PKG_VERSION")))
    }
}

#[derive(Debug)]
pub(super) struct EventStream<'a> {
    client: &'a Client,
    body: Incoming,
    buffer: Vec<u8>,
}

impl EventStream<'_> {
    pub(super) async fn state(&mut self) -> Result<MissionState, UserError> {
        loop {
            if let Some(end) = self.buffer.windows(2).position(|w| w == b"\n\n") {
                let event: Vec<u8> = self.buffer.drain(..end + 2).collect();
                if let Some(data) = event.strip_prefix(b"event: state\ndata: ") {
                    return serde_json::from_slice(data).map_err(|e| self.client.unreadable(&e));
                }
                continue;
            }
            let frame = tokio::time::timeout(EVENT_TIMEOUT, self.body.frame()).await;
            let frame =
                frame.map_err(|_| self.client.failed(&format!("no event for {} s", EVENT_TIMEOUT.as_secs())))?;
            let frame = frame.ok_or_else(|| self.client.failed("it has ended"))?;
            let frame = frame.map_err(|e| self.client.failed(&format!("the connection broke: {e}")))?;
            self.buffer.extend_from_slice(frame.data_ref().map_or(&[], |d| d));
            if self.buffer.len() > MAX_BYTES {
                return Err(self.client.failed("an event does not end"));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_is_a_host_with_an_optional_port() {
        let authority =
            |url| Client::new(url, None, ClientName::default()).map(|c| c.authority).map_err(|e| e.exit_code());
        assert_eq!(authority("http://127.0.0.1:8460").unwrap(), "127.0.0.1:8460");
        assert_eq!(authority("http://surface.ship/").unwrap(), "surface.ship:80");
        assert_eq!(authority("http://[::1]:8460").unwrap(), "[::1]:8460");
        for wrong in [
            "127.0.0.1:8460",
            "https://127.0.0.1",
            "http://a@b",
            "http://h/path",
            "",
            "http://h?q",
            "http://h:99999",
            "http://h:",
        ] {
            assert_eq!(authority(wrong), Err(2), "{wrong}");
        }
    }
}
