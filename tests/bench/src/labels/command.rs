//! `scenecast-bench labels`

use super::site::Site;
use super::{LabelRow, MapFigures, measure, picture};
use crate::surveys::{nats, print_json};
use clap::Args;
use scenecast_core::UserError;
use scenecast_files::write_whole;
use scenecast_tools::Progress;
use scenecast_tools::commands::SeedArguments;
use std::io::Cursor;
use std::path::PathBuf;

/// Flights over a floor, and over each of its other sights.
const FLIGHTS: f64 = 7.0;

/// Whether one habitat has one label, whenever, in whatever order and on whichever path it was seen.
///
/// A virtual camera flies over each floor line by line, over the same frames in reversed order, and column by column; the labels are those
/// of the vehicle under way, and below those after five minutes in which the vehicle sees nothing new. `V` is the V-measure against the
/// true classes, of all labels and with the tree cut at 8; `orders` and `paths` are the agreement (normalised mutual information) of the
/// maps of two orders and of two paths; `within` and `across` the shares of neighbours of one class that have one label, first seen
/// together and far apart in time; `drift` the share of the variance between cells of one class that the time of their first sight
/// explains; `changed` the share of cells that change their label in five minutes, in the second half of the survey,
/// and below the share that the rest corrects; `cpu` the share of a core. Then the mutual information with the true classes, of the clear
/// floor and of grey, turbid, dark and blurred copies, nats. A mosaic NAME.jpg has its classes in NAME_label.png. Apart from the time of
/// the processor, the same floors give the same figures.
#[derive(Debug, Args)]
#[command(after_help = "Example: scenecast-bench labels --seeds 5 --out labels")]
pub(crate) struct LabelsBench {
    /// Print JSON instead of a table
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    seeds: SeedArguments,
    /// Images of sea floors, in place of drawn reefs, sand and a featureless floor
    #[arg(long, value_name = "IMG", num_args = 1..)]
    mosaics: Vec<PathBuf>,
    /// Images with the classes of the mosaics, one for each in their order, in place of NAME_label.png
    #[arg(long, value_name = "IMG", num_args = 1.., requires = "mosaics")]
    classes: Vec<PathBuf>,
    /// The class of pixels that are not annotated
    #[arg(long, value_name = "N", default_value_t = 255)]
    no_class: u8,
    /// Write a picture of the maps of each floor: along, back, across, the true classes, seams
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

impl LabelsBench {
    pub(crate) fn run(self) -> Result<(), UserError> {
        if let Some(dir) = &self.out {
            std::fs::create_dir_all(dir).map_err(|e| UserError::file(dir, e))?;
        }
        let SeedArguments { first, count } = self.seeds;
        let floors = if self.mosaics.is_empty() { count as usize + 2 } else { self.mosaics.len() };
        let site = |index: usize| match (self.mosaics.get(index), index as u64) {
            (Some(path), _) => Site::mosaic(path, self.classes.get(index).map(PathBuf::as_path), self.no_class),
            (None, reef) if reef < count => Ok(Site::reef(first + reef)),
            (None, other) if other == count => Ok(Site::sand()),
            (None, _) => Ok(Site::featureless()),
        };
        if !self.json {
            print_head();
        }
        let (mut progress, mut done, mut rows) = (Progress::new("flights"), 0.0, Vec::new());
        for index in 0..floors {
            let site = site(index)?;
            let (row, flights) = measure(&site, &mut || {
                done += 1.0;
                progress.show(done / (FLIGHTS * floors as f64));
            });
            if let Some(dir) = &self.out {
                let mut bytes = Cursor::new(Vec::new());
                let drawn = picture::of(&site, &flights).write_to(&mut bytes, image::ImageFormat::Png);
                drawn.map_err(UserError::failed)?;
                write_whole(&dir.join(format!("{}.png", site.name.replace(' ', "-"))), bytes.get_ref())?;
            }
            if !self.json {
                print_row(&row);
            }
            rows.push(row);
        }
        if self.json {
            return print_json(&serde_json::json!({ "floors": rows }));
        }
        Ok(())
    }
}

fn print_head() {
    println!(
        "{:<16} {:>6} {:>5} {:>5} {:>6} {:>5} {:>5} {:>5} {:>6} {:>6} {:>7} {:>5} {:>5} {:>6} {:>6} {:>6} {:>6} {:>7}",
        "floor",
        "labels",
        "V",
        "at 8",
        "orders",
        "at 8",
        "paths",
        "at 8",
        "within",
        "across",
        "changed",
        "drift",
        "cpu",
        "clear",
        "grey",
        "turbid",
        "dark",
        "blurred"
    );
}

fn print_row(r: &LabelRow) {
    let sight = |name: &str| nats(r.sights.get(name).copied());
    print_map(&r.site, &r.under_way, r.relabelled);
    println!(
        " {:>5} {:>5.3} {:>6} {:>6} {:>6} {:>6} {:>7}",
        nats(r.drift),
        r.cpu,
        sight("clear"),
        sight("grey"),
        sight("turbid"),
        sight("dark"),
        sight("blurred")
    );
    print_map("  at rest", &r.rested, r.corrected);
    println!();
}

fn print_map(name: &str, m: &MapFigures, changed: f64) {
    print!(
        "{name:<16} {:>6} {:>5.3} {:>5.3} {:>6.3} {:>5.3} {:>5.3} {:>5.3} {:>6} {:>6} {changed:>7.3}",
        m.labels,
        m.v_measure,
        m.v_measure_at_8,
        m.orders,
        m.orders_at_8,
        m.paths,
        m.paths_at_8,
        nats(m.within),
        nats(m.across),
    );
}
