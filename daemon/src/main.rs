//! The `scenecast` command.

use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments = scenecast::cli::Arguments::parse();
    match scenecast::cli::run(arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(problem) => {
            eprintln!("scenecast: {problem}");
            ExitCode::from(problem.exit_code())
        }
    }
}
