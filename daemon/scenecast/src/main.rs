//! The `scenecast` command.

use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments = match scenecast::commands::Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(e) if !e.use_stderr() => e.exit(),
        Err(e) => {
            let text = e.to_string();
            let what = text.lines().next().unwrap_or_default().trim_start_matches("error: ");
            let rest: Vec<&str> = text.lines().skip(1).map(str::trim).take_while(|l| !l.is_empty()).collect();
            eprintln!("scenecast: {what} {} (scenecast COMMAND --help tells what there is)", rest.join(" "));
            return ExitCode::from(2);
        }
    };
    match scenecast::commands::run(arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(problem) => {
            eprintln!("scenecast: {problem}");
            ExitCode::from(problem.exit_code())
        }
    }
}
