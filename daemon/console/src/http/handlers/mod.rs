//! The handlers of all operations.

pub(super) mod command;
pub(super) mod events;
pub(super) mod log;
pub(super) mod login;
pub(super) mod maps;
pub(super) mod metrics;
pub(super) mod orders;
pub(super) mod readings;
