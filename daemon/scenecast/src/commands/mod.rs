//! The command line.
//!
//! Exit codes: 0 done, 1 failed, 2 wrong usage or input.

#[cfg(feature = "rehearsal")]
mod bench;
#[cfg(feature = "rehearsal")]
mod bench_exemplar;
#[cfg(feature = "rehearsal")]
mod bench_link;
#[cfg(feature = "rehearsal")]
mod bench_localisation;
#[cfg(feature = "rehearsal")]
mod bench_modem;
#[cfg(feature = "rehearsal")]
mod bench_planning;
#[cfg(feature = "surface")]
mod ctl;
#[cfg(feature = "rehearsal")]
mod demo;
mod key;
#[cfg(feature = "rehearsal")]
mod modem_sim;
mod node;
#[cfg(feature = "rehearsal")]
mod sim;

use clap::{Parser, Subcommand};
use scenecast_core::UserError;
#[cfg(feature = "tools")]
use scenecast_tools::commands as tools;

/// Streams an underwater robot's scene map over an acoustic link to a scientist at the surface.
#[derive(Debug, Parser)]
#[command(name = "scenecast", version, after_help = "Example: scenecast demo, then open http://127.0.0.1:8460")]
pub struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    #[cfg(feature = "rehearsal")]
    /// Fly a simulated mission in real time and serve the operator's page.
    Demo(demo::Demo),
    #[cfg(feature = "rehearsal")]
    /// Fly a simulated mission in virtual time and write a report.
    Sim(sim::Sim),
    /// Run the vehicle.
    Auv(node::Node),
    #[cfg(feature = "surface")]
    /// Run the surface: hold the operator's map, serve his page.
    Asv(node::Node),
    #[cfg(feature = "surface")]
    /// Speak with a running surface: see what it has, give orders.
    Ctl(ctl::Ctl),
    #[cfg(feature = "rehearsal")]
    /// Emulate modems in one water, each on a serial device or a TCP port of its own.
    ModemSim(modem_sim::ModemSim),
    #[cfg(feature = "rehearsal")]
    /// Measure.
    #[command(subcommand)]
    Bench(bench::Bench),
    /// Make or show the key by which both ends know each other's frames, or a token of the operator's page.
    #[command(subcommand)]
    Key(key::Key),
    #[cfg(feature = "tools")]
    /// Code label maps as the stream does, and measure it.
    #[command(subcommand)]
    Map(tools::Map),
    #[cfg(feature = "tools")]
    /// Run the scene model over files.
    #[command(subcommand)]
    Scene(tools::Scene),
    #[cfg(feature = "tools")]
    /// Make the vocabularies that images are put into words with.
    #[command(subcommand)]
    Vocabulary(tools::Vocabulary),
    #[cfg(feature = "tools")]
    /// Search the settings of the scene model that tell most about annotations of a similar site.
    Tune(Box<tools::Tune>),
    /// Print a configuration file with every key explained.
    Config(node::PrintConfig),
}

/// Carries out a command.
pub fn run(arguments: Arguments) -> Result<(), UserError> {
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
        Command::Key(key) => key.run(),
        #[cfg(feature = "tools")]
        Command::Map(map) => map.run(),
        #[cfg(feature = "tools")]
        Command::Scene(scene) => scene.run(),
        #[cfg(feature = "tools")]
        Command::Vocabulary(vocabulary) => vocabulary.run(),
        #[cfg(feature = "tools")]
        Command::Tune(tune) => tune.run(),
        Command::Config(print) => print.run(),
    }
}
