//! `scenecast-bench steering`

use super::{SteeringFigures, SteeringPair, measure_steering};
use clap::Args;
use scenecast_core::UserError;
use scenecast_tools::Progress;
use scenecast_tools::commands::SeedArguments;

/// The effect of a weighed label on the survey of a drawn reef: two rehearsals a seed, one with the order and one without.
///
/// After two minutes the operator weighs a label +0.8 and exploration 0.1: the label whose share of the vehicle's map is
/// nearest to 10 %, of those of which more lies outside of the seen area than inside. Its true area is where the vehicle's
/// model finds it once it has been shown the whole sea floor. `gain` is the time that the camera spends over that area in
/// the next ten minutes, divided by the same time without the order; `class gain` is the same over the true class of most
/// of that area, of which the label may be a part only. `stay` is the longest time that the vehicle stays within 2 m
/// without a report that it holds. `turn` is the time from the vehicle's receipt of the order until its heading is within 30
/// degrees of the way to its nearest cell of the label that it has not looked at since (at most 20 s are
/// waited for), and `purpose` that of the vehicle's plan after 20 s.
///
/// The exit code is 1 if the median gain is below 2 or a stay lasts a minute. The same seed gives the same figures.
#[derive(Debug, Args)]
#[command(after_help = "Example: scenecast-bench steering --seeds 4 --seed 9")]
pub(crate) struct SteeringBench {
    /// Print JSON instead of a table
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    seeds: SeedArguments,
    /// Set a configuration value, as in survey.planner=greedy; may be repeated
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
}

impl SteeringBench {
    pub(crate) fn run(self) -> Result<(), UserError> {
        let ours = ["operator.script=none", "world.kind=reef", "survey.duration_s=720"].map(str::to_owned);
        let sets: Vec<String> = ours.into_iter().chain(self.sets.iter().cloned()).collect();
        let config = scenecast_config::load(None, &sets)?;
        if !self.json {
            println!(
                "seed label  share  seen m²  unseen m²   with s  without s   gain  class            class gain  stay s  turn s  purpose"
            );
        }
        let mut progress = Progress::new("seeds");
        let mut done = 0.0;
        let figures = measure_steering(&config, (self.seeds.first, self.seeds.count), &mut |pair| {
            done += 1.0;
            progress.show(done / self.seeds.count as f64);
            if !self.json {
                print(pair);
            }
        })?;
        drop(progress);
        self.finish(&figures)
    }

    fn finish(&self, figures: &SteeringFigures) -> Result<(), UserError> {
        if self.json {
            println!("{}", serde_json::to_string_pretty(figures).map_err(UserError::failed)?);
        } else {
            println!(
                "median gain {:.2}, class gain {:.2}; longest stay {} s; turned to the label in {} of {}",
                figures.median_gain,
                figures.median_class_gain,
                figures.longest_stay_s,
                figures.turned(),
                figures.pairs.len()
            );
        }
        let missed = figures.missed();
        if missed.is_empty() { Ok(()) } else { Err(UserError::Failed(missed.join("; "))) }
    }
}

fn print(p: &SteeringPair) {
    println!(
        "{:>4} {:>5} {:>5.1}% {:>8.1} {:>10.1} {:>8.1} {:>10.1} {:>6.2}  {:<16} {:>10.2} {:>7} {:>7}  {}",
        p.seed,
        p.label,
        100.0 * p.share,
        p.seen_m2,
        p.unseen_m2,
        p.with_s,
        p.without_s,
        p.gain,
        p.class,
        p.class_gain,
        p.longest_stay_s,
        p.turned_s.map_or("-".to_owned(), |seconds| seconds.to_string()),
        p.purpose
    );
}
