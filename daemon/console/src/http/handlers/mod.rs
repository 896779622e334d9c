//! The handlers of all operations.

pub(super) mod login;
pub(super) mod maps;
pub(super) mod metrics;
pub(super) mod orders;
pub(super) mod readings;
pub(super) mod viewers;
