//! ROS 2 by Zenoh, as `rmw_zenoh_cpp` speaks it from Humble to Rolling.
//!
//! Nodes find each other by a router, and by liveliness tokens that each of them declares. A session that loses the router
//! looks for it again by itself.

mod graph;
mod keys;
mod publisher;

pub(crate) use publisher::ZenohPublisher;

use crate::inbox::Filler;
use crate::transport::{Feed, Peers, Qos, Transport, failed};
use graph::Graph;
use keys::{Endpoint, Kind, TokenMaker};
use scenecast_config::{Ros2, RosName};
use scenecast_core::UserError;
use scenecast_messages::{Definition, Message};
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use zenoh::liveliness::LivelinessToken;
use zenoh::sample::SampleKind;
use zenoh::{Session, Wait};

/// A session with one node.
pub(crate) struct Zenoh {
    session: Session,
    graph: Arc<Graph>,
    tokens: TokenMaker,
    next_id: AtomicU32,
    _node: LivelinessToken,
    _graph: zenoh::pubsub::Subscriber<()>,
}

impl Zenoh {
    /// Opens a session; the router need not be there yet.
    ///
    /// # Errors
    ///
    /// The session did not open, for example since no port of the loopback network is free.
    pub fn start(settings: &Ros2, name: &str) -> Result<Arc<Self>, UserError> {
        let session = graph::open_session(settings).map_err(|e| failed("Zenoh did not start", &e))?;
        let id = session.zid().to_string();
        let graph = Arc::new(Graph::new(id.clone()));
        let tokens = TokenMaker { domain: settings.domain, session: id, node: name.to_owned() };
        let filled = graph.clone();
        let liveliness = session.liveliness();
        let subscriber = liveliness.declare_subscriber(keys::all_tokens(settings.domain)).history(true);
        let subscriber = subscriber.callback(move |sample| match sample.kind() {
            SampleKind::Put => filled.insert(sample.key_expr().as_str()),
            SampleKind::Delete => filled.remove(sample.key_expr().as_str()),
        });
        let subscriber = subscriber.wait().map_err(|e| failed("the graph of Zenoh", &e))?;
        let node = liveliness.declare_token(tokens.node()).wait().map_err(|e| failed("the node did not start", &e))?;
        Ok(Arc::new(Self { session, graph, tokens, next_id: AtomicU32::new(1), _node: node, _graph: subscriber }))
    }

    /// A subscription that fills an inbox.
    ///
    /// # Errors
    ///
    /// The session has ended.
    pub fn subscribe<M: Message>(&self, name: &RosName, qos: Qos, filler: Filler<M>) -> Result<Feed, UserError> {
        let endpoint = endpoint(name, M::DEFINITION);
        let refused = |e: zenoh::Error| failed(name.as_str(), &e);
        // Any type hash, for publishers of Humble, which have none.
        let key = endpoint.key(self.tokens.domain, "*");
        let read = publisher::subscription_reader(filler, &endpoint);
        let subscriber = publisher::declare_subscription(&self.session, key, qos, read).map_err(refused)?;
        let (token, _) = self.announce(Kind::Subscription, &endpoint, qos).map_err(refused)?;
        let alive = Arc::new(());
        let (ended, graph) = (Arc::downgrade(&alive), self.graph.clone());
        let publishers = move || ended.upgrade().map(|_| graph.count(Kind::Publisher, &endpoint));
        let ending = Box::new((token, subscriber, alive));
        Ok(Feed { transport: Transport::Zenoh, publishers: Box::new(publishers), ending })
    }

    /// # Errors
    ///
    /// The session has ended.
    pub fn publisher(
        self: &Arc<Self>,
        message: &Definition,
        name: &RosName,
        qos: Qos,
    ) -> Result<ZenohPublisher, UserError> {
        let endpoint = endpoint(name, message);
        ZenohPublisher::declare(self, endpoint, qos).map_err(|e| failed(name.as_str(), &e))
    }

    /// The nodes of other sessions.
    pub fn peers(&self) -> Peers {
        self.graph.peers()
    }

    /// Whether the session is connected to a router.
    pub fn has_router(&self) -> bool {
        self.session.info().routers_zid().wait().next().is_some()
    }

    /// Declares the liveliness token of an endpoint; returns it with its key.
    fn announce(&self, kind: Kind, endpoint: &Endpoint, qos: Qos) -> zenoh::Result<(LivelinessToken, String)> {
        let id = self.next_id.fetch_add(1, Ordering::Relaxed);
        let key = self.tokens.endpoint(id, kind, endpoint, qos);
        Ok((self.session.liveliness().declare_token(key.clone()).wait()?, key))
    }
}

fn endpoint(name: &RosName, definition: &Definition) -> Endpoint {
    Endpoint { topic: name.as_str().to_owned(), dds_type: definition.dds_name(), hash: definition.type_hash() }
}
