//! Standard output and standard error output of commands: texts from outside made safe for a terminal, how often people are
//! reminded of something that lasts, and the error that ends a command.

use scenecast_protocol::time::Instant;
use std::borrow::Cow;
use std::fmt;
use std::io::{ErrorKind, Write};
use std::path::Path;
use std::time::Duration;

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

/// The text of an option or argument is not one of its values, which this sentence describes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Takes(pub &'static str);

impl fmt::Display for Takes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.0)
    }
}

impl std::error::Error for Takes {}

/// An error that ends a command; its kind gives the exit code.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum UserError {
    /// Wrong usage or input, exit code 2: one line with the cause, the place and the allowed values.
    Input(String),
    /// Right usage, but it could not be done. Exit code 1.
    Failed(String),
}

impl UserError {
    /// Wrong usage or input that a type describes in one line.
    pub fn input(what: impl fmt::Display) -> Self {
        Self::Input(what.to_string())
    }

    /// What could not be done, which a type describes in one line.
    pub fn failed(what: impl fmt::Display) -> Self {
        Self::Failed(what.to_string())
    }

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

/// The text with each control character but line feed and tab, and each character that changes the direction of writing, as
/// `\uXXXX`. A name could otherwise move the cursor, or show one word in place of another. In JSON the text stays the same value.
pub fn printable(text: &str) -> Cow<'_, str> {
    use std::fmt::Write as _;
    if !text.chars().any(is_unsafe) {
        return Cow::Borrowed(text);
    }
    let mut out = String::with_capacity(text.len());
    for character in text.chars() {
        match is_unsafe(character) {
            // All of them have four digits.
            true => drop(write!(out, "\\u{:04x}", u32::from(character))),
            false => out.push(character),
        }
    }
    Cow::Owned(out)
}

/// The text as a part of one line: a break of the line in it, which could forge a line of its own, is a space.
pub fn one_line(text: &str) -> String {
    text.replace(['\n', '\r', '\u{0B}', '\u{0C}', '\u{85}', '\u{2028}', '\u{2029}'], " ")
}

fn is_unsafe(character: char) -> bool {
    let turns =
        matches!(character, '\u{61C}' | '\u{200E}' | '\u{200F}' | '\u{202A}'..='\u{202E}' | '\u{2066}'..='\u{2069}');
    turns || character.is_control() && !matches!(character, '\n' | '\t')
}

/// Tells of an event at once, then after pauses that double from one minute to [`Reminder::LONGEST`]; after such a time of calm,
/// at once again.
#[derive(Debug, Default)]
pub struct Reminder {
    /// When people were told last, and for how long they are not told again.
    told: Option<(Instant, Duration)>,
    /// When the last event came, whether or not it was reported.
    last: Option<Instant>,
    /// Events since people were told.
    untold: u32,
}

impl Reminder {
    const FIRST: Duration = Duration::from_secs(60);
    /// The longest pause between two notes of events that go on.
    pub const LONGEST: Duration = Duration::from_secs(16 * 60);

    /// Takes an event. Where people should know, returns the number of events since they were told last, this one included.
    pub fn handle(&mut self, now: Instant) -> Option<u32> {
        let is_calm = self.last.replace(now).is_none_or(|last| now.since(last) >= Self::LONGEST);
        if is_calm {
            self.told = None;
        }
        self.untold = self.untold.saturating_add(1);
        let pause = match self.told {
            Some((at, pause)) if now.since(at) < pause => return None,
            Some((_, pause)) => (pause * 2).min(Self::LONGEST),
            None => Self::FIRST,
        };
        self.told = Some((now, pause));
        Some(std::mem::take(&mut self.untold))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_moves_no_cursor_and_turns_no_line_around() {
        assert_eq!(printable("Plattfisch\n\tπλάτος"), "Plattfisch\n\tπλάτος");
        assert_eq!(printable("a\u{1b}[2Jb\u{9b}31m\r\u{7f}"), "a\\u001b[2Jb\\u009b31m\\u000d\\u007f");
        assert_eq!(one_line("ok\n99 hold\u{2028}applied"), "ok 99 hold applied");
        assert_eq!(printable("hold\u{202e}emuser\u{2069}"), "hold\\u202eemuser\\u2069");
    }

    #[test]
    fn what_lasts_is_told_ever_more_rarely_what_returns_at_once() {
        let mut reminder = Reminder::default();
        let mut tell = |s: u32| reminder.handle(Instant::from_secs_f64(f64::from(s)));
        let told: Vec<(u32, u32)> =
            (0..3600).step_by(10).filter_map(|s| tell(s).map(|count| (s / 60, count))).collect();
        assert_eq!(told, [(0, 1), (1, 6), (3, 12), (7, 24), (15, 48), (31, 96), (47, 96)]);
        assert_eq!((tell(3600), tell(3780)), (None, Some(79)));
        assert_eq!(tell(3780 + 960), Some(1), "after a calm");
        assert_eq!(tell(3780 + 960 + 60), Some(1));
    }
}
