//! The command line.
//!
//! Exit codes: 0 done, 1 failed, 2 wrong usage or input.

mod bench;
mod bench_exemplar;
mod bench_link;
mod bench_localisation;
mod bench_modem;
mod bench_planning;
mod ctl;
mod demo;
mod key;
mod map;
mod modem_sim;
mod node;
mod progress;
mod scene;
mod sim;
mod tune;
mod vocabulary;

use clap::{Parser, Subcommand};
use scenecast_core::UserError;

/// Streams an underwater robot's scene map over an acoustic link to a scientist at the surface.
#[derive(Debug, Parser)]
#[command(name = "scenecast", version, after_help = "Example: scenecast demo, then open http://127.0.0.1:8460")]
pub struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Fly a simulated mission in real time and serve the operator's page.
    Demo(demo::Demo),
    /// Fly a simulated mission in virtual time and write a report.
    Sim(sim::Sim),
    /// Run the vehicle.
    Auv(node::Node),
    /// Run the surface: hold the operator's map, serve his page.
    Asv(node::Node),
    /// Speak with a running surface: see what it has, give orders.
    Ctl(ctl::Ctl),
    /// Emulate modems in one water, each on a serial device or a TCP port of its own.
    ModemSim(modem_sim::ModemSim),
    /// Measure.
    #[command(subcommand)]
    Bench(bench::Bench),
    /// Make or show the key by which both ends know each other's frames, or a token of the operator's page.
    #[command(subcommand)]
    Key(key::Key),
    /// Code label maps as the stream does, and measure it.
    #[command(subcommand)]
    Map(map::Map),
    /// Run the scene model over files.
    #[command(subcommand)]
    Scene(scene::Scene),
    /// Make the vocabularies that images are put into words with.
    #[command(subcommand)]
    Vocabulary(vocabulary::Vocabulary),
    /// Search the settings of the scene model that tell most about annotations of a similar site.
    Tune(Box<tune::Tune>),
    /// Print a configuration file with every key explained.
    Config(node::PrintConfig),
}

/// Carries out a command.
pub fn run(arguments: Arguments) -> Result<(), UserError> {
    match arguments.command {
        Command::Demo(demo) => demo.run(),
        Command::Sim(sim) => sim.run(),
        Command::Auv(node) => node.run_vehicle(),
        Command::Asv(node) => node.run_surface(),
        Command::Ctl(ctl) => ctl.run(),
        Command::ModemSim(sim) => sim.run(),
        Command::Bench(bench) => bench.run(),
        Command::Key(key) => key.run(),
        Command::Map(map) => map.run(),
        Command::Scene(scene) => scene.run(),
        Command::Vocabulary(vocabulary) => vocabulary.run(),
        Command::Tune(tune) => tune.run(),
        Command::Config(print) => print.run(),
    }
}
