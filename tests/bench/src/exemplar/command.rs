//! `scenecast-bench exemplar`

use super::{ArrivalSetting, Arrivals, Bytes, PatchSource, Spread, arrivals, photos, sizes};
use clap::Args;
use scenecast_core::UserError;
use scenecast_tools::Progress;
use serde_json::json;
use std::path::PathBuf;

/// Number of procedural reefs if no photos are given.
const REEFS: u64 = 6;

/// The time from the order of an exemplar to its last bit at 10 kbit/s, with 10 % of the frames lost, while the map
/// uses all spare capacity; and the bytes that an image needs for a structural similarity of at least 0.9 with its
/// patch (Wang et al. 2004: luma, Gaussian window of 11 x 11 pixels).
///
/// The patches are those that the vehicle picks on a flight over procedural reefs, or over photos at a centimetre a
/// pixel. It takes a minute or two; the same seed gives the same table.
#[derive(Debug, Args)]
#[command(after_help = "Example: scenecast-bench exemplar --images photos --images more-photos")]
pub(crate) struct ExemplarBench {
    /// Print JSON instead of a table
    #[arg(long)]
    json: bool,
    /// Seed of all random numbers
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Folder of photos of the sea floor, .jpg or .png; may be repeated [default: procedural reefs]
    #[arg(long, value_name = "DIR")]
    images: Vec<PathBuf>,
    /// Number of images to request in each row
    #[arg(long, default_value_t = 60, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    requests: u32,
}

impl ExemplarBench {
    pub(crate) fn run(self) -> Result<(), UserError> {
        let sources = match self.images.as_slice() {
            [] => (0..REEFS).map(|i| PatchSource::Reef(self.seed + i)).collect(),
            dirs => dirs.iter().map(|dir| photos(dir)).collect::<Result<Vec<_>, _>>()?.concat(),
        };
        let mut progress = Progress::new("images");
        let (bytes, patches) = sizes(&sources, self.seed, &mut |share| progress.show(share))?;
        drop(progress);
        if patches.is_empty() {
            return Err(UserError::Failed("no label held long enough to have an image".to_owned()));
        }
        let requests = self.requests as usize;
        let full = ArrivalSetting { requests, loss: 0.1, loaded: true, larger: false };
        let settings = [
            ("full load", full),
            ("full load, larger", ArrivalSetting { larger: true, ..full }),
            ("idle", ArrivalSetting { loaded: false, ..full }),
        ];
        let mut rows: Vec<(&str, Arrivals)> = Vec::new();
        let mut progress = Progress::new("requests");
        for (i, (name, setting)) in settings.into_iter().enumerate() {
            let mut show = |share: f64| progress.show((i as f64 + share) / settings.len() as f64);
            rows.push((name, arrivals(setting, &patches, self.seed, &mut show)?));
        }
        drop(progress);
        if self.json {
            let arrivals: serde_json::Map<String, _> = rows.iter().map(|(n, a)| ((*n).to_owned(), json!(a))).collect();
            let text = serde_json::to_string_pretty(&json!({ "arrival": arrivals, "bytes": bytes }));
            println!("{}", text.map_err(UserError::failed)?);
        } else {
            print(&rows, &bytes);
        }
        Ok(())
    }
}

fn print(rows: &[(&str, Arrivals)], bytes: &Bytes) {
    println!("10 kbit/s, 10 % of the frames lost. Seconds from the order to the image:");
    println!("row                  requested arrived   median     p95     max  in 30 s  bytes median  vehicle bit/s");
    for (name, a) in rows {
        let s = a.seconds.map_or([0.0; 3], in_order);
        println!(
            "{name:<20} {:>9} {:>7} {:>8.1} {:>7.1} {:>7.1} {:>7.1}% {:>13.0} {:>14.0}",
            a.requested,
            a.arrived,
            s[0],
            s[1],
            s[2],
            100.0 * a.within_30_s,
            a.bytes.map_or(0.0, |b| b.median),
            a.sent_bps
        );
    }
    println!();
    println!("Bytes of the patches that the vehicle picked, from {} sources:", bytes.sources);
    println!(
        "edge  patches  fewest at SSIM 0.9: median    p95    max  sent: median    p95    max  at 0.9  SSIM median    min"
    );
    for s in &bytes.sizes {
        let sent = s.sent.map_or([0.0; 3], in_order);
        let fewest = s
            .fewest
            .map(in_order)
            .map_or(["-".to_owned(), "-".to_owned(), "-".to_owned()], |f| f.map(|n| format!("{n:.0}")));
        println!(
            "{:>4} {:>8} {:>27} {:>6} {:>6} {:>13.0} {:>6.0} {:>6.0} {:>6.0}% {:>12.3} {:>6.3}",
            s.edge_px,
            s.patches,
            fewest[0],
            fewest[1],
            fewest[2],
            sent[0],
            sent[1],
            sent[2],
            100.0 * s.similar_share,
            s.ssim[0],
            s.ssim[1]
        );
    }
    let tenths: Vec<String> = bytes.tenths.iter().map(|n| format!("{n:.0}")).collect();
    println!("Sent with an edge of 64 pixels, by tenths: {}", tenths.join(" "));
}

fn in_order(s: Spread) -> [f64; 3] {
    [s.median, s.p95, s.max]
}
