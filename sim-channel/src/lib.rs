//! Acoustic channel and modem emulators.
