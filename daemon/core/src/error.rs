//! The error that ends a command.

use crate::printable;
use std::fmt;
use std::path::Path;

/// An error that ends a command; its kind gives the exit code.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum UserError {
    /// Wrong usage or input, exit code 2: one line with the cause, the place and the allowed values.
    Input(String),
    /// Right usage, but it could not be done. Exit code 1.
    Failed(String),
}

impl UserError {
    /// An error of a file, as `FILE: cause`.
    pub fn file(path: &Path, what: impl fmt::Display) -> Self {
        Self::Input(format!("{}: {what}", path.display()))
    }

    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Input(_) => 2,
            Self::Failed(_) => 1,
        }
    }
}

impl fmt::Display for UserError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            // One line, whatever a library has put into its message.
            Self::Input(what) | Self::Failed(what) => {
                f.write_str(&printable(&what.split_whitespace().collect::<Vec<_>>().join(" ")))
            }
        }
    }
}

impl std::error::Error for UserError {}
