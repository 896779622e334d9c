//! The terms that all transports share: quality of service, peers, and a subscription on one of them.

mod own;
mod peers;
mod qos;

pub(crate) use own::{OwnId, OwnIds};
pub(crate) use peers::counts;
pub use peers::{Peers, Transport};
pub use qos::Qos;

use scenecast_core::UserError;
use std::any::Any;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// A subscription on one transport.
pub(crate) struct Feed {
    pub transport: Transport,
    /// The number of its publishers now; `None` once it has ended.
    pub publishers: Box<dyn Fn() -> Option<usize> + Send>,
    /// Ends the subscription when it is dropped.
    pub ending: Box<dyn Any + Send + Sync>,
}

pub(crate) fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

pub(crate) fn failed(action: &str, error: &dyn std::fmt::Display) -> UserError {
    UserError::Failed(format!("ROS 2: {action}: {error}"))
}
