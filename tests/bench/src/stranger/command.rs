//! `scenecast-bench stranger`

use super::{AttackKind, KindFigures, Protection, StrangerFigures, measure_stranger};
use clap::Args;
use scenecast_core::UserError;
use scenecast_tools::Progress;
use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

/// Late recoveries that the table shows of each row.
const SHOWN: usize = 10;

/// Both ends of the link in virtual time, attacked by a stranger who hears every frame: noise, changed and replayed frames,
/// malformed frames, and forged frames of each kind with a good CRC, in every state of the link. Each row has an equal
/// part of the frames: without a key, and with a key and `authenticate = "down"` or `"all"`.
///
/// The exit code is 1 if a promise is broken. The same seed gives the same figures.
#[derive(Debug, Args)]
#[command(after_help = "Example: scenecast-bench stranger --frames 20000")]
pub(crate) struct StrangerBench {
    /// Print JSON instead of a table
    #[arg(long)]
    json: bool,
    /// Number of the stranger's frames in all
    #[arg(long, default_value_t = 1_000_000, value_parser = clap::value_parser!(u64).range(300..=1_000_000_000))]
    frames: u64,
    /// Seed of all random numbers
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

impl StrangerBench {
    pub(crate) fn run(self) -> Result<(), UserError> {
        let rows = self.measure();
        if self.json {
            let text = serde_json::to_string_pretty(&rows).map_err(UserError::failed)?;
            println!("{text}");
        } else {
            rows.iter().for_each(print);
        }
        let of_row = |row: &StrangerFigures| {
            let name = row.protection.name();
            row.broken_promises().into_iter().map(move |promise| format!("{name}: {promise}")).collect::<Vec<_>>()
        };
        let broken: Vec<String> = rows.iter().flat_map(of_row).collect();
        if broken.is_empty() { Ok(()) } else { Err(UserError::Failed(broken.join("; "))) }
    }
}

impl StrangerBench {
    /// The rows, each in a thread of its own.
    fn measure(&self) -> Vec<StrangerFigures> {
        const ROWS: usize = Protection::EVERY.len();
        let progress = Mutex::new((Progress::new("frames"), [0.0; ROWS]));
        let run = |at: usize| {
            let frames = self.frames / ROWS as u64 + u64::from((at as u64) < self.frames % ROWS as u64);
            let mut show = |share: f64| {
                let mut shown = progress.lock().unwrap_or_else(PoisonError::into_inner);
                shown.1[at] = share;
                let mean = shown.1.iter().sum::<f64>() / ROWS as f64;
                shown.0.show(mean);
            };
            measure_stranger(Protection::EVERY[at], frames, self.seed, &mut show)
        };
        let run = &run;
        std::thread::scope(|scope| {
            let threads: Vec<_> = (0..ROWS).map(|at| scope.spawn(move || run(at))).collect();
            let joined = threads.into_iter().map(std::thread::ScopedJoinHandle::join);
            joined.map(|row| row.unwrap_or_else(|panic| std::panic::resume_unwind(panic))).collect()
        })
    }
}

fn print(row: &StrangerFigures) {
    println!("{}: {} frames in {} bursts, seed {}", row.protection.name(), row.frames, row.bursts, row.seed);
    println!();
    println!("kind              frames  at the surface; at the vehicle");
    row.kinds.iter().for_each(print_kind);
    println!();
    println!("cells of the operator's map changed by the stranger   {:>9}", row.cells_changed);
    println!("  by lost authentic frames that he delivered           {:>9}", row.cells_relayed);
    println!("orders applied                                        {:>9}", row.orders_applied);
    println!("  that the operator did not give                      {:>9}", row.foreign_orders);
    println!("  that were applied or replaced before                {:>9}", row.repeated_orders);
    println!("state changes by frames with a bad CRC, tag or chunk  {:>9}", row.invalid_changes);
    println!("new runs after three frames that do not decode        {:>9}", row.divergences);
    println!("earlier maps erased                                   {:>9}", row.erased_maps);
    println!(
        "authentic frames refused that arrived unharmed        {:>8.2} % of {}; {:.2} % without the stranger",
        row.authentic_refused * 100.0,
        row.authentic_frames,
        row.authentic_refused_control * 100.0
    );
    println!("  how they were judged: {}", list(&row.authentic));
    println!("  hellos: {}", list(&row.hellos));
    println!(
        "seconds until map and orders agree again              {:>9.1} mean, {:.1} p95, {:.1} worst; {:.1} mean without \
         the stranger",
        row.recovery_mean_s, row.recovery_p95_s, row.recovery_max_s, row.recovery_control_s
    );
    println!(
        "  above 60 s                                          {:>9} of {}, {} of them above 600 s",
        row.late_recoveries.len(),
        row.bursts,
        row.failed_recoveries
    );
    for late in row.late_recoveries.iter().take(SHOWN) {
        let kind = late.kind.map_or("all kinds", AttackKind::name);
        println!(
            "    {:>5.1} s after burst {} of dive {}, {}, {}: {kind}",
            late.seconds, late.burst, late.dive, late.access, late.state
        );
        if !late.given_up.is_empty() {
            println!("      {}", late.given_up);
        }
    }
    println!();
}

fn print_kind(kind: &KindFigures) {
    println!("{:<16} {:>7}  {}; {}", kind.kind.name(), kind.frames, list(&kind.surface), list(&kind.vehicle));
}

fn list(judged: &BTreeMap<String, u64>) -> String {
    let parts: Vec<String> = judged.iter().map(|(judgement, count)| format!("{judgement} {count}")).collect();
    if parts.is_empty() { "-".to_owned() } else { parts.join(", ") }
}
