//! Listens, and joins the parts of the server.

use super::access::{Access, HostNames};
use super::response::page;
use super::shared::{PendingRequest, Shared};
use super::{connections, guard, openapi, operations, response};
use axum::Router;
use axum::extract::DefaultBodyLimit;
use scenecast_config::TokenGrant;
use scenecast_core::{Principal, UserError};
use scenecast_surface::Snapshot;
use std::sync::Arc;
use tokio::net::TcpListener;
use tokio::sync::{mpsc, watch};

const MAX_BODY_BYTES: usize = 16 * 1024;
/// Requests that may wait for the surface.
const MAX_PENDING: usize = 64;

/// The host's end of the console.
#[derive(Debug)]
pub struct Console {
    /// Requests of clients, to be handled between two steps.
    pub requests: mpsc::Receiver<PendingRequest>,
    /// The state that all pages show.
    pub snapshots: watch::Sender<Arc<Snapshot>>,
}

/// A socket that listens, and the rules of access to it.
#[derive(Debug)]
pub struct ConsoleListener {
    listener: TcpListener,
    access: Access,
}

/// Listens on an address. `option` is the setting or the argument that changes it, for error messages; `name` is the name of
/// this machine in the network, or empty.
///
/// # Errors
///
/// An address that is in use, or one that other machines reach while there is no token.
pub async fn bind(
    address: &str,
    option: &str,
    tokens: Vec<TokenGrant>,
    name: &str,
) -> Result<ConsoleListener, UserError> {
    let addresses: Vec<_> = tokio::net::lookup_host(address)
        .await
        .map_err(|e| UserError::Input(format!("{option}: {address} is not an ADDRESS:PORT to listen on: {e}")))?
        .collect();
    let is_loopback = addresses.iter().all(|a| a.ip().is_loopback());
    if !is_loopback && tokens.is_empty() {
        return Err(UserError::Input(format!(
            "{option} = {address}: other machines could give orders to the vehicle; set console.token_file to a file \
             written by scenecast key token, or listen on a loopback address such as 127.0.0.1:8460"
        )));
    }
    let names = HostNames { own: name.to_owned(), is_on_network: !is_loopback };
    let listener = TcpListener::bind(address)
        .await
        .map_err(|e| UserError::Input(format!("cannot listen on {address}: {e}; choose another port with {option}")))?;
    Ok(ConsoleListener { listener, access: Access::new(names, tokens) })
}

impl ConsoleListener {
    /// The page is also reached under these origins, as through a proxy that encrypts.
    #[must_use]
    pub fn with_origins(mut self, origins: Vec<String>) -> Self {
        self.access.origins = origins;
        self
    }

    /// Whoever reaches the listener, where there are no tokens, may read and gives no orders.
    #[must_use]
    pub fn for_viewers(mut self) -> Self {
        self.access.local = Principal::local_viewer();
        self
    }
}

/// Serves the page until the runtime ends.
pub fn start(listener: ConsoleListener) -> Console {
    let (sender, requests) = mpsc::channel(MAX_PENDING);
    let (snapshots, receiver) = watch::channel(Arc::new(Snapshot::default()));
    let shared = Shared::new(sender, receiver, listener.access, openapi::document().into());
    tokio::spawn(connections::serve(listener.listener, router(shared)));
    Console { requests, snapshots }
}

fn router(shared: Shared) -> Router {
    let routes = operations::operations().into_iter().fold(Router::new(), |router, o| {
        let route = (o.route)();
        router.route(
            o.path,
            match o.role {
                Some(role) => {
                    let is_logged = o.method != axum::http::Method::GET;
                    let need = guard::Need { role, what: o.summary, is_logged };
                    let state = (need, shared.clone());
                    route.route_layer(axum::middleware::from_fn_with_state(state, guard::require_role))
                }
                None => route,
            },
        )
    });
    routes
        .fallback(page)
        .layer(axum::middleware::from_fn(response::compress))
        .layer(DefaultBodyLimit::max(MAX_BODY_BYTES))
        .layer(axum::middleware::from_fn_with_state(shared.access.clone(), guard::guard))
        .with_state(shared)
}
