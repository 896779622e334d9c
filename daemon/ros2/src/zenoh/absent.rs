//! Stands for rmw_zenoh in builds without the feature `zenoh`: nothing of it ever exists.

use crate::inbox::Filler;
use crate::transport::{Feed, Peers, Qos};
use scenecast_config::{Ros2, RosName};
use scenecast_core::UserError;
use scenecast_messages::{Definition, Message};
use std::sync::Arc;

pub(crate) enum Zenoh {}

pub(crate) enum ZenohPublisher {}

impl Zenoh {
    /// # Errors
    ///
    /// Always.
    pub fn start(settings: &Ros2, _: &str) -> Result<Arc<Self>, UserError> {
        let text = "this build has no rmw_zenoh; build it with the feature zenoh, or set it to \"dds\"";
        Err(UserError::Input(format!("ros2.transport = \"{}\": {text}", settings.transport)))
    }

    pub fn subscribe<M: Message>(&self, _: &RosName, _: Qos, _: Filler<M>) -> Result<Feed, UserError> {
        match *self {}
    }

    pub fn publisher(&self, _: &Definition, _: &RosName, _: Qos) -> Result<ZenohPublisher, UserError> {
        match *self {}
    }

    pub fn peers(&self) -> Peers {
        match *self {}
    }

    pub fn has_router(&self) -> bool {
        match *self {}
    }
}

impl ZenohPublisher {
    pub fn subscribers(&self) -> usize {
        match *self {}
    }

    pub fn is_wanted(&self) -> bool {
        match *self {}
    }

    pub fn publish(&self, _: Vec<u8>) -> bool {
        match *self {}
    }
}
