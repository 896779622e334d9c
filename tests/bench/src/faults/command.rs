//! `scenecast-bench faults`

use super::{FAULTS, FaultyEnd, LinkKind, Recovery, link, percentile_95};
use crate::program::ProgramArgument;
use clap::Args;
use scenecast_core::UserError;
use scenecast_tools::Progress;
use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Faults of modems and their ports, with both ends as processes and emulated modems: reboots, brown-outs, cut lines, noise on the
/// line, refusals, frozen ports, unplugged devices.
///
/// The table has the seconds from the end of each fault until the ship had data again, and until the vehicle had a frame; of
/// several runs, the times that 95 % of them keep. "none" is no fault: how long an end waits for a frame at any time. Exit code 1 if one is above its limit: 8 s for bursts, packet rate 5 and pipes, 10 s
/// for the others. The kinds run beside each other, in real time.
#[derive(Debug, Args)]
#[command(after_help = "Example: scenecast-bench faults --runs 3 --out faults.jsonl")]
pub(crate) struct FaultsBench {
    /// Runs of each kind, in each of which each fault happens once at each end
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1000))]
    runs: u32,
    /// Seed of the orders and times of the faults
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Kinds of modem, separated by commas [default: all]
    #[arg(long, value_enum, value_delimiter = ',', value_name = "KINDS")]
    kinds: Vec<LinkKind>,
    /// File of the results, a line of JSON each; runs that it has are not made again
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    #[command(flatten)]
    program: ProgramArgument,
}

impl FaultsBench {
    pub(crate) fn run(self) -> Result<(), UserError> {
        let program = self.program.path()?;
        let kinds = if self.kinds.is_empty() { LinkKind::ALL.to_vec() } else { self.kinds.clone() };
        let dir = std::env::temp_dir().join(format!("scenecast-faults-{}", std::process::id()));
        let recording = dir.join("recording");
        let before = self.out.as_deref().map(read).transpose()?.unwrap_or_default();
        let seed_of = |run: u32| self.seed + u64::from(run);
        let is_made = |kind, run| before.iter().any(|r: &Recovery| (r.kind, r.run) == (kind, run));
        let missing = |kind| (1..=self.runs).filter(move |run| !is_made(kind, *run)).map(seed_of).collect::<Vec<u64>>();
        let time_of = |kind: &LinkKind| missing(*kind).into_iter().map(link::length).sum::<Duration>();
        let longest = kinds.iter().map(time_of).max().unwrap_or_default();
        if !longest.is_zero() {
            eprintln!("it takes {:.0} min", (longest.as_secs_f64() / 60.0).ceil());
            // Without images a vehicle soon has no news, and is asked seldom.
            crate::restart::record(&recording, link::length(self.seed).as_secs_f64() + 60.0)?;
        }
        let (done, found) = (AtomicBool::new(longest.is_zero()), Mutex::new(before.clone()));
        let runs_of = |kind: LinkKind| -> Result<(), UserError> {
            for run in (1..=self.runs).filter(|run| !is_made(kind, *run)) {
                let folder = dir.join(format!("{kind:?}-{run}"));
                let recoveries = link::run(&program, &folder, &recording, (kind, run, seed_of(run)))?;
                self.append(&recoveries)?;
                found.lock().map_err(UserError::failed)?.extend(recoveries);
            }
            Ok(())
        };
        let results: Vec<Result<(), UserError>> = std::thread::scope(|scope| {
            scope.spawn(|| show_time(longest, &done));
            let runs: Vec<_> = kinds.iter().map(|&kind| scope.spawn(move || runs_of(kind))).collect();
            let ended = runs
                .into_iter()
                .map(|run| run.join().unwrap_or_else(|_| Err(UserError::Failed("a run broke off".into()))));
            let ended = ended.collect();
            done.store(true, Ordering::Relaxed);
            ended
        });
        results.into_iter().collect::<Result<(), UserError>>()?;
        let all = found.into_inner().map_err(UserError::failed)?;
        let late = print_table(&kinds, &all);
        match late {
            0 => {
                let _ = fs::remove_dir_all(&dir);
                Ok(())
            }
            _ => {
                Err(UserError::Failed(format!("{late} rows are above their limit; the files are in {}", dir.display())))
            }
        }
    }

    fn append(&self, recoveries: &[Recovery]) -> Result<(), UserError> {
        let Some(path) = &self.out else { return Ok(()) };
        let lines: Result<Vec<String>, _> = recoveries.iter().map(serde_json::to_string).collect();
        let text = lines.map_err(UserError::failed)?.join("\n") + "\n";
        let file = File::options().create(true).append(true).open(path);
        file.and_then(|mut file| file.write_all(text.as_bytes())).map_err(|e| UserError::file(path, e))
    }
}

/// The results that a file has; none if there is no file.
fn read(path: &Path) -> Result<Vec<Recovery>, UserError> {
    let text = match fs::read_to_string(path) {
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
        other => other.map_err(|e| UserError::file(path, e))?,
    };
    (1..)
        .zip(text.lines())
        .map(|(line, json)| {
            let fault = |e: serde_json::Error| UserError::Input(format!("{}:{line}: {e}", path.display()));
            serde_json::from_str(json).map_err(fault)
        })
        .collect()
}

/// Shows how much of the time has passed until the work is done.
fn show_time(all: Duration, done: &AtomicBool) {
    let (mut progress, began) = (Progress::new("faults"), Instant::now());
    while !done.load(Ordering::Relaxed) {
        progress.show(began.elapsed().as_secs_f64() / all.as_secs_f64().max(1.0));
        std::thread::sleep(Duration::from_millis(500));
    }
}

/// Prints a row for each kind, end and fault; returns how many are above their limit.
fn print_table(kinds: &[LinkKind], all: &[Recovery]) -> usize {
    println!("kind          fault       end     runs  ship s  vehicle s  limit s");
    let mut late = 0;
    for &kind in kinds {
        for ((fault, _), end) in
            FAULTS.iter().flat_map(|fault| [FaultyEnd::Ship, FaultyEnd::Auv].map(|end| (fault, end)))
        {
            let is_of_row = |r: &&Recovery| r.kind == kind && r.fault == *fault && r.end == end;
            let rows: Vec<&Recovery> = all.iter().filter(is_of_row).collect();
            if rows.is_empty() {
                continue;
            }
            let usual = |of: fn(&Recovery) -> f64| percentile_95(rows.iter().map(|r| of(r)).collect());
            let (ship_s, vehicle_s) =
                (usual(|r| r.ship_s.unwrap_or(f64::INFINITY)), usual(|r| r.vehicle_s.unwrap_or(f64::INFINITY)));
            let is_late = usual(Recovery::worst_s) > kind.limit_s();
            late += usize::from(is_late);
            println!(
                "{:<13} {fault:<11} {:<7} {:>4} {ship_s:>7.1} {vehicle_s:>10.1} {:>8.0}{}",
                format!("{kind:?}"),
                end.name(),
                rows.len(),
                kind.limit_s(),
                if is_late { "  ABOVE" } else { "" }
            );
        }
    }
    late
}
