//! `scenecast-bench surfaces`

use super::{ScheduleFigures, hold_of_second_s, run_schedule};
use crate::surveys::print_json;
use clap::Args;
use scenecast_core::UserError;
use scenecast_tools::Progress;

/// Three surfaces with one key and one vehicle, in virtual time: random schedules of orders, take-overs, crashes, lost memory and
/// losses on the link, each with another access to the medium.
///
/// No order may be applied after a newer one of its kind, and each order has an end once its surface has had the vehicle for itself.
/// Then the seconds until a hold of the second surface is applied at 1 km, while the first one has the vehicle. The exit code is 1 if
/// a promise is broken. The same seed gives the same figures.
#[derive(Debug, Args)]
#[command(after_help = "Example: scenecast-bench surfaces --schedules 20")]
pub(crate) struct SurfacesBench {
    /// Print JSON instead of a table
    #[arg(long)]
    json: bool,
    /// Number of schedules
    #[arg(long, default_value_t = 200, value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    schedules: u64,
    /// First seed
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

impl SurfacesBench {
    pub(crate) fn run(self) -> Result<(), UserError> {
        let mut progress = Progress::new("schedules");
        let (mut schedules, mut holds) = (Vec::new(), Vec::new());
        for number in 0..self.schedules {
            let seed = self.seed.wrapping_add(number);
            schedules.push((seed, run_schedule(seed)));
            holds.push(hold_of_second_s(seed));
            progress.show((number + 1) as f64 / self.schedules as f64);
        }
        if self.json {
            print_json(&serde_json::json!({ "schedules": schedules, "hold_s": holds }))?;
        } else {
            print(&schedules, &holds);
        }
        let broken = schedules.iter().filter(|(_, s)| !s.regressions.is_empty() || !s.open.is_empty()).count();
        let late = holds.iter().filter(|hold| hold.is_none()).count();
        match broken + late {
            0 => Ok(()),
            count => Err(UserError::Failed(format!("{count} broken promises"))),
        }
    }
}

fn print(schedules: &[(u64, ScheduleFigures)], holds: &[Option<f64>]) {
    let sum = |count: fn(&ScheduleFigures) -> usize| schedules.iter().map(|(_, s)| count(s)).sum::<usize>();
    println!("{} schedules: {} orders given, {} applied", schedules.len(), sum(|s| s.orders), sum(|s| s.applied));
    println!("orders applied after newer ones of their kind   {:>5}", sum(|s| s.regressions.len()));
    println!("orders without an end                           {:>5}", sum(|s| s.open.len()));
    let applied: Vec<f64> = holds.iter().flatten().copied().collect();
    let mean = applied.iter().sum::<f64>() / applied.len().max(1) as f64;
    let worst = applied.iter().copied().fold(0.0, f64::max);
    println!("seconds until a hold of the second surface is applied at 1 km: mean {mean:.1}, worst {worst:.1}");
    println!("holds that were not applied                     {:>5}", holds.len() - applied.len());
    for (seed, schedule) in schedules {
        for fault in schedule.regressions.iter().chain(&schedule.open) {
            println!("    BROKEN, seed {seed}: {fault}");
        }
    }
}
