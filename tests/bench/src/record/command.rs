//! `scenecast-bench record`

use super::{RecordFigures, judge};
use crate::surveys::print_json;
use clap::Args;
use scenecast_core::UserError;
use scenecast_tools::Progress;

/// The most seconds that a power cut may take.
const MAX_LOST_S: f64 = 2.0;

/// Records of missions in virtual time over a link that loses 0 to 45 % of the frames.
///
/// The maps of both sides at each second of a replay are compared with those of the mission. Both records are cut at random moments,
/// made whole, and read. The exit code is 1 if a map differs, or if a cut takes more than two seconds.
#[derive(Debug, Args)]
#[command(after_help = "Example: scenecast-bench record --missions 3 --duration 300")]
pub(crate) struct RecordBench {
    /// Print JSON instead of a table
    #[arg(long)]
    json: bool,
    /// Number of missions
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u64).range(1..=1000))]
    missions: u64,
    /// First seed
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Duration of each survey in seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 600.0)]
    duration: f64,
    /// Power cuts of each mission
    #[arg(long, default_value_t = 10)]
    cuts: usize,
}

impl RecordBench {
    pub(crate) fn run(self) -> Result<(), UserError> {
        let mut progress = Progress::new("missions");
        let mut rows = Vec::new();
        for number in 0..self.missions {
            let (seed, loss) = (self.seed + number, f64::from((number % 10) as u32) * 0.05);
            let sets = [format!("survey.duration_s={:?}", self.duration), format!("channel.loss={loss:?}")];
            let config = scenecast_config::load(None, &sets)?;
            let dir = std::env::temp_dir().join(format!("scenecast-bench-record-{}-{seed}", std::process::id()));
            rows.push(judge(&config, seed, self.cuts, &dir)?);
            progress.show((number + 1) as f64 / self.missions as f64);
        }
        drop(progress);
        if self.json {
            print_json(&serde_json::json!(rows))?;
        } else {
            print(&rows);
        }
        let differing: usize = rows.iter().map(|row| row.differing).sum();
        let late = rows.iter().filter(|row| row.worst_lost_s > MAX_LOST_S).count();
        match differing + late {
            0 => Ok(()),
            count => Err(UserError::Failed(format!("{count} broken promises"))),
        }
    }
}

fn print(rows: &[RecordFigures]) {
    println!("seed  loss  mission  maps  differ  cuts  lost at most  records      recorder  open    seek     report");
    for row in rows {
        let [surface, vehicle] = row.bytes.map(|bytes| bytes as f64 / 1e6);
        println!(
            "{:4} {:4.0} % {:6.0} s {:5} {:7} {:5} {:11.1} s {:4.1}+{:.1} MB {:9.2} % {:5.2} s {:5.0} ms {:5.2} s {:.2} MB",
            row.seed,
            row.loss * 100.0,
            row.mission_s,
            row.compared,
            row.differing,
            row.cuts,
            row.worst_lost_s,
            surface,
            vehicle,
            row.recorder_share * 100.0,
            row.open_s,
            row.worst_seek_s * 1e3,
            row.report_s,
            row.report_bytes as f64 / 1e6,
        );
    }
}
