//! Standard output and standard error output of commands.

use std::fmt;
use std::io::{ErrorKind, Write};

/// Writes to standard output. Where that fails, as on a full disk, the program ends with one line and exit code 1; where the reader has
/// gone, as with `| head`, it ends with exit code 0.
#[doc(hidden)]
pub fn write_or_exit(text: fmt::Arguments<'_>) {
    let mut out = std::io::stdout().lock();
    let Err(error) = out.write_fmt(text).and_then(|()| out.flush()) else { return };
    if error.kind() != ErrorKind::BrokenPipe {
        write_error(format_args!("scenecast: standard output: {error}\n"));
    }
    std::process::exit(i32::from(error.kind() != ErrorKind::BrokenPipe));
}

/// Writes to the standard error output. Where that fails nobody reads it, and the program goes on.
#[doc(hidden)]
pub fn write_error(text: fmt::Arguments<'_>) {
    let _ = std::io::stderr().lock().write_fmt(text);
}

/// `eprintln!` for commands, without a panic where the standard error output fails.
#[macro_export]
macro_rules! errln {
    ($($text:tt)*) => { $crate::write_error(format_args!("{}\n", format_args!($($text)*))) };
}

/// `print!` for commands, without a panic where standard output fails.
#[macro_export]
macro_rules! out {
    ($($text:tt)*) => { $crate::write_or_exit(format_args!($($text)*)) };
}

/// `println!` for commands, without a panic where standard output fails.
#[macro_export]
macro_rules! outln {
    () => { $crate::write_or_exit(format_args!("\n")) };
    ($($text:tt)*) => { $crate::write_or_exit(format_args!("{}\n", format_args!($($text)*))) };
}
