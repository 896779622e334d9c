//! Tests of the byte pipe, and the rig that the tests of all emulators use.

pub(crate) mod rig;
mod transparent;
