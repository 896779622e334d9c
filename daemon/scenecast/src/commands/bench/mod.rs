//! `scenecast bench`

mod fidelity;
mod link;
mod modem;
mod planning;

use clap::Subcommand;
use fidelity::FidelityBench;
use link::LinkBench;
use modem::ModemBench;
use planning::PlanningBench;
use scenecast_core::UserError;

/// Reproducible measurements of the parts of scenecast.
#[derive(Debug, Subcommand)]
pub(super) enum BenchCommand {
    /// The operator's map over time at 100 to 10 000 bit/s: our stream against whole PNGs.
    Fidelity(FidelityBench),
    /// The link over range, frame size and loss: efficiency, latency of directives, convergence.
    Link(LinkBench),
    /// Drivers and emulated modems: throughput, latency of directives, surveys through slow modems.
    Modem(ModemBench),
    /// The planners: utility collected per metre.
    Planning(PlanningBench),
}

impl BenchCommand {
    pub(super) fn run(self) -> Result<(), UserError> {
        match self {
            Self::Fidelity(f) => f.run(),
            Self::Link(l) => l.run(),
            Self::Modem(m) => m.run(),
            Self::Planning(p) => p.run(),
        }
    }
}
