//! A large map with a few changes everywhere: time to the first chunk, and memory.

use scenecast_protocol::map::{Cell, MapSource, StateSource};
use scenecast_protocol::map_codec::{Codec, LabelRaster};
use scenecast_protocol::time::Instant;
use scenecast_training::{MapRng, MapScene, sampler_noise};

const SIDE: usize = 2048;

/// Prints the time to the first chunk of 256 bytes and the process's memory, with 1 % of the cells changed.
pub(super) fn measure() {
    println!("{SIDE} x {SIDE} cells, 1 % changed");
    let mut rng = MapRng::new(5);
    let patch = MapScene::Colonies.draw(&mut rng, 256, 256, 8);
    let mut source = MapSource::new(Codec::Auto);
    for row in 0..SIDE {
        let cells: Vec<_> = (0..SIDE).map(|column| (at(column, row), patch.get(column % 256, row % 256))).collect();
        source.set(cells.iter().copied(), Instant::ZERO);
        source.handle_fate(cells, true, Instant::ZERO);
    }
    println!("settled: {}", memory());
    for row in (0..SIDE).step_by(64) {
        let labels = (0..64 * SIDE).map(|i| patch.get(i % SIDE % 256, (row + i / SIDE) % 256)).collect();
        let mut strip = LabelRaster { width: SIDE, height: 64, labels };
        sampler_noise(&mut rng, &mut strip, 0, 11_500);
        let cells = strip.labels.iter().enumerate().map(|(i, &label)| (at(i % SIDE, row + i / SIDE), label));
        source.set(cells, Instant::from_secs_f64(1.0));
    }
    println!("changed: {}", memory());
    for name in ["first", "second", "third"] {
        let start = cpu_time::ThreadTime::now();
        let chunk = source.next_chunk(256, Instant::from_secs_f64(2.0));
        let (bytes, cells) = chunk.map_or((0, 0), |(bytes, cells)| (bytes.len(), cells.len()));
        println!("{name} chunk: {:.1} ms of CPU, {bytes} bytes, {cells} cells", start.elapsed().as_secs_f64() * 1000.0);
    }
    println!("after: {}", memory());
}

fn at(column: usize, row: usize) -> Cell {
    Cell::new(column as i32, row as i32)
}

/// Current and highest memory of the process, where the system reports it.
fn memory() -> String {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let lines = status.lines().filter(|line| line.starts_with("VmRSS") || line.starts_with("VmHWM"));
    lines.map(|line| line.split_whitespace().collect::<Vec<_>>().join(" ")).collect::<Vec<_>>().join(", ")
}
