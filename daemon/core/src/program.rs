//! The name and version of the program that runs.

use std::sync::OnceLock;

static PROGRAM: OnceLock<String> = OnceLock::new();

/// Sets what [`program`] says; the first call counts.
pub fn set_program(program: &str) {
    _ = PROGRAM.set(program.to_owned());
}

/// The program with its version, for records and reports.
pub fn program() -> &'static str {
    PROGRAM.get_or_init(|| format!("scenecast {}", env!("CARGO_PKG_VERSION")))
}
