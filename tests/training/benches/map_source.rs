//! Time and memory of a vehicle with a large map to choose its next chunk.
//!
//! `cargo bench -p scenecast-training --bench map_source`
#![allow(clippy::disallowed_methods)]

use scenecast_protocol::map::{Cell, MapSource, StateSource};
use scenecast_protocol::map_codec::Codec;
use scenecast_protocol::time::Instant;
use scenecast_training::{MapRng, MapScene};
use std::time::Duration;

const SIDE: usize = 2048;

fn main() {
    let tile = MapScene::ALL[0].draw(&mut MapRng::new(1), 512, 512, 8);
    let label = |i: usize| tile.get(i % SIDE % 512, i / SIDE % 512).max(1);
    let cell = |i: usize| Cell::new((i % SIDE) as i32 - 900, (i / SIDE) as i32 - 900);
    for (codec, room) in [(Codec::Context, 64), (Codec::Context, 256), (Codec::Auto, 1000), (Codec::Png, 256)] {
        let mut source = MapSource::new(codec);
        source.set_debounce(Duration::from_secs(4));
        time("set all", 1, || source.set((0..SIDE * SIDE).map(|i| (cell(i), label(i))), Instant::ZERO));
        accept_all(&mut source);
        let mut rng = MapRng::new(7);
        let now = Instant::from_secs_f64(10.0);
        let changes = SIDE * SIDE / 100;
        time("set 1 %", 1, || {
            let flips: Vec<usize> = (0..changes).map(|_| rng.below(SIDE * SIDE)).collect();
            source.set(flips.into_iter().map(|i| (cell(i), label(i) % 8 + 1)), now)
        });
        let later = Instant::from_secs_f64(20.0);
        time("first chunk", 1, || {
            source.handle_timeout(later);
            source
                .next_chunk(room, later)
                .map(|(bytes, carried)| println!("{} bytes, {} cells", bytes.len(), carried.len()))
        });
        time("next chunks, each", 20, || (0..20).filter(|_| source.next_chunk(room, later).is_some()).count());
        time("backlog", 1, || source.backlog_bytes());
        source.handle_peer_restart(later);
        time("after a restart, first chunk", 1, || source.next_chunk(room, later).is_some());
        println!("{codec}, {room} bytes: {} MB", memory_mb());
    }
}

/// Makes the surface hold everything; chunks of thousands of cells would take too long here.
fn accept_all(source: &mut MapSource) {
    let cells: Vec<_> = source.target().iter().collect();
    source.handle_fate(cells, true, Instant::ZERO);
    assert!(source.is_converged());
}

fn time<R>(name: &str, parts: u32, work: impl FnOnce() -> R) -> R {
    let start = std::time::Instant::now();
    let result = work();
    println!("  {name}: {:.2} ms", start.elapsed().as_secs_f64() * 1000.0 / f64::from(parts));
    result
}

fn memory_mb() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    line.and_then(|line| line.split_whitespace().next()?.parse::<u64>().ok()).unwrap_or_default() / 1024
}
