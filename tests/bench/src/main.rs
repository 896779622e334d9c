//! The `scenecast-bench` command.

use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    match scenecast_bench::Arguments::parse().run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("scenecast-bench: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}
