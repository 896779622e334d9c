//! `scenecast bench modem`

use clap::Args;
use scenecast_core::{UserError, outln};
use scenecast_rehearsal::modem_bench::{ModemTable, modem_table};
use scenecast_tools::Progress;

/// Both ends' drivers at emulated modems, 1 km and 10 % loss, in virtual time: the throughput of an S2C in burst mode
/// for the link and for a host that only keeps its pool full, the latency of directives meanwhile, and surveys of 20
/// minutes through slow modems. The same seed gives the same table.
#[derive(Debug, Args)]
#[command(after_help = "Example: scenecast bench modem --seed 3 --json")]
pub(crate) struct ModemBench {
    /// Print JSON instead of a table
    #[arg(long)]
    json: bool,
    /// Seed of all random numbers
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

impl ModemBench {
    pub(super) fn run(self) -> Result<(), UserError> {
        let mut progress = Progress::new("modems");
        let table = modem_table(self.seed, &mut |share| progress.show(share))?;
        drop(progress);
        if self.json {
            let text = serde_json::to_string_pretty(&table).map_err(UserError::failed)?;
            outln!("{text}");
        } else {
            print_table(&table);
        }
        Ok(())
    }
}

fn print_table(table: &ModemTable) {
    let b = &table.burst;
    outln!("S2C in burst mode, {:.0} m, {:.0} % loss, seed {}:", b.range_m, b.loss * 100.0, table.seed);
    outln!("  raw pusher      {:>7.0} bit/s", b.raw_bps);
    outln!("  useful at map   {:>7.0} bit/s, {:.3} of it", b.useful_bps, b.share);
    outln!(
        "  directive       {:>7.1} s median, {:.1} s p95, issue to applied, bulk queue full",
        b.directive_median_s,
        b.directive_p95_s
    );
    outln!("  budget used     {:>7.3} in the fullest window", b.budget_use);
    outln!();
    outln!("survey through                 agreement mean   final  drain s");
    for row in &table.surveys {
        outln!("{:<30} {:>14.4} {:>7.4} {:>8.0}", row.modem, row.agreement_mean, row.agreement_final, row.drain_s);
    }
}
