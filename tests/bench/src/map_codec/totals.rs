//! Bytes and CPU time of the chunks of series of maps.

use cpu_time::ThreadTime;
use scenecast_protocol::map::LabelGrid;
use scenecast_protocol::map_codec::{Codec, LabelRaster, decode, encode_all};
use scenecast_tools::Zopfli;
use std::time::Duration;

/// Maximum bytes of a chunk.
const ROOMS: [usize; 3] = [64, 256, 1000];

/// Sums over steps of series; those in three parts by the rooms.
#[derive(Default)]
pub(super) struct Totals {
    steps: usize,
    full_png: usize,
    best_png: usize,
    bytes: [usize; 3],
    chunks: [usize; 3],
    encode: [Duration; 3],
    slowest: [Duration; 3],
    decode: [Duration; 3],
}

impl Totals {
    pub(super) fn add(&mut self, other: &Self) {
        self.steps += other.steps;
        self.full_png += other.full_png;
        self.best_png += other.best_png;
        for i in 0..ROOMS.len() {
            self.bytes[i] += other.bytes[i];
            self.chunks[i] += other.chunks[i];
            self.encode[i] += other.encode[i];
            self.decode[i] += other.decode[i];
            self.slowest[i] = self.slowest[i].max(other.slowest[i]);
        }
    }

    pub(super) fn print(&self, name: &str) {
        let steps = self.steps.max(1);
        print!("{name:<18} full {:6} best {:5} |", self.full_png / steps, self.best_png / steps);
        for (i, room) in ROOMS.iter().enumerate() {
            print!(
                " {room:4}: {:5} B {:.3} {:4.1} ch {:4.1}+{:4.1} max {:4.1} ms |",
                self.bytes[i] / steps,
                self.bytes[i] as f64 / self.best_png as f64,
                self.chunks[i] as f64 / steps as f64,
                self.encode[i].as_secs_f64() * 1000.0 / steps as f64,
                self.decode[i].as_secs_f64() * 1000.0 / steps as f64,
                self.slowest[i].as_secs_f64() * 1000.0,
            );
        }
        println!(" of full {:.3}", self.bytes[2] as f64 / self.full_png as f64);
    }

    /// Adds the steps between the maps of a series, and the sizes of the best PNG files if `png`.
    pub(super) fn measure(&mut self, maps: &[LabelRaster], png: bool) {
        for pair in maps.windows(2) {
            let [before, after] = pair else { continue };
            if before == after {
                continue;
            }
            self.steps += 1;
            if png {
                self.full_png += after.smallest_png(&mut Zopfli);
                self.best_png += after.smallest_delta_png(before, &mut Zopfli);
            }
            let (base, target) = (before.to_grid(), after.to_grid());
            for (i, &room) in ROOMS.iter().enumerate() {
                self.step(i, room, &base, &target);
            }
        }
    }

    fn step(&mut self, i: usize, room: usize, base: &LabelGrid, target: &LabelGrid) {
        let start = ThreadTime::now();
        let chunks = encode_all(Codec::Auto, base, target, room).expect("room for a cell");
        let encoded = start.elapsed();
        self.encode[i] += encoded;
        self.slowest[i] = self.slowest[i].max(encoded);
        let start = ThreadTime::now();
        let mut replica = base.clone();
        for chunk in &chunks {
            for (cell, label) in decode(base, &chunk.bytes).expect("own chunk") {
                replica.set(cell, label);
            }
        }
        self.decode[i] += start.elapsed();
        assert_eq!(&replica, target);
        self.bytes[i] += chunks.iter().map(|chunk| chunk.bytes.len()).sum::<usize>();
        self.chunks[i] += chunks.len();
    }
}
