//! `scenecast bench fidelity`

use crate::commands::sim::WorldArguments;
use clap::Args;
use scenecast_core::{UserError, outln};
use scenecast_files::write_whole;
use scenecast_rehearsal::{FidelityRow, fidelity, fidelity_panels, quality_plot};
use std::path::PathBuf;

/// The same mission at each of several bit budgets with 10 % loss, and beside it a baseline that sends the whole PNG of its map
/// again after each change. Frames, acknowledgements, repair and turns are the same.
#[derive(Debug, Args)]
#[command(after_help = "Example: scenecast bench fidelity --seed 3 --out curves")]
pub(in crate::commands) struct FidelityBench {
    /// Print JSON instead of a table
    #[arg(long)]
    json: bool,
    /// Bit budgets to compare, bit/s
    #[arg(long = "budgets", value_name = "BPS", value_delimiter = ',', default_values_t = [100, 250, 1000, 10_000],
        value_parser = clap::value_parser!(u32).range(50..=1_000_000))]
    budgets_bps: Vec<u32>,
    /// Draw the curves over time as DIR/fidelity.svg
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    world: WorldArguments,
}

impl FidelityBench {
    pub(super) fn run(mut self) -> Result<(), UserError> {
        // Defaults of all rows, which the user's own settings override: small frames suit small budgets.
        let defaults = ["channel.loss=0.1", "link.frame_bytes=64", "world.kind=patches"].map(str::to_owned);
        self.world.sets.splice(0..0, defaults);
        let config = self.world.config()?;
        let world = self.world.world(&config)?;
        if !self.json {
            print_head();
        }
        let rows = fidelity(&config, &world, self.world.seed, &self.budgets_bps, &mut |row| {
            if !self.json {
                print_row(row);
            }
        })?;
        if self.json {
            let text = serde_json::to_string_pretty(&rows).map_err(UserError::failed)?;
            outln!("{text}");
        }
        if let Some(dir) = &self.out {
            std::fs::create_dir_all(dir).map_err(|e| UserError::file(dir, e))?;
            let title = format!("Mutual information of the maps with the true classes, seed {}", self.world.seed);
            let svg = quality_plot(&fidelity_panels(&rows), &title).map_err(UserError::failed)?;
            write_whole(&dir.join("fidelity.svg"), svg.as_bytes())?;
        }
        Ok(())
    }
}

fn print_head() {
    outln!(
        "Mutual information over the survey's area at its end, nats: rigid and placed. Share: operator's by vehicle's."
    );
    outln!(
        "Bytes up: all, of the map, and the shares of the map and of its frames. Error: of registration, cells rms."
    );
    outln!(
        "Copies: of the vehicle's frames, and how many frames arrived twice. Energy: of its modem, J and mJ a map bit."
    );
    outln!();
    outln!(
        "                      vehicle         operator       share            age s         bytes up                          copies        energy"
    );
    outln!(
        "budget stream      rigid placed   rigid placed    end  mean  agree   p50   p95    all    map   map frames  error   sent twice      J    mJ"
    );
}

fn print_row(r: &FidelityRow) {
    let number = |value: Option<f64>| value.map_or("-".to_owned(), |v| format!("{v:.3}"));
    let (vehicle, operator) = (r.end.vehicle, r.end.operator);
    outln!(
        "{:>6} {:<10} {:>6} {:>6} {:>7} {:>6} {:>6} {:>5} {:>6.3} {:>5.0} {:>5.0} {:>6} {:>6} {:>5.3} {:>6.3} {:>6} {:>6} {:>5} {:>6} {:>5}",
        r.budget_bps,
        r.stream,
        number(vehicle.map(|i| i.rigid_nats)),
        number(vehicle.map(|i| i.placed_nats)),
        number(operator.map(|i| i.rigid_nats)),
        number(operator.map(|i| i.placed_nats)),
        number(r.operator_share),
        number(r.operator_share_mean),
        r.agreement_mean,
        r.age.age_s_median,
        r.age.age_s_p95,
        r.uplink_bytes.all(),
        r.uplink_bytes.map,
        r.map_share,
        r.map_frames_share,
        number(r.end.error_rigid_cells),
        r.repeats.frames,
        r.repeats.arrived_twice,
        r.energy.energy_j.map_or("-".to_owned(), |j| format!("{j:.0}")),
        r.energy.energy_per_map_bit_j.map_or("-".to_owned(), |j| format!("{:.2}", j * 1e3)),
    );
}
