//! `scenecast-bench wide`

use super::{WideFigures, WideSetting, wide};
use clap::Args;
use scenecast_core::{Takes, UserError};
use scenecast_files::write_whole;
use scenecast_tools::Progress;
use std::path::PathBuf;

/// A wide survey at the surface: CPU time and bytes of an update of the page, of loading page and map, and of each
/// export, and the memory of the map.
///
/// The map arrives through the link, frame by frame, without loss. The same seed gives the same bytes.
#[derive(Debug, Args)]
#[command(after_help = "Example: scenecast-bench wide --cells 250000 --box 5000")]
pub(crate) struct WideBench {
    /// Print JSON instead of a table
    #[arg(long)]
    json: bool,
    /// Seed of all random numbers
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Number of explored cells on the map
    #[arg(long, default_value_t = 1_000_000, value_parser = clap::value_parser!(u32).range(1000..=4_000_000))]
    cells: u32,
    /// Side of the square that the survey spans, metres
    #[arg(long = "box", value_name = "METRES", default_value_t = 20_000.0, value_parser = side)]
    box_m: f64,
    /// Number of cells of an update
    #[arg(long, default_value_t = 500, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    update: u32,
    /// Leave out the layer of depths
    #[arg(long)]
    labels_only: bool,
    /// Folder for the exports of the map
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

fn side(text: &str) -> Result<f64, Takes> {
    text.parse().ok().filter(|side| (100.0..=50_000.0).contains(side)).ok_or(Takes("the range is 100 to 50000"))
}

impl WideBench {
    pub(crate) fn run(self) -> Result<(), UserError> {
        let config = scenecast_config::load(None, &[])?;
        let setting = WideSetting {
            cells: self.cells as usize,
            box_m: self.box_m,
            update: self.update as usize,
            updates: 20,
            depth: !self.labels_only,
        };
        let mut progress = Progress::new("cells");
        if let Some(dir) = &self.out {
            std::fs::create_dir_all(dir).map_err(|e| UserError::file(dir, e))?;
        }
        let mut keep = |extension: &str, bytes: &[u8]| match &self.out {
            Some(dir) => write_whole(&dir.join(format!("map.{extension}")), bytes),
            None => Ok(()),
        };
        let figures = wide(&config, setting, self.seed, &mut |share| progress.show(share), &mut keep)?;
        drop(progress);
        if self.json {
            let text = serde_json::to_string_pretty(&figures).map_err(UserError::failed)?;
            println!("{text}");
        } else {
            print(&figures);
        }
        Ok(())
    }
}

fn print(f: &WideFigures) {
    let u = &f.update;
    println!(
        "{} explored cells in a square of {:.0} m, {} layer(s) beside the labels",
        f.explored_cells, f.box_m, f.layers
    );
    if let Some(bytes) = f.surface_bytes {
        println!("memory of the map at both ends of the link: {:.1} MB", bytes as f64 / 1e6);
    }
    println!();
    println!(
        "update of {:.0} cells: {:.2} ms CPU ({:.2} ms in the link's loop), {:.0} bytes of tiles",
        u.cells,
        u.link_loop_ms + u.tiles_ms,
        u.link_loop_ms,
        u.tiles_bytes
    );
    println!("state, sent with it: {:.0} bytes", u.state_bytes);
    println!(
        "load: {} bytes (page {}, map {}), {:.0} ms CPU for the map",
        f.page_bytes + f.map_bytes,
        f.page_bytes,
        f.map_bytes,
        f.map_ms
    );
    println!();
    println!("export          CPU ms        bytes");
    for e in &f.exports {
        match &e.refused {
            None => println!("{:<12} {:>9.0} {:>12}", e.format, e.cpu_ms, e.bytes),
            Some(reason) => println!("{:<12} {reason}", e.format),
        }
    }
}
