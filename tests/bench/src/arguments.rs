//! The command line.
//!
//! Exit codes: 0 done, 1 failed or a promise broken, 2 wrong usage or input.

use crate::console::ConsoleBench;
use crate::exemplar::ExemplarBench;
use crate::faults::FaultsBench;
use crate::frame::FrameBench;
use crate::inference::InferenceBench;
use crate::labels::LabelsBench;
use crate::live::LiveBench;
use crate::localisation::LocalisationBench;
use crate::map_codec::MapCodecBench;
use crate::raster::RasterBench;
use crate::record::RecordBench;
use crate::registration::RegistrationBench;
use crate::restart::{ForgetBench, RestartBench};
use crate::steering::SteeringBench;
use crate::stranger::StrangerBench;
use crate::surfaces::SurfacesBench;
use crate::train_prior::TrainPrior;
use crate::wide::WideBench;
use clap::{Parser, Subcommand};
use scenecast_core::UserError;
use scenecast_tools::ProgressForm;

/// Reproducible measurements that a change of scenecast is compared with.
#[derive(Debug, Parser)]
#[command(name = "scenecast-bench", version, after_help = "Example: scenecast-bench localisation")]
pub struct Arguments {
    /// Form of the progress of long work, on the standard error output
    #[arg(long, global = true, value_enum, default_value_t, value_name = "FORM")]
    progress: ProgressForm,
    #[command(subcommand)]
    bench: Bench,
}

#[derive(Debug, Subcommand)]
enum Bench {
    /// Ten open consoles: processor time of the surface, and how soon they have a new map.
    Console(ConsoleBench),
    /// Exemplars: seconds from the order to the image under full load, bytes for a similarity of 0.9.
    Exemplar(ExemplarBench),
    /// Faults of modems and their ports: seconds until data flow again.
    Faults(FaultsBench),
    /// Vehicles that lose the folder with their orders: what they do, and when they have them again.
    Forget(ForgetBench),
    /// A camera frame at the vehicle: CPU time from the image to the map that the link sends, as the map grows.
    Frame(FrameBench),
    /// Inference under way: information of the online map against a batch over the same frames, and bytes of the map.
    Inference(InferenceBench),
    /// Labels: the same in any order and on any path, against the true classes, and of worse sights.
    Labels(LabelsBench),
    /// A vehicle with a live camera, by ROS 2: images that reach the scene model, processor time, memory.
    Live(LiveBench),
    /// The vehicle's position over 3 km: dead reckoning, with the relay, with outliers.
    Localisation(LocalisationBench),
    /// Map chunks of survey series, stills and a large map: bytes and CPU time, against the best PNG.
    MapCodec(MapCodecBench),
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
    /// Records of missions: the maps that a replay shows, what a power cut takes, what recording costs.
    Record(RecordBench),
    /// Three surfaces with one key and one vehicle: random schedules of orders, take-overs, crashes and losses.
    Surfaces(SurfacesBench),
    /// Train the table that the context coder starts from.
    TrainPrior(TrainPrior),
    /// A wide survey: CPU time and bytes of updates, of loading the page, and of exports.
    Wide(WideBench),
}

impl Arguments {
    /// Runs the measurement that was parsed; an error has its exit code.
    pub fn run(self) -> Result<(), UserError> {
        self.progress.choose();
        match self.bench {
            Bench::Console(c) => c.run(),
            Bench::Exemplar(e) => e.run(),
            Bench::Faults(f) => f.run(),
            Bench::Forget(f) => f.run(),
            Bench::Frame(f) => f.run(),
            Bench::Inference(i) => i.run(),
            Bench::Labels(l) => l.run(),
            Bench::Live(l) => l.run(),
            Bench::Localisation(l) => l.run(),
            Bench::MapCodec(m) => m.run(),
            Bench::Raster(r) => r.run(),
            Bench::Registration(r) => r.run(),
            Bench::Restart(r) => r.run(),
            Bench::Steering(s) => s.run(),
            Bench::Stranger(s) => s.run(),
            Bench::Record(r) => r.run(),
            Bench::Surfaces(s) => s.run(),
            Bench::TrainPrior(t) => t.run(),
            Bench::Wide(w) => w.run(),
        }
    }
}
