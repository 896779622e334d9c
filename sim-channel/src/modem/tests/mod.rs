//! Tools for the tests of all emulators.

pub(crate) mod rig;
