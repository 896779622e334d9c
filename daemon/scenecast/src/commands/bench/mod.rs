//! `scenecast bench`

mod exemplar;
mod link;
mod localisation;
mod modem;
mod planning;
mod registration;
mod restart;
mod steering;
mod stranger;
mod wide;

use super::sim::WorldArguments;
use clap::{Args, Subcommand};
use exemplar::ExemplarBench;
use link::LinkBench;
use localisation::LocalisationBench;
use modem::ModemBench;
use planning::PlanningBench;
use registration::RegistrationBench;
use restart::RestartBench;
use scenecast_core::UserError;
use scenecast_rehearsal::{FidelityRow, fidelity};
use steering::SteeringBench;
use stranger::StrangerBench;
use wide::WideBench;

/// Reproducible measurements of the parts of scenecast.
#[derive(Debug, Subcommand)]
pub(super) enum BenchCommand {
    /// Exemplars: seconds from the order to the image under full load, bytes for a similarity of 0.9.
    Exemplar(ExemplarBench),
    /// The operator's map at 100, 250, 1000 and 10 000 bit/s: our stream against whole PNGs.
    Fidelity(Fidelity),
    /// The link over range, frame size and loss: efficiency, latency of directives, convergence.
    Link(LinkBench),
    /// The vehicle's position over 3 km: dead reckoning, with the relay, with outliers.
    Localisation(LocalisationBench),
    /// Drivers and emulated modems: throughput, latency of directives, surveys through slow modems.
    Modem(ModemBench),
    /// The planners: utility collected per metre.
    Planning(PlanningBench),
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

/// The same mission at four bit budgets with 10 % loss, once with our stream and once with a baseline that sends the
/// whole PNG again after each change. Frames, acknowledgements, repair and turns are the same.
#[derive(Debug, Args)]
#[command(after_help = "Example: scenecast bench fidelity --seed 3")]
pub(super) struct Fidelity {
    /// Print JSON instead of a table
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    world: WorldArguments,
}

impl BenchCommand {
    pub(super) fn run(self) -> Result<(), UserError> {
        match self {
            Self::Exemplar(e) => e.run(),
            Self::Fidelity(f) => f.run(),
            Self::Link(l) => l.run(),
            Self::Localisation(l) => l.run(),
            Self::Modem(m) => m.run(),
            Self::Planning(p) => p.run(),
            Self::Registration(r) => r.run(),
            Self::Restart(r) => r.run(),
            Self::Steering(s) => s.run(),
            Self::Stranger(s) => s.run(),
            Self::Wide(w) => w.run(),
        }
    }
}

impl Fidelity {
    fn run(mut self) -> Result<(), UserError> {
        // Defaults of all rows, which the user's own settings override: small frames suit small budgets.
        let defaults = ["channel.loss=0.1", "link.frame_bytes=64", "world.kind=patches"].map(str::to_owned);
        self.world.sets.splice(0..0, defaults);
        let config = self.world.config()?;
        let world = self.world.world(&config)?;
        if !self.json {
            println!("budget_bps stream     agreement_mean  age_s median     p95     max  MI nats  map bytes");
        }
        let rows = fidelity(&config, &world, self.world.seed, &mut |row| {
            if !self.json {
                print_row(row);
            }
        })?;
        if self.json {
            let text = serde_json::to_string_pretty(&rows).map_err(|e| UserError::Failed(e.to_string()))?;
            println!("{text}");
        }
        Ok(())
    }
}

fn print_row(r: &FidelityRow) {
    let mi = r.mutual_information_nats.map_or("-".to_owned(), |v| format!("{v:.3}"));
    println!(
        "{:>10} {:<10} {:>14.4} {:>13.1} {:>7.1} {:>7.1} {:>8} {:>10}",
        r.budget_bps, r.stream, r.agreement_mean, r.age_s_median, r.age_s_p95, r.age_s_max, mi, r.map_bytes
    );
}
