//! The scenecast daemon.
