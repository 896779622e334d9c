//! `scenecast bench`

mod exemplar;
mod fidelity;
mod inference;
mod link;
#[cfg(feature = "ros2")]
mod live;
mod localisation;
mod modem;
mod planning;
mod raster;
mod registration;
mod restart;
mod steering;
mod stranger;
mod surveys;
mod wide;

use clap::{Args, Subcommand};
use exemplar::ExemplarBench;
use fidelity::FidelityBench;
use inference::InferenceBench;
use link::LinkBench;
#[cfg(feature = "ros2")]
use live::LiveBench;
use localisation::LocalisationBench;
use modem::ModemBench;
use planning::PlanningBench;
use raster::RasterBench;
use registration::RegistrationBench;
use restart::RestartBench;
use scenecast_core::UserError;
use steering::SteeringBench;
use stranger::StrangerBench;
use wide::WideBench;

/// Reproducible measurements of the parts of scenecast.
#[derive(Debug, Subcommand)]
pub(super) enum BenchCommand {
    /// Exemplars: seconds from the order to the image under full load, bytes for a similarity of 0.9.
    Exemplar(ExemplarBench),
    /// The operator's map over time at 100 to 10 000 bit/s: our stream against whole PNGs.
    Fidelity(FidelityBench),
    /// Inference under way: information of the online map against a batch over the same frames, and bytes of the map.
    Inference(InferenceBench),
    /// The link over range, frame size and loss: efficiency, latency of directives, convergence.
    Link(LinkBench),
    /// A vehicle with a live camera, by ROS 2: images that reach the scene model, processor time, memory.
    #[cfg(feature = "ros2")]
    Live(LiveBench),
    /// The vehicle's position over 3 km: dead reckoning, with the relay, with outliers.
    Localisation(LocalisationBench),
    /// Drivers and emulated modems: throughput, latency of directives, surveys through slow modems.
    Modem(ModemBench),
    /// The planners: utility collected per metre.
    Planning(PlanningBench),
    /// A grid of which a part changes every second, over a radio that loses frames, against whole grids.
    Raster(RasterBench),
    /// Registration of camera frames: errors of their places, share of the sea floor that the map shows.
    Registration(RegistrationBench),
    /// Restarts of both ends as processes: what is lost, the time to a full page.
    Restart(RestartBench),
    /// Steering: the camera's time over a weighed label, with and without the order.
    Steering(SteeringBench),
    /// A stranger at the link: forged, replayed and damaged frames, with and without a key.
    Stranger(StrangerBench),
    /// A wide survey: CPU time and bytes of updates, of loading the page, and of exports.
    Wide(WideBench),
}

/// The seeds of a measurement that is repeated.
#[derive(Debug, Clone, Copy, Args)]
pub(super) struct SeedArguments {
    /// First seed
    #[arg(long = "seed", value_name = "SEED", default_value_t = 1)]
    pub(super) first: u64,
    /// Number of seeds, from --seed on; each draws all that is random
    #[arg(long = "seeds", value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u64).range(1..=1000))]
    pub(super) count: u64,
}

impl BenchCommand {
    pub(super) fn run(self) -> Result<(), UserError> {
        match self {
            Self::Exemplar(e) => e.run(),
            Self::Fidelity(f) => f.run(),
            Self::Inference(i) => i.run(),
            Self::Link(l) => l.run(),
            #[cfg(feature = "ros2")]
            Self::Live(l) => l.run(),
            Self::Localisation(l) => l.run(),
            Self::Modem(m) => m.run(),
            Self::Planning(p) => p.run(),
            Self::Raster(r) => r.run(),
            Self::Registration(r) => r.run(),
            Self::Restart(r) => r.run(),
            Self::Steering(s) => s.run(),
            Self::Stranger(s) => s.run(),
            Self::Wide(w) => w.run(),
        }
    }
}
