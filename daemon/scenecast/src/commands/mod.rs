//! The command line.
//!
//! Exit codes: 0 done, 1 failed, 2 wrong usage or input.

#[cfg(feature = "rehearsal")]
mod bench;
mod config;
#[cfg(feature = "surface")]
mod ctl;
#[cfg(feature = "rehearsal")]
mod demo;
mod doctor;
mod key;
#[cfg(feature = "tools")]
mod manual;
#[cfg(feature = "rehearsal")]
mod modem_sim;
mod node;
mod record;
#[cfg(feature = "surface")]
mod replay;
#[cfg(feature = "surface")]
mod report;
#[cfg(feature = "rehearsal")]
mod sim;

use clap::{Parser, Subcommand};
use scenecast_core::UserError;
use scenecast_protocol::wire::WIRE_VERSION;
#[cfg(feature = "tools")]
use scenecast_tools::{ProgressForm, commands as tools};
use std::sync::LazyLock;

/// The version of the program, the commit of its source, and the version of the wire.
static VERSION: LazyLock<String> = LazyLock::new(|| {
    let (version, commit) = (env!("CARGO_PKG_VERSION"), env!("SCENECAST_COMMIT"));
    format!("{version} (commit {commit}, wire version {WIRE_VERSION})")
});

#[cfg(feature = "rehearsal")]
const EXAMPLE: &str = "Example: scenecast demo, then open http://127.0.0.1:8460";
#[cfg(not(feature = "rehearsal"))]
const EXAMPLE: &str = "Example: scenecast config --role auv > auv.toml";

/// Streams the scene map of an underwater robot over an acoustic link to a scientist at the surface.
#[derive(Debug, Parser)]
#[command(name = "scenecast", version, long_version = VERSION.as_str(), after_help = EXAMPLE)]
pub struct Arguments {
    #[cfg(feature = "tools")]
    /// Form of the progress of long work, on the standard error output
    #[arg(long, global = true, value_enum, default_value_t, value_name = "FORM")]
    progress: ProgressForm,
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    #[cfg(feature = "rehearsal")]
    /// Run a simulated mission in real time, with the operator's page.
    Demo(demo::Demo),
    #[cfg(feature = "rehearsal")]
    /// Run a simulated mission in virtual time, and write a report.
    Sim(sim::Sim),
    /// Run the vehicle: mapping, planning and the link.
    Auv(node::Node),
    #[cfg(feature = "surface")]
    /// Run the surface, with the operator's map and page.
    Asv(node::Node),
    #[cfg(feature = "surface")]
    /// Show the state of a running surface, and give orders.
    Ctl(ctl::Ctl),
    #[cfg(feature = "rehearsal")]
    /// Emulate modems in one channel, each on a serial device or a TCP port of its own.
    ModemSim(modem_sim::ModemSim),
    #[cfg(feature = "rehearsal")]
    /// Measure the link, the modems, the planners and the map that the operator sees.
    #[command(subcommand)]
    Bench(bench::BenchCommand),
    /// Look at the equipment of an end, and say what to do where it does not work.
    #[command(subcommand)]
    Doctor(doctor::Doctor),
    /// Make the key of a mission or of a vehicle, show a key, or make a token for the operator's page.
    #[command(subcommand)]
    Key(key::Key),
    #[cfg(feature = "surface")]
    /// Show a mission from its records on the operator's page, with a time line.
    Replay(replay::Replay),
    #[cfg(feature = "surface")]
    /// Write the report of a dive from its record.
    Report(report::Report),
    /// Repair the record of a mission.
    #[command(subcommand)]
    Record(record::Record),
    #[cfg(feature = "tools")]
    /// Encode label maps as on the link, and measure the codecs.
    #[command(subcommand)]
    Map(tools::Map),
    #[cfg(feature = "tools")]
    /// Run the scene model over files.
    #[command(subcommand)]
    Scene(tools::Scene),
    #[cfg(feature = "tools")]
    /// Train the vocabulary that turns images into visual words.
    #[command(subcommand)]
    Vocabulary(tools::Vocabulary),
    #[cfg(feature = "tools")]
    /// Find the settings of the scene model whose maps agree best with annotations of a similar site.
    Tune(Box<tools::Tune>),
    #[cfg(feature = "tools")]
    /// Show what frames on the wire say.
    #[command(subcommand)]
    Wire(tools::Wire),
    /// Print a configuration file with every key explained.
    Config(config::ConfigCommand),
    #[cfg(feature = "tools")]
    /// Print the completions of commands and options for a shell.
    Completions(manual::Completions),
    #[cfg(feature = "tools")]
    /// Write the manual pages.
    Man(manual::Man),
}

/// Runs the command that was parsed; an error has its exit code.
pub fn run(arguments: Arguments) -> Result<(), UserError> {
    scenecast_core::set_program(&format!("scenecast {}", VERSION.as_str()));
    #[cfg(feature = "tools")]
    arguments.progress.choose();
    match arguments.command {
        #[cfg(feature = "rehearsal")]
        Command::Demo(demo) => demo.run(),
        #[cfg(feature = "rehearsal")]
        Command::Sim(sim) => sim.run(),
        Command::Auv(node) => node.run_vehicle(),
        #[cfg(feature = "surface")]
        Command::Asv(node) => node.run_surface(),
        #[cfg(feature = "surface")]
        Command::Ctl(ctl) => ctl.run(),
        #[cfg(feature = "rehearsal")]
        Command::ModemSim(sim) => sim.run(),
        #[cfg(feature = "rehearsal")]
        Command::Bench(bench) => bench.run(),
        Command::Doctor(doctor) => doctor.run(),
        Command::Key(key) => key.run(),
        Command::Record(record) => record.run(),
        #[cfg(feature = "surface")]
        Command::Replay(replay) => replay.run(),
        #[cfg(feature = "surface")]
        Command::Report(report) => report.run(),
        #[cfg(feature = "tools")]
        Command::Map(map) => map.run(),
        #[cfg(feature = "tools")]
        Command::Scene(scene) => scene.run(),
        #[cfg(feature = "tools")]
        Command::Vocabulary(vocabulary) => vocabulary.run(),
        #[cfg(feature = "tools")]
        Command::Tune(tune) => tune.run(),
        #[cfg(feature = "tools")]
        Command::Wire(wire) => wire.run(),
        Command::Config(config) => config.run(),
        #[cfg(feature = "tools")]
        Command::Completions(completions) => completions.run(),
        #[cfg(feature = "tools")]
        Command::Man(man) => man.run(),
    }
}
