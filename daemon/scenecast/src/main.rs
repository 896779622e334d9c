//! The `scenecast` command.

use clap::Parser;
use clap::error::ErrorKind;
use scenecast_core::{errln, out};
use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments = match scenecast::commands::Arguments::try_parse() {
        Ok(arguments) => arguments,
        // Help, version, or the list of commands where none is given.
        Err(e) if !e.use_stderr() => {
            out!("{}", e.render());
            return ExitCode::SUCCESS;
        }
        Err(e) if e.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => e.exit(),
        Err(e) => {
            errln!("scenecast: {}", one_line(&e.to_string()));
            return ExitCode::from(2);
        }
    };
    match scenecast::commands::run(arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            errln!("scenecast: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}

/// The message and the tips of an error of clap, without its usage, on one line.
fn one_line(text: &str) -> String {
    let mut paragraphs = text.trim_start_matches("error: ").split("\n\n").map(str::trim);
    let message = paragraphs.next().unwrap_or_default();
    let tips = paragraphs.filter_map(|paragraph| paragraph.strip_prefix("tip: "));
    let parts: Vec<&str> = [message].into_iter().chain(tips).collect();
    let line = parts.join("; ").replace("\n  tip:", ";");
    // The words of the standard library for what is no number.
    let line = line.replace("invalid float literal", "expected a number without a unit, as in 0.5");
    let line = line.replace("invalid digit found in string", "expected a whole number without a unit");
    format!("{} (scenecast COMMAND --help lists all options)", line.split_whitespace().collect::<Vec<_>>().join(" "))
}
