//! `scenecast bench link`

use clap::Args;
use scenecast_core::{UserError, outln};
use scenecast_rehearsal::link_bench::{BudgetRow, FleetRow, LinkRow, LinkTable, RangingRow, link_table, measure_speed};
use scenecast_tools::Progress;

/// The link in virtual time under saturating opaque payload: 10 kbit/s half duplex, 0.2 s turn-around, turns granted by
/// the surface. It takes less than a minute; the same seed gives the same table.
#[derive(Debug, Args)]
#[command(after_help = "Example: scenecast bench link --seed 3 --json")]
pub(crate) struct LinkBench {
    /// Print JSON, without the speed of this machine
    #[arg(long)]
    json: bool,
    /// Seed of all random numbers
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

impl LinkBench {
    pub(super) fn run(self) -> Result<(), UserError> {
        let mut progress = Progress::new("link");
        let table = link_table(self.seed, &mut |share| progress.show(share)).map_err(UserError::failed)?;
        drop(progress);
        if self.json {
            outln!("{}", serde_json::to_string_pretty(&table).map_err(UserError::failed)?);
            return Ok(());
        }
        print_table(&table);
        print_speed();
        Ok(())
    }
}

fn print_table(table: &LinkTable) {
    outln!(
        "Seed {}. efficiency: useful payload / (bit rate x (1 - loss)); directive: issue to applied; known: issue to",
        table.seed
    );
    outln!("known at the surface; converge: last change to equal maps, within: share of stops that kept the bound.");
    outln!();
    outln!("range frame pattern     loss  effi-     directive  known converge          budget    re-");
    outln!("   km bytes                % ciency med. s  p95 s  p95 s    p95 s  within    used  syncs");
    table.rows.iter().for_each(print_row);
    outln!();
    outln!("A budget that binds: efficiency against the vehicle's budget.");
    outln!("range frame loss  budget  effi-   budget");
    outln!("   km bytes    %   bit/s  ciency    used");
    table.budgets.iter().for_each(print_budget);
    outln!();
    outln!("A fix each 10 s.");
    outln!("range frame loss  efficiency         cost  error round trip  one way");
    outln!("   km bytes    %  without    with       %                ms       ms");
    table.ranging.iter().for_each(print_ranging);
    outln!();
    print_fleet(&table.fleet);
}

fn print_row(r: &LinkRow) {
    outln!(
        "{:>5} {:>5} {:<11} {:>4.0} {:>6.3} {:>6.1} {:>6.1} {:>6.1} {:>8.1} {:>7.2} {:>7.2} {:>6}",
        r.range_km,
        r.frame_bytes,
        r.pattern.name(),
        r.loss * 100.0,
        r.efficiency,
        r.directive_median_s,
        r.directive_p95_s,
        r.directive_known_p95_s,
        r.converge_p95_s,
        r.converge_within,
        r.budget_use,
        r.resyncs
    );
}

fn print_budget(r: &BudgetRow) {
    let percent = r.loss * 100.0;
    outln!(
        "{:>5} {:>5} {percent:>4.0} {:>7} {:>7.3} {:>7.2}",
        r.range_km,
        r.frame_bytes,
        r.budget_bps,
        r.efficiency,
        r.budget_use
    );
}

fn print_ranging(r: &RangingRow) {
    outln!(
        "{:>5} {:>5} {:>4.0} {:>8.3} {:>7.3} {:>7.1} {:>17.1} {:>8.1}",
        r.range_km,
        r.frame_bytes,
        r.loss * 100.0,
        r.efficiency,
        r.efficiency_with_fixes,
        r.cost * 100.0,
        r.round_trip_error_ms,
        r.one_way_error_ms
    );
}

fn print_fleet(f: &FleetRow) {
    outln!(
        "{} vehicles at {} km, {} bytes, {:.0} % loss: all known after {:.0} s; oldest map {:.0} s = {:.2} fair shares of",
        f.vehicles,
        f.range_km,
        f.frame_bytes,
        f.loss * 100.0,
        f.discovered_s,
        f.max_age_s,
        f.max_age_shares
    );
    outln!("{:.0} s; efficiency {:.3}, budget used {:.2}.", f.fair_share_s, f.efficiency, f.budget_use);
}

fn print_speed() {
    let speed = measure_speed();
    outln!();
    outln!(
        "This machine, one core: {:.0} frames/s of 64 bytes and {:.0} of 256, both ends; a saturated hour of 64-byte frames, \
         channel included, in {:.2} s.",
        speed.small_frames_per_s,
        speed.frames_per_s,
        speed.hour_s
    );
}
