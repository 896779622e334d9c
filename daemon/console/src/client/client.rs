//! Requests over HTTP.

use crate::state::{Accepted, Refusal, State};
use axum::body::Bytes;
use http_body_util::{BodyExt, Full, Limited};
use hyper::body::Incoming;
use hyper::{Method, Request, Response, StatusCode, Uri, header};
use hyper_util::rt::TokioIo;
use scenecast_core::UserError;
use serde::Serialize;
use std::time::Duration;
use tokio::net::TcpStream;
use zeroize::Zeroizing;

/// Longest time to wait for an answer.
const PATIENCE: Duration = Duration::from_secs(20);
/// Events come at least once a second: without any for so long the surface is gone.
const QUIET: Duration = Duration::from_secs(15);
/// More than any answer has.
const MOST_BYTES: usize = 1 << 28;

/// Speaks with a surface at an address.
#[derive(Debug)]
pub struct Client {
    url: String,
    /// `HOST:PORT`.
    authority: String,
    token: Option<Zeroizing<String>>,
}

impl Client {
    /// A client of `http://HOST:PORT`, with a token if the surface has one.
    pub fn new(url: &str, token: Option<Zeroizing<String>>) -> Result<Self, UserError> {
        let problem = || UserError::Input(format!("--url {url}: it takes http://HOST:PORT"));
        let parsed: Uri = url.parse().map_err(|_| problem())?;
        let is_plain =
            parsed.scheme_str() == Some("http") && matches!(parsed.path(), "" | "/") && parsed.query().is_none();
        let authority = parsed.authority().filter(|a| is_plain && !a.as_str().contains('@')).ok_or_else(problem)?;
        let port = authority.port_u16().unwrap_or(80);
        let authority = format!("{}:{port}", authority.host());
        Ok(Self { url: format!("http://{authority}"), authority, token })
    }

    /// Fetches; gives the tag of the answer too.
    pub(super) async fn get(&self, path: &str) -> Result<(Bytes, Option<String>), UserError> {
        let answer = self.ask(Method::GET, path, Bytes::new()).await?;
        let tag = answer.headers().get(header::ETAG).and_then(|v| v.to_str().ok()).map(str::to_owned);
        Ok((self.whole(answer).await?, tag))
    }

    /// Sends an order.
    pub(super) async fn post(&self, path: &str, order: &impl Serialize) -> Result<Accepted, UserError> {
        let body = serde_json::to_vec(order).map_err(|e| UserError::Failed(e.to_string()))?;
        let answer = self.ask(Method::POST, path, body.into()).await?;
        serde_json::from_slice(&self.whole(answer).await?).map_err(|e| self.unlike(&e))
    }

    /// Listens to changes.
    pub(super) async fn events(&self) -> Result<Events<'_>, UserError> {
        let answer = self.ask(Method::GET, "/api/v1/events", Bytes::new()).await?;
        Ok(Events { client: self, body: answer.into_body(), buffer: Vec::new() })
    }

    async fn ask(&self, method: Method, path: &str, body: Bytes) -> Result<Response<Incoming>, UserError> {
        let answer = tokio::time::timeout(PATIENCE, self.send(method, path, body));
        let answer = answer.await.map_err(|_| self.failed(&format!("no answer within {} s", PATIENCE.as_secs())))??;
        let status = answer.status();
        if status.is_success() {
            return Ok(answer);
        }
        let body = self.whole(answer).await.unwrap_or_default();
        let said = serde_json::from_slice::<Refusal>(&body).map_or_else(|_| status.to_string(), |r| r.error);
        Err(match status {
            StatusCode::UNAUTHORIZED if self.token.is_some() => {
                self.failed("it does not take the token of --token-file")
            }
            StatusCode::UNAUTHORIZED => self.failed("it takes a token: name its file with --token-file"),
            _ => UserError::Failed(format!("refused: {said}")),
        })
    }

    async fn send(&self, method: Method, path: &str, body: Bytes) -> Result<Response<Incoming>, UserError> {
        let absent = |e: std::io::Error| self.failed(&format!("{e}; does scenecast asv or demo run there?"));
        let stream = TcpStream::connect(&self.authority).await.map_err(absent)?;
        let broken = |e: hyper::Error| self.failed(&format!("the connection broke: {e}"));
        let (mut sender, connection) =
            hyper::client::conn::http1::handshake(TokioIo::new(stream)).await.map_err(broken)?;
        // It ends with the answer, and what ends it is told there.
        tokio::spawn(connection);
        let mut request = Request::builder().method(method).uri(path).header(header::HOST, &self.authority);
        request = request.header("x-scenecast", "1").header(header::CONTENT_TYPE, "application/json");
        if let Some(token) = &self.token {
            request = request.header(header::AUTHORIZATION, format!("Bearer {}", **token));
        }
        let request = request.body(Full::new(body)).map_err(|e| UserError::Failed(e.to_string()))?;
        sender.send_request(request).await.map_err(broken)
    }

    async fn whole(&self, answer: Response<Incoming>) -> Result<Bytes, UserError> {
        let collected = tokio::time::timeout(PATIENCE, Limited::new(answer.into_body(), MOST_BYTES).collect()).await;
        let collected = collected.map_err(|_| self.failed("the answer does not end"))?;
        collected.map(|c| c.to_bytes()).map_err(|e| self.failed(&format!("the answer broke off: {e}")))
    }

    fn failed(&self, what: &str) -> UserError {
        UserError::Failed(format!("{}: {what}", self.url))
    }

    /// An answer that this version does not understand.
    pub(super) fn unlike(&self, e: &serde_json::Error) -> UserError {
        self.failed(&format!("the answer is none of scenecast {}: {e}", env!("CARGO_PKG_VERSION")))
    }
}

/// A stream of changes.
#[derive(Debug)]
pub(super) struct Events<'a> {
    client: &'a Client,
    body: Incoming,
    buffer: Vec<u8>,
}

impl Events<'_> {
    /// The next state.
    pub(super) async fn state(&mut self) -> Result<State, UserError> {
        loop {
            if let Some(end) = self.buffer.windows(2).position(|w| w == b"\n\n") {
                let event: Vec<u8> = self.buffer.drain(..end + 2).collect();
                if let Some(data) = event.strip_prefix(b"event: state\ndata: ") {
                    return serde_json::from_slice(data).map_err(|e| self.client.unlike(&e));
                }
                continue;
            }
            let frame = tokio::time::timeout(QUIET, self.body.frame()).await;
            let frame = frame.map_err(|_| self.client.failed(&format!("nothing for {} s", QUIET.as_secs())))?;
            let frame = frame.ok_or_else(|| self.client.failed("it has ended"))?;
            let frame = frame.map_err(|e| self.client.failed(&format!("the connection broke: {e}")))?;
            self.buffer.extend_from_slice(frame.data_ref().map_or(&[], |d| d));
            if self.buffer.len() > MOST_BYTES {
                return Err(self.client.failed("an event does not end"));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_is_a_host_and_perhaps_a_port() {
        let authority = |url| Client::new(url, None).map(|c| c.authority).map_err(|e| e.exit_code());
        assert_eq!(authority("http://127.0.0.1:8460").unwrap(), "127.0.0.1:8460");
        assert_eq!(authority("http://surface.ship/").unwrap(), "surface.ship:80");
        assert_eq!(authority("http://[::1]:8460").unwrap(), "[::1]:8460");
        for wrong in ["127.0.0.1:8460", "https://127.0.0.1", "http://a@b", "http://h/path", "", "http://h?q"] {
            assert_eq!(authority(wrong), Err(2), "{wrong}");
        }
    }
}
